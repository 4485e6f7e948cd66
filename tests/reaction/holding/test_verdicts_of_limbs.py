"""Verdicts on limbs in words: one limit after the other of three limbs whose lengths and forces are known."""

import re

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep

CANNOT = "The device cannot hold this pose: "


def singular_pose(seed):
    """A random wrist and its first singular pose about a random axis."""
    exo = ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(seed), 3))
    axis = np.random.default_rng(seed).normal(size=3)

    def determinant(angle):
        return float(exo.singularity(Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))).determinant)

    angles = np.linspace(0.0, 3.0, 61)
    first = int(np.flatnonzero(np.diff(np.sign([determinant(angle) for angle in angles])))[0])
    angle = brentq(determinant, *angles[first : first + 2], xtol=1e-16, rtol=1e-15)
    return exo, Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))


def test_a_singular_pose_names_the_axis_that_nothing_holds():
    prototype = ep.load("prototype")
    lifted = prototype, prototype.pose(abduction=90)
    for exo, pose in (lifted, *(singular_pose(seed) for seed in (1, 2, 3))):
        answer = exo.reaction(pose, limits="none")
        assert answer.equilibrium_status == "singular"
        words = f"{CANNOT}it is singular, and the limbs cannot resist a moment about "
        assert answer.verdict.startswith(words)
        axis = np.array(re.search(r"\((-?\d.\d\d), (-?\d.\d\d), (-?\d.\d\d)\)", answer.verdict).groups(), dtype=float)
        # No tension gives a moment about that axis.
        on_arm = pose.as_matrix() @ np.array(exo.geometry.platform_points).T
        lines = on_arm.T - exo.geometry.base_points
        arms = np.cross(on_arm.T, lines / np.linalg.norm(lines, axis=1)[:, None])
        np.testing.assert_allclose(arms @ axis, 0.0, atol=0.01 * np.abs(arms).max())
        # It is named after the nearest of the three axes, in whose direction it points.
        nearest = int(np.abs(axis).argmax())
        assert axis[nearest] > 0.0
        name = ("forward", "sideways", "vertical")[nearest]
        angle = np.degrees(np.arccos(min(1.0, axis[nearest] / np.linalg.norm(axis))))
        told = re.search(r"an axis (\d+)° from the (\w+) axis", answer.verdict)
        if told is None:
            assert f"about the {name} axis" in answer.verdict
            assert angle < 1.6
        else:
            assert told.group(2) == name
            assert float(told.group(1)) == pytest.approx(angle, abs=1.1)
    stack = prototype.reaction(prototype.pose(abduction=[90.0, 90.0]))
    assert stack.verdict == "The device can hold none of 2 poses: the pose is singular (2)."
