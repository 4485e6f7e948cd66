"""The first answer to a question about one pose: its size, and its numbers, names and counts read back."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.exo.first_answer import first_answer
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


#: Drawn cases that between them come by every line that any of the first sixty does.
QUICK = (40, 17, 38, 2, 10, 16, 30, 0, 7, 33, 36)
DRAWN = [*QUICK, *(pytest.param(seed, marks=pytest.mark.full) for seed in range(60) if seed not in QUICK)]


#: A limb that has no limit here.
LONG = ep.Limb(actuator=ep.Actuator("linear", 1e6, 1e6), stroke=ep.Stroke(0.3, 0.01, 2.0, 0.0))
#: Rare answers by what stands in them.
MADE = {
    "a singular pose is 0.0095° away": lambda: report(
        ep.load("prototype").replace(limbs=[ep.Limb(actuator=ep.Actuator("linear", 1e6, 1e6))] * 3), 0, 6.2, person=None
    ),
    "none here: the joint carries 31 % more than without the device": lambda: report(worn_device()),
    "not known if muscles keep tension": lambda: report(ep.load(URDF / "spring-support.urdf").worn_by(MAN), 60),
    "IT SUPPORTS, and the wearer holds.   flexion 170°": lambda: report(
        ep.load(URDF / "spring-support.urdf").worn_by(MAN), 170, person=None
    ),
    "limit not known   0° of -25 to 80": lambda: report(ep.load(URDF / "nesm.urdf").worn_by(MAN), 60, person=None),
    "In the joint not known: the pose is outside the range of motion": lambda: report(worn_device(), 100, 100),
    "limits not asked": lambda: report(worn_device(), 60, limits="none"),
    "YES, if estimates are right.": lambda: report(estimated(), 20, 40, person=None),
    "PROBABLY NOT.": lambda: report(estimated(None), 20, 40, person=None),
    "Assumed massless limbs; ": lambda: report(
        ep.load("prototype"), 20, person=None, split="minimal", constraint_bounds=20.0, limits="none"
    ),
    "presses 1.7 kPa": lambda: report(worn_device(), 60),
    "cannot be": lambda: replace(
        there := report(worn_device(), 60),
        kept={share: each if share > 0.5 else lost(each) for share, each in there.kept.items()},
    ),
    "device off by (4, -3, 2) mm, pushed with 5.0 N": lambda: pushed(),
    "NO WAY TO IT. flexion 60° left arm It would hold here, but every way": lambda: report(
        ep.load("prototype").replace(limbs=[LONG] * 3), 60, person=None
    ),
    "NO WAY TO IT. flexion 60° left arm Every way from rest": lambda: report(
        ep.load("prototype").replace(limbs=[replace(LONG, stroke=None)] * 3), 60, person=None
    ),
}


def worn_device():
    return ep.load("four-linear-actuators-worn").worn_by(MAN)


def estimated(longest=2.0):
    """The prototype with strong drives and its estimated fittings, its strokes long enough or its own."""
    own, drive = ep.load("prototype"), ep.Actuator("linear", 900.0, 900.0)
    limbs = [
        replace(
            limb, actuator=drive, stroke=replace(limb.stroke, shortest=0.3, longest=longest) if longest else limb.stroke
        )
        for limb in own.limbs
    ]
    return own.replace(limbs=limbs, estimated=own.mechanism.estimated)


def lost(contact):
    """A joint force that is not known."""
    return replace(contact, status=np.array("too_weak"), force=np.full(3, np.nan))


def pushed():
    exo, offset = worn_device(), (4.0, -3.0, 2.0)
    load = ep.Load([0.0, 3.0, -4.0], at=[0.0, 0.0, -0.2])
    answer = exo.reaction(exo.pose(60), load=load, centre_offset=np.multiply(offset, 1e-3))
    return report_on_pose(exo, answer, MAN, angles=(60.0, 0.0, 0.0), offset=offset)


@pytest.mark.parametrize("words", MADE, ids=map(str, range(len(MADE))))
def test_rare_answers_are_read_back(words):
    told = MADE[words]()
    assert " ".join(words.split()) in " ".join(str(told).split())
    assert first_answers.read_back(told) == []
    assert explained_answers.explained(told) == []


@pytest.mark.parametrize("seed", DRAWN)
def test_drawn_first_answers_are_read_back(seed):
    told = first_answers.drawn_case(seed)
    assert first_answers.read_back(told) == []
    assert explained_answers.explained(told) == []


def test_the_sentence_on_a_better_pose_is_shortened_before_other_texts():
    lines = first_answer(first_answers.drawn_case(96), 100).splitlines()
    assert len([line for line in lines if line[:1] != " " or line[1:2] == " "]) == 10


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
    assert not held.missing_moment.any()
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
