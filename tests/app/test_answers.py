"""What the page answers is what the package answers: beside the same call in Python, in text and numbers."""

import contextlib
import io
import threading
from dataclasses import replace

import pytest
from places import URDF

from exo_pin.app.asked import Asked
from exo_pin.app.following import Following, answered

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
