"""Designs whose limbs have guides and whose shoulder has a stiffness."""

import numpy as np

import exo_pin as ep

GUIDE = ep.LimbGuide(40.0, 30.0)
SOFT_JOINTS = ep.LimbGuide(40.0, 30.0, joint_stiffness=2e5, joint_twist_stiffness=3e3)
RNG = np.random.default_rng(3)
STIFFNESS = (lambda m: m @ m.T)(RNG.normal(size=(3, 3)) * 100) + 1e4 * np.eye(3)


def unit_side_wrench(geometry, R, offset, i, guide):
    """Of limb i: s, moment of a unit force along s, unit side force, its moment about O, and stiffness against it.

    The moments about A_i and B_i are perpendicular to both axes of the joint there, so along n, the part of s across Y.
    Their difference is the force's own, perpendicular to s, which fixes their ratio.
    """
    a, b = geometry.base_points[i] + offset.base, R @ (geometry.platform_points[i] + offset.cuff)
    length = np.linalg.norm(b - a)
    s = (b - a) / length
    n_a, n_b = (np.cross(np.cross(y, s), y) for y in (geometry.base_points[i], R @ geometry.platform_points[i]))
    at_a, at_b = (n_b @ s) * n_a, (n_a @ s) * n_b
    force = np.cross(s, at_b - at_a) / length
    size = np.linalg.norm(force) * np.sign(-np.cross(a, b) @ force)
    force, at_a, at_b = force / size, at_a / size, at_b / size
    bend = [couple - (couple @ s) * s for couple in (at_a, at_b)]
    bending = length / 3 * sum(bend[j] @ bend[k] for j, k in ((0, 0), (0, 1), (1, 1)))
    compliance = bending / guide.bending_rigidity + (at_b @ s) ** 2 * length / guide.torsional_rigidity
    return s, np.cross(b, s), force, at_b + np.cross(b, force), 1.0 / compliance


def guided(exo, guide=GUIDE, stiffness=STIFFNESS):
    limbs = tuple(ep.Limb(limb.kind, guide=guide) for limb in exo.limbs)
    return exo.replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=stiffness))
