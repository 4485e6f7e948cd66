"""Remedies: the nearest pose that can be held, or what is missing."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

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
