"""Remedies: the nearest pose that can be held, and the axis that nothing holds in a singular one."""

import re

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin.load_case.case import beyond_motion


@pytest.mark.parametrize("name", ["four-linear-actuators-worn", "four-cables"])
def test_what_is_suggested_holds_as_it_is_printed(name):
    """Typed in again: held, clear of the wearer, and within the range of motion."""
    exo, rng, asked = ep.load(name), np.random.default_rng(5), 0
    while asked < 4:
        pose = ep.shoulder_rotation(*rng.uniform([-40, -30, -60], [160, 120, 110]), degrees=True)
        if exo.reaction(pose).held:
            continue
        found = exo.remedy(pose)
        asked += 1
        if found.nearest is None:
            continue
        said = re.search(
            r"is (\d+)° away: flexion (-?\d+)°, abduction (-?\d+)°, internal rotation (-?\d+)°", str(found)
        )
        away, *angles = map(float, said.groups())
        again = ep.shoulder_rotation(*angles, degrees=True)
        answer = exo.reaction(again)
        assert answer.held
        assert not answer.clearance < 0.0
        assert not beyond_motion(again.as_matrix()[None], exo.side)[0]
        assert round(np.degrees((again * pose.inv()).magnitude())) == away
        assert ("looks the same" in str(found)) == bool(exo.accuracy(again).has_twin)


@pytest.mark.full
@pytest.mark.parametrize("name", ["four-linear-actuators-worn", "four-cables"])
def test_what_is_called_nearest_has_none_nearer(name):
    """Of 400 turns that are shorter by a tenth none leads to a pose that is held, clear and within the motion."""
    exo, rng, asked = ep.load(name), np.random.default_rng(8), 0
    while asked < 3:
        pose = ep.shoulder_rotation(*rng.uniform([-40, -30, -60], [160, 120, 110]), degrees=True)
        found = None if exo.reaction(pose).held else exo.remedy(pose)
        if found is None or found.nearest is None:
            continue
        asked += 1
        axes = rng.normal(size=(400, 3))
        sizes = 0.9 * found.nearest.distance * rng.uniform(0.0, 1.0, 400) ** (1.0 / 3.0)
        turns = Rotation.from_rotvec(axes / np.linalg.norm(axes, axis=1, keepdims=True) * sizes[:, None])
        nearer = turns * pose
        answer = exo.reaction(nearer)
        beyond = beyond_motion(nearer.as_matrix(), exo.side)
        assert not (answer.held & ~(answer.clearance < 0.0) & ~beyond).any()


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
