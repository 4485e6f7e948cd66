"""What the page answers is what the package answers: beside the same call in Python, in text and numbers."""

import contextlib
import io
import threading
from dataclasses import replace

import numpy as np
import pytest
from places import URDF

from exo_pin.app.asked import Asked
from exo_pin.app.following import Following, answered
from exo_pin.app.words import answer_html, figures

SUPPORT = str(URDF / "spring-support.urdf")
CASES = {
    "worn": Asked("four-linear-actuators-worn", flexion=60.0, abduction=30.0),
    "not held": Asked("prototype", height=1.6, mass=45.0, sex="female", flexion=45.0),
    "flaccid": Asked(height=1.6, mass=45.0, sex="female", strength=0.0, payload=0.5, flexion=40.0, side="right"),
    "no wrist": Asked(SUPPORT, elbow=45.0, clothing=4.0, flexion=70.0),
    "changed": Asked("four-cables", (("cuff_height_mm", 200.0), ("A[1].radius_mm", 250.0)), flexion=30.0),
    "moving": Asked(flexion=40.123456, angular_velocity=(0.1, -2.0, 0.0), angular_acceleration=(0.0, -10.0, 1.5)),
    "thick": Asked("four-cables", girth=340.0, abduction=70.0, internal_rotation=20.0),
}


@pytest.fixture(autouse=True)
def _muscles():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")


@pytest.mark.full
@pytest.mark.parametrize("name", CASES)
def test_the_call_in_python_prints_the_same_answer(name):
    asked, told = CASES[name], io.StringIO()
    with contextlib.redirect_stdout(told):
        exec(asked.python(), {})
    assert told.getvalue() == f"{asked.report()}\n"
    parts = answered(asked).parts
    printed = " ".join(told.getvalue().split())
    assert printed.startswith(parts.verdict)
    for drive in parts.drives:
        assert " ".join(drive) in printed


@pytest.mark.parametrize("name", ["worn", "not held", "no wrist"])
def test_the_short_answer_of_a_moving_arm_has_the_same_numbers(name):
    short, whole = (answered(CASES[name], moving) for moving in (True, False))
    assert short.parts.verdict == whole.parts.verdict
    assert short.parts.reason == whole.parts.reason
    assert short.parts.drives == whole.parts.drives
    assert figures(short.report) == figures(whole.report)
    assert set(short.parts.lines) <= set(whole.parts.lines)


def test_figures_are_fields_of_the_answers():
    asked = CASES["worn"]
    contact = asked.exo.joint_contact(asked.pose, asked.person)
    numbers = {name: (number, unit) for number, unit, name in figures(answered(asked, moving=True).report)}
    assert numbers["in the joint with it"] == (f"{float(contact.magnitude):.0f}", "N")
    assert numbers["without the device"] == (f"{float(contact.without_device.magnitude):.0f}", "N")
    assert numbers["clear of the body"] == (f"{1e3 * float(asked.exo.reaction(asked.pose).clearance):.0f}", "mm")


def test_what_is_refused_says_why_and_spoils_nothing():
    refused = answered(replace(CASES["worn"], design="<script>"), moving=True)
    assert "<script>" in refused.refusal
    assert "<script>" not in answer_html(refused)
    assert "a body mass of 3 to 400 kg" in answered(Asked(mass=1.0), moving=True).refusal
    assert answered(CASES["worn"], moving=True).refusal == ""


def test_a_fault_is_shown_and_logged_and_later_questions_have_answers(monkeypatch, caplog):
    with monkeypatch.context() as patch:
        patch.setattr(Asked, "report", lambda *_: [][1])
        assert answered(CASES["worn"]).refusal == "A fault of exo_pin, which its log describes."
    assert "IndexError" in caplog.text
    assert answered(CASES["worn"], moving=True).refusal == ""


def test_the_newest_question_counts():
    shown, done = [], threading.Event()

    def show(place, answer):
        shown.append(answer)
        if not answer.moving:
            done.set()

    following = Following(show, lambda place, scene: None)
    asked = [replace(CASES["worn"], flexion=float(k)) for k in range(40)]
    for each in asked:
        following.ask(each)
    assert done.wait(60.0)
    following.close(wait=True)
    # Not one by one: the last is answered shortly, then in full.
    assert [answer.asked for answer in shown[-2:]] == [asked[-1]] * 2
    assert [answer.moving for answer in shown[-2:]] == [True, False]
    assert len(shown) < len(asked)


@pytest.mark.parametrize("name", ["worn", "no wrist", "flaccid"])
def test_a_dragged_hand_is_followed_by_the_shortest_turn(name):
    asked = CASES[name]
    here = asked.pose.apply(asked.hand)
    assert np.linalg.norm(here) == pytest.approx(np.linalg.norm(asked.hand))
    stays = replace(asked, **asked.with_hand_at(here)).pose
    assert np.degrees((stays * asked.pose.inv()).magnitude()) < 1.0
    place = here + np.array([0.08, 0.0, 0.10])
    moved = replace(asked, **asked.with_hand_at(place)).pose
    reached = moved.apply(asked.hand)
    # Angles are whole degrees; the arm turns no more than its hand.
    assert np.degrees(np.arccos(reached @ place / np.linalg.norm(reached) / np.linalg.norm(place))) < 1.2
    turn = np.degrees(np.arccos(here @ place / np.linalg.norm(here) / np.linalg.norm(place)))
    assert np.degrees((moved * asked.pose.inv()).magnitude()) < turn + 2.0


def test_two_designs_are_answered_in_one_pose_and_drawn_to_one_scale():
    shown, scenes, done = {}, {}, threading.Event()

    def show(place, answer):
        shown[place] = answer
        if place == 1 and not answer.moving:
            done.set()

    following = Following(show, scenes.__setitem__)
    asked = replace(CASES["worn"], design="four-cables"), CASES["worn"]
    following.ask(*asked)
    assert done.wait(60.0)
    first, second = scenes.values()
    assert first.metres_per_newton == second.metres_per_newton
    assert [shown[place].report.answer.magnitude for place in (0, 1)] == [
        each.exo.reaction(each.pose).magnitude for each in asked
    ]
    done.clear()
    # New views of the same question get scenes of their own; one design alone has its own scale.
    following.draw_anew()
    following.ask(asked[1])
    following.ask(*asked)
    assert done.wait(60.0)
    following.close(wait=True)
    assert scenes[0] is not first
    assert scenes[1] is not second


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("design", ["four-cables", "prototype"])
def test_a_dragged_joint_centre_is_a_change_of_dimensions(design, side):
    asked = Asked(design, (("cuff_height_mm", 190.0),), side=side, flexion=40.0, abduction=20.0)
    for name, at in [*asked.joints.items()][::3]:
        place = at + np.array([0.01, -0.02, 0.03])
        moved = asked.with_joint_at(name, place)
        # Values have two decimals, in mm and degrees.
        for other, found in moved.joints.items():
            np.testing.assert_allclose(found, place if other == name else asked.joints[other], atol=1e-4)
        assert 'with_dimensions(**{"A[1]' in moved.python() or name != "A[1]"
