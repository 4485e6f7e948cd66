"""Malformed arguments raise a typed error or mark their rows; none warns."""

import contextlib

import numpy as np
import pytest
from malformed_calls import junk

import exo_pin as ep
from exo_pin import ExoPinError

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

PERSON = ep.Person(1.75, 75, "male")
POSES = ep.shoulder_rotation(0, [30, 60], 0, degrees=True)
PERSONS = (
    "height",
    "mass",
    "sex",
    "strength",
    "cuff_strength",
    "scapular_motion",
    "elbow_flexion",
    "forearm_rotation",
    "payload",
    "side",
    "degrees",
)
OPTIONS = ("power", "weights", "passive", "cone", "load_on", "centre_shift", "socket_turn")
QUERIES = ("poses", "load", "motion", "device", "options", "gravity", "outside")
DEVICES = ("forces", "motion", "load", "limits", "centre_offset", "options", "outside", "person")


@pytest.fixture(scope="module")
def device():
    return ep.load("prototype")


def calls(device, rng):
    """One call of each kind with one argument of junk."""
    bad = junk(rng)

    def one(names):
        return {names[int(rng.integers(len(names)))]: bad}

    actions = (np.zeros(6), np.zeros((3, 6)), np.zeros(3), np.ones(3))
    yield lambda: ep.Person(**{"height": 1.7, "mass": 70, "sex": "male", **one(PERSONS)}).joint_contact(POSES[0])
    yield lambda: PERSON.joint_contact(POSES[0], options=ep.ContactOptions(**one(OPTIONS)))
    yield lambda: PERSON.joint_contact(**{"poses": POSES, **one(QUERIES)})
    yield lambda: device.joint_contact(POSES, **{"person": PERSON, **one(DEVICES)})
    yield lambda: device.joint_contact(POSES, PERSON, "least_effort", limits=bad)
    yield lambda: ep.DeviceAction(*[junk(rng) if rng.random() < 0.5 else good for good in actions])
    yield lambda: PERSON.centre_path(bad)
    yield lambda: device.worn_by(bad)


def test_malformed_calls(device):
    rng, answered, refused = np.random.default_rng(11), 0, 0
    for _ in range(30):
        for call in calls(device, rng):
            with contextlib.suppress(ExoPinError):
                answer = call()
                answered += 1
                if isinstance(answer, ep.JointContact):
                    held = answer.has_result
                    assert np.isfinite(answer.force[held]).all()
                    assert np.isnan(answer.force[~held]).all()
                continue
            refused += 1
    assert answered > 5
    assert refused > 150
