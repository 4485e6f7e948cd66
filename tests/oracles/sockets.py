"""Glenoid cones with an orientation: of a hanging scapula, and of one that follows the arm."""

import numpy as np

import exo_pin as ep


def hanging(*ratios, **details):
    """A socket that stays where the scapula of a hanging arm holds it."""
    turn = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)
    return ep.GlenoidCone(*ratios, orientation=turn, **details)


def following(*ratios, **details):
    """A socket that faces further forward and upward as the arm rises."""
    turns = ep.glenoid_orientation([35, 39, 45], [0, 34, 55], [-10, -3, 8], retroversion=5, inclination=8, degrees=True)
    return ep.GlenoidCone(*ratios, orientation=turns, elevation=[0, np.pi / 2, np.pi], **details)
