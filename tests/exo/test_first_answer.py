"""The first answer to a question about one pose: its size, and its numbers, names and counts read back."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from places import URDF

import exo_pin as ep
from exo_pin.exo.first_answer import along, answer_in_parts, first_answer
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


def in_parts(told):
    """What is wrong with the answer in parts: each is a line, or several, of the printed one, in its order."""
    parts, printed = answer_in_parts(told), first_answer(told, 10**6).split("\n")
    rows = [re.split("  +", line.strip()) for line in printed if re.match(r" \S", line)]
    wrong = [] if [list(row) for row in parts.drives] == rows else [f"{parts.drives}: {rows}"]
    others = [line for line in printed[1:] if not re.match(r" \S", line)]
    told_lines = [f"{'':<17}{parts.reason}"] if parts.reason else []
    for label, text in (("", line) if not label else (label, line) for label, line in parts.lines):
        told_lines += [
            f"{name:<17}{part}" for name, part in zip([label, *[""] * 9], joined(text, others), strict=False)
        ]
    others[-1] = others[-1].removesuffix("  More: --explain")
    wrong += [] if told_lines == others else [f"{told_lines}: {others}"]
    wrong += [] if printed[0].startswith(parts.verdict) else [parts.verdict]
    moving = answer_in_parts(told, moving=True)
    if (moving.verdict, moving.reason, moving.drives) != (parts.verdict, parts.reason, parts.drives):
        wrong.append("moving")
    if not {label for label, _ in moving.lines} <= {"In the joint", "Device"} or not set(moving.lines) <= set(
        parts.lines
    ):
        wrong.append(f"{moving.lines}")
    return wrong


def joined(text, lines):
    """Lines that a text of several is made of."""
    for count in range(1, 4):
        for start in range(len(lines)):
            own = [line[17:].removesuffix("  More: --explain") for line in lines[start : start + count]]
            if "; ".join(own) == text:
                return own
    return [text]


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
    assert in_parts(told) == []


def test_numbers_beside_a_pose_are_those_of_their_questions(worn):
    """As plain data, of a wrist of four limbs, of three, and of a device of hinges."""
    for exo, angles, person in (
        (worn, (60.0, 20.0), MAN), (ep.load("prototype"), (10.0, 20.0), None),
        (ep.load("four-linear-actuators"), (60.0, 20.0), None),
        (ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN), (60.0, 20.0), None),
    ):  # fmt: skip
        told, pose = report(exo, *angles, person=person), exo.pose(*angles)
        answer, data, seen = told.answer, told.as_dict(), exo.accuracy(pose, twins=exo.wrist is not None)
        assert data["weakest_rate"] == pytest.approx(float(seen.mm_per_degree))
        assert data["weakest_rate_unit"] == seen.unit
        assert (data["twin_degrees"] is None) == (data["twin_difference_rss"] is None) == (not seen.has_twin)
        if seen.has_twin:
            assert data["twin_degrees"] == pytest.approx(np.degrees(float(seen.twin_angle)), rel=1e-6)
            assert data["twin_difference_rss"] == pytest.approx(np.linalg.norm(seen.differences), rel=1e-6)
        where = exo.singularity(pose)
        assert data["singular_kind"] == str(where.kind)
        assert data["singular_margin"] == pytest.approx(float(answer.margin))
        three = exo.wrist is not None and exo.wrist.geometry.limb_count == 3
        assert np.isfinite(data["singular_distance"] or np.nan) == three
        if three:
            assert data["singular_distance"] == pytest.approx(float(exo.nearest_singularity(pose).degrees))
        who = exo.arm.wearer
        assert data["wearer"] == (None if who is None else {"height": who.height, "mass": who.mass})
        f, limits = answer.actuator_forces, answer.source.poses.limits
        limit = np.where(f > 0.0, limits.upper[0], -limits.lower[0])
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(np.isfinite(limit) & (limit > 0.0), 100.0 * np.abs(f) / limit, np.nan)
        np.testing.assert_allclose(told.percent_of_limits, share)
        if exo.wrist is None:
            np.testing.assert_allclose(data["drive_coordinates"], exo.inverse_kinematics(pose).positions)
            assert data["drive_units"] == [[name, "N m"] for name in ("internal_rotation", "abduction", "flexion")]
            assert "strokes" not in data
        else:
            np.testing.assert_allclose(data["limb_lengths"], exo.inverse_kinematics(pose).lengths)
            strokes = [[own.nominal_length * end + own.end_fitting for end in (own.shortest, own.longest)]
                       for own in (limb.stroke for limb in exo.limbs)]  # fmt: skip
            np.testing.assert_allclose(data["strokes"], strokes)
        if person is None:
            assert data["force_on_head_in_socket"] is None
            assert data["relief_percent"] == {}
        else:
            push = told.contact.glenoid @ -answer.shoulder_force
            np.testing.assert_allclose(data["force_on_head_in_socket"], push)
            assert list(data["relief_percent"]) == ["0 % kept", "30 % kept", "60 % kept"]


@pytest.mark.parametrize("seed", DRAWN)
def test_drawn_first_answers_are_read_back(seed):
    told = first_answers.drawn_case(seed)
    assert first_answers.read_back(told) == []
    assert explained_answers.explained(told) == []
    assert in_parts(told) == []


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


def test_more_than_all_of_the_moments_is_refused(worn):
    with pytest.raises(ep.InvalidInput, match="share of 0 to 1 of the arm's moments, got"):
        worn.joint_contact(worn.pose(60), MAN, forces=1.1)


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
