"""A missing extra is named, and threads share the model."""

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.core.errors import MissingExtra

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")


from exo_pin.person.limb.myoarm import myoarm

PERSON = ep.Person(1.75, 75, "male")


def abduction(degrees):
    return ep.shoulder_rotation(0, degrees, 0, degrees=True)


def test_missing_extra_is_named(monkeypatch):
    PERSON.joint_contact(abduction(30))
    monkeypatch.setitem(sys.modules, "myo_sim", None)
    with pytest.raises(MissingExtra, match=r"\.\[person\]"):
        myoarm.__wrapped__()
    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(MissingExtra, match="clarabel"):
        PERSON.joint_contact(abduction(30.123))


def test_results_do_not_depend_on_threads():
    angles = np.random.default_rng(0).uniform([-15, 5, -30], [80, 100, 40], (6, 6, 3))
    poses = [ep.shoulder_rotation(*each.T, degrees=True) for each in angles]

    def forces(pose):
        return PERSON.joint_contact(pose, outside="mark").force

    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(forces, poses))
    assert all(np.array_equal(forces(pose), other, equal_nan=True) for pose, other in zip(poses, together, strict=True))
