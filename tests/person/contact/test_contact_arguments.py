"""What a person and a contact query take and refuse, and how results are printed and kept."""

import json
import pickle
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from sockets import hanging

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName
from exo_pin.core.errors import MissingExtra

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")


from exo_pin.person.limb.myoarm import myoarm

PERSON = ep.Person(1.75, 75, "male")


def abduction(*degrees, side="left"):
    return ep.shoulder_rotation(0, np.array(degrees, dtype=float), 0, side=side, degrees=True)


def some_poses(count, seed, side="left"):
    angles = np.random.default_rng(seed).uniform([-15, 5, -30], [80, 100, 40], (count, 3)).T
    return ep.shoulder_rotation(*angles, side=side, degrees=True)


def test_person_and_result_survive_pickling():
    result = PERSON.joint_contact(abduction(40)[0])
    again = pickle.loads(pickle.dumps(PERSON)).joint_contact(abduction(40)[0])
    assert np.array_equal(result.force, again.force)
    assert np.array_equal(pickle.loads(pickle.dumps(result)).force, result.force)


def test_result_prints_and_turns_into_json(capsys):
    result = PERSON.joint_contact(abduction(60), device=np.zeros(6))
    assert capsys.readouterr() == ("", "")  # no bar that nobody asked for
    data = json.loads(result.to_json())
    assert data["percent_body_weight"][0] == pytest.approx(66.4, abs=0.2)
    assert data["without_device"]["status"] == ["ok"]
    single = PERSON.joint_contact(abduction(60)[0])
    for text in (str(single), str(result)):
        assert "% of body weight" in text
        assert "Assumptions" in text
    assert str(single).startswith("The joint carries")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"height": 175}, "height"),
        ({"mass": -1}, "mass"),
        ({"strength": 20}, "factor"),
        ({"elbow_flexion": 45}, "degrees=True"),
        ({"forearm_rotation": 2.0}, "forearm_rotation"),
        ({"sex": "other"}, "male"),
        ({"side": "up"}, "left"),
    ],
)
def test_wrong_persons_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        ep.Person(**{"height": 1.75, "mass": 75, "sex": "male", **change})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"power": 4}, "2 or 3"),
        ({"weights": "none"}, "equal"),
        ({"cone": "rim"}, "GlenoidCone"),
        ({"cone": hanging()}, "ratios only"),
        ({"centre_shift": (5, 0, 0)}, "millimetres"),
    ],
)
def test_wrong_options_are_refused(options, message):
    with pytest.raises(InvalidInput, match=message):
        ep.ContactOptions(**options)


def test_wrong_arguments_are_refused():
    with pytest.raises(InvalidInput, match="device"):
        PERSON.joint_contact(abduction(30), device=[1, 2, 3])
    with pytest.raises(InvalidInput, match="broadcast"):
        PERSON.joint_contact(abduction(30, 40), device=np.zeros((3, 6)))
    with pytest.raises(UnknownName):
        PERSON.joint_contact(abduction(30), outside="clip")
    with pytest.raises(InvalidInput, match="options"):
        PERSON.joint_contact(abduction(30), options={"power": 3})


def test_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "myo_sim", None)
    with pytest.raises(MissingExtra, match=r"\.\[person\]"):
        myoarm.__wrapped__()
    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(MissingExtra, match="clarabel"):
        PERSON.joint_contact(abduction(30.123))


def test_results_do_not_depend_on_threads():
    poses = [some_poses(6, seed) for seed in range(6)]

    def forces(pose):
        return PERSON.joint_contact(pose, outside="mark").force

    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(forces, poses))
    assert all(np.array_equal(forces(pose), other, equal_nan=True) for pose, other in zip(poses, together, strict=True))
