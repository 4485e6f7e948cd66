"""The first answer to a question about one pose: its size, and its numbers, names and counts read back."""

import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import run

import exo_pin as ep
from exo_pin.exo.first_answer import along
from exo_pin.exo.pose_report import KEPT, report_on_pose

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
import explained_answers
import first_answers

sys.path.pop()
MAN = ep.Person(1.75, 75, "male")


@pytest.fixture(scope="module")
def worn():
    return ep.load("four-linear-actuators-worn").worn_by(MAN)


def report(exo, *angles, person=MAN, **query):
    return report_on_pose(exo, exo.reaction(exo.pose(*angles), **query), person, angles=(*angles, 0.0, 0.0, 0.0)[:3])


@pytest.mark.parametrize("seed", [*range(10), *(pytest.param(seed, marks=pytest.mark.full) for seed in range(10, 60))])
def test_drawn_first_answers_are_read_back(seed):
    told = first_answers.drawn_case(seed)
    assert first_answers.read_back(told) == []
    assert explained_answers.explained(told) == []


def test_a_wrong_number_is_found(worn, monkeypatch):
    told = report(worn, 60.0, 30.0)
    text = str(told)
    assert first_answers.read_back(told) == []
    for right, wrong in (
        ("YES, it holds", "NO, it cannot hold"),
        ("31 N with the device", "32 N with the device"),
        ("at most 91 %", "at most 90 %"),
        ("41 out of the socket", "41 into the socket"),
        ("45 forward", "45 backward"),
        ("436 N", "437 N"),
        ("pulls 69 N", "pushes 69 N"),
        ("12 % of its limit", "13 % of its limit"),
        ("565 mm", "566 mm"),
        ("More: --explain", ""),
    ):
        assert right in text
        changed = text.replace(right, wrong, 1)
        monkeypatch.setattr(type(told), "__str__", lambda _, words=changed: words)
        assert first_answers.read_back(told), right


def test_the_first_answer_of_a_hanging_arm_is_traction(worn):
    told = report(worn)
    assert "down (traction)" in str(told)
    push = told.contact.glenoid @ -told.answer.shoulder_force
    assert push[1] == pytest.approx(-np.linalg.norm(push), rel=0.1)
    assert "(traction)" not in str(report(worn, 60.0))


def test_directions_leave_out_what_is_small():
    ways = (("a", "b"), ("c", "d"), ("e", "f"))
    assert along(np.array([100.0, -30.0, 9.0]), np.eye(3), ways) == "100 a, 30 d"
    assert along(np.zeros(3), np.eye(3), ways) == "nothing"


def test_muscles_that_keep_tension_are_relieved_less(worn):
    told = report(worn, 60.0, 30.0)
    assert list(told.reliefs) == [0.0, *KEPT]
    most, some, little = told.reliefs.values()
    assert most > some > little > 0.0
    bare = told.contact.without_device.activations
    for share, contact in told.kept.items():
        assert (contact.activations >= share * bare - 1e-9).all()
        # The device carries the rest: the cuff's moment is that share of the arm's.
        moment = np.cross(MAN.arm.centre_of_mass @ worn.pose(60, 30).as_matrix().T, [0, 0, -9.81 * MAN.arm.mass])
        np.testing.assert_allclose(contact.device_wrench[3:], -(1.0 - share) * moment, atol=1e-6)
    # A wearer who keeps all needs no device; what it then does is its own weight.
    options = ep.ContactOptions(kept_activation=1.0)
    same = worn.joint_contact(worn.pose(60, 30), MAN, forces=0.0, options=options)
    np.testing.assert_allclose(same.activations, bare, atol=1e-5)
    with pytest.raises(ep.InvalidInput, match="share of 0 to 1, got 30"):
        ep.ContactOptions(kept_activation=30.0)


def test_a_wearer_without_muscle_force_is_answered(worn):
    flaccid = MAN.with_changes(strength=0.0)
    pose = worn.pose(60)
    held = worn.joint_contact(pose, flaccid)
    assert held.status == "ok"
    # Nothing but the device holds the arm: the joint carries what equilibrium without muscles says.
    answer = worn.reaction(pose)
    np.testing.assert_allclose(held.force, answer.shoulder_force, atol=1e-6)
    assert not held.activations.any()
    assert "capsule and ligaments alone" in held.verdict
    assert held.residual < 1e-9
    bare = held.without_device
    assert bare.status == "too_weak"
    moment = np.cross(pose.as_matrix() @ MAN.arm.centre_of_mass, [0, 0, -9.81 * MAN.arm.mass])
    np.testing.assert_allclose(bare.missing_moment, -moment, atol=1e-9)
    # Something else has to hold a bent elbow, and the shoulder is answered all the same.
    bent = flaccid.with_changes(elbow_flexion=np.radians(90.0))
    other = worn.worn_by(bent).joint_contact(pose, bent)
    assert other.status == "ok"
    assert abs(other.missing_elbow[0]) > 1.0
    with pytest.raises(ep.InvalidInput, match="strength 0"):
        worn.joint_contact(pose, flaccid, forces="least_effort")
    assert "capsule and ligaments alone" in str(report(worn, 60.0, person=flaccid))


def test_a_pose_beyond_the_singular_surface_is_no_yes():
    prototype = ep.load("prototype").replace(limbs=[ep.Limb(actuator=ep.Actuator("linear", 1e5, 1e5))] * 3)
    path = prototype.pose(abduction=np.linspace(0.0, 30.0, 31))
    (crossed,) = prototype.reaction(path, limits="none").crossings()[:, 0]
    told = report(prototype, 0.0, float(crossed + 5), person=None)
    assert str(told).startswith("NO WAY TO IT.")


def test_a_force_on_the_hand_is_a_weight_in_it(capsys):
    """A pull of so many newtons down is a payload of that weight; a push up takes it away."""
    base = ["reaction", "--person", "1.75,75,male", "--flexion", "60", "--elbow-flexion", "40"]
    _, pulled, _ = run(capsys, *base, "--hand-force", "0,0,-19.62")
    _, held, _ = run(capsys, *base, "--payload", "2")
    _, lifted, _ = run(capsys, *base, "--payload", "2", "--hand-force", "0,0,19.62")
    _, bare, _ = run(capsys, *base)
    assert "pushed with 20 N" in pulled
    assert pulled.splitlines()[1:] == held.splitlines()[1:]
    assert lifted.splitlines()[1:3] == bare.splitlines()[1:3]
    status, _, err = run(capsys, "reaction", "prototype", "--hand-force", "0,0,-20")
    assert status == 2
    assert "give --person too" in err


def test_contact_of_an_answer_takes_no_other_assumptions(worn):
    answer = worn.reaction(worn.pose(60))
    for other in ({"centre_offset": (0.01, 0.0, 0.0)}, {"constraint_bounds": 5.0}, {"posture": "rest"}):
        with pytest.raises(ep.InvalidInput, match="has its own"):
            worn.joint_contact(worn.pose(60), MAN, answer, **other)
