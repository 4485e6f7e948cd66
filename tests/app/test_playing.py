"""A movement that is played: its plot has the numbers of the Python call, and shows what is not held."""

import warnings

import numpy as np
import pytest
from places import REPOSITORY

import exo_pin as ep
from exo_pin.app.asked import Asked
from exo_pin.app.force_history import history, plot_of

LIFT = ep.read_movement(REPOSITORY / "examples" / "lift.csv")


@pytest.mark.full
def test_a_plot_has_the_forces_of_the_movement():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    asked = Asked("four-cables")
    found, answer = history(asked.exo, LIFT, asked.person), asked.exo.follow(LIFT)
    contact = asked.exo.joint_contact(LIFT.poses, asked.person, answer.reaction, LIFT.motion, outside="mark")
    times, size, joint = (np.array(line, float) for line in found["lines"])
    np.testing.assert_allclose(times, LIFT.times - LIFT.times[0], atol=5e-4)
    np.testing.assert_allclose(size, answer.reaction.magnitude, atol=5e-4)
    np.testing.assert_allclose(joint, contact.magnitude, atol=5e-4)
    assert found["held"] == answer.reaction.held.tolist()
    assert found["words"].startswith(answer.reaction.verdict)


@pytest.mark.full
def test_a_long_movement_keeps_its_largest_force():
    times = np.linspace(0.0, 30.0, 3001)
    angles = 40.0 + 30.0 * np.sin(times) + 20.0 * np.exp(-((times - 17.0) ** 2) / 0.02)
    long = ep.Movement.from_samples(times, ep.shoulder_rotation(angles, 0, 0, degrees=True), smoothing=None)
    exo = ep.load("four-linear-actuators-worn")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        lines = history(exo, long, None)["lines"]
        most = exo.follow(long).reaction.magnitude.max()
    assert len(lines[0]) == 400
    assert max(lines[1]) == pytest.approx(most, abs=5e-4)
    assert set(lines[2]) == {None}


def test_a_plot_marks_where_a_run_that_is_not_held_begins():
    held = [True, False, False, True, *[False] * 12]
    known = {"lines": [list(range(16)), [5.0] * 15 + [None], [None] * 16], "held": held, "words": ""}
    series = plot_of(["a", "b"], [known, None])["series"]
    assert [each.get("name") for each in series] == [None, "a: arm and device", "a: not held"]
    assert series[-1]["data"] == [[1, 5.0], [4, 5.0], [10, 5.0]]
