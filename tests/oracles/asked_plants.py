"""Poses, wearers, paths and commands that the stored answers of the control room are asked with."""

import numpy as np
from places import URDF

import exo_pin as ep
from exo_pin import control

POSE = ep.shoulder_rotation(23.0, 37.0, -11.0, degrees=True)
SPIN = np.array([0.4, -0.7, 0.3])
SHOVE = ep.Load([7.0, -4.0, 3.0], [0.2, 0.3, -0.1], at=(0.02, -0.01, -0.25), frame="arm")
TISSUE = control.Passive(
    [2.0, 3.0, 1.0], [0.3, 0.2, 0.4], ep.shoulder_rotation(10.0, 20.0, 5.0, degrees=True), "a test"
)
SPASTIC = {"threshold": 0.3, "gain": 2.0, "limit": 0.5, "source": "a test"}
ENDS = {"plane of elevation": (-0.4, 0.9), "elevation": (0.0, 0.5), "axial rotation": (-0.1, 0.15)}
STOPS = control.JointStops(ENDS, 50.0, 2.0, source="a test")
PATH = control.AnglePath([0.0, 0.7, 1.9], np.radians([[5, 20, 0], [25, 40, -10], [20, 60, 15]]))


def waves(count):
    """A controller without memory, with commands that go to and fro."""
    return lambda t, seen: 0.3 * np.cos(np.arange(count) + 31.0 * t) + 0.2


def device(name):
    return ep.load(URDF / f"{name}.urdf")
