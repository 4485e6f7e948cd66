"""Samples that move the arm of the page: what is shown of them, and what is refused."""

import json
import time

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.app.live_samples import LiveSamples

TOKEN = "of-the-page"


@pytest.fixture
def samples():
    made = LiveSamples(TOKEN, "right")
    assert json.loads(made.take(json.dumps({"open": {}, "token": TOKEN, "rate": 100})))["opened"] == "pose"
    return made


def send(samples, seq, **fields):
    return samples.take(json.dumps({"t": 0.01 * seq, "seq": seq, **fields}))


def test_the_newest_pose_counts_and_lost_and_late_ones_are_said(samples):
    for seq, flexion in ((0, 10.0), (1, 20.0), (5, 30.0), (3, 99.0)):
        assert send(samples, seq, flexion=flexion) is None
    expected = ep.shoulder_rotation(30.0, 0.0, 0.0, side="right", degrees=True)
    np.testing.assert_allclose(samples.newest().as_quat(), expected.as_quat(), atol=1e-12)
    assert samples.newest() is None
    assert "3 lost (the last: 2 to 4), 1 late." in samples.words


def test_silence_is_said(samples, monkeypatch):
    assert samples.words == "Waiting for samples."
    send(samples, 0, flexion=10.0)
    later = time.monotonic() + 7.0
    monkeypatch.setattr(time, "monotonic", lambda: later)
    assert samples.words == "No sample for 7 s: the pose is the last one."


@pytest.mark.parametrize(
    ("opening", "words"),
    [({"open": {}}, "token"), ({"open": {"design": "prototype"}, "token": TOKEN}, "the page has device"), ([], "open")],
)
def test_a_stream_that_is_not_for_the_page_is_refused(opening, words):
    made = LiveSamples(TOKEN, "left")
    answer = json.loads(made.take(json.dumps(opening)))
    assert answer["status"] in (401, 422)
    assert words in answer["detail"]
    assert json.loads(send(made, 0, flexion=1.0))["status"] == 422
    assert made.newest() is None


def test_a_wrong_sample_is_said_and_spoils_no_other(samples):
    assert json.loads(send(samples, 0, quaternion_xyzw=[1, 1, 1, 1]))["status"] == 422
    assert json.loads(samples.take(b"\xff"))["status"] == 422
    assert "No sample" in samples.words
    assert send(samples, 1, flexion=5.0) is None
    assert samples.newest() is not None


def test_sensors_are_still_at_first():
    made = LiveSamples(TOKEN, "left")
    sensors = {"forward": "x", "still": 0.02}
    made.take(json.dumps({"open": {}, "token": TOKEN, "sensors": sensors}))
    still = {"arm_xyzw": [0, 0, 0, 1], "trunk_xyzw": [0, 0, 0, 1]}
    send(made, 0, **still)
    assert made.newest() is None
    assert "Hold the arm still" in made.words
    send(made, 5, **still)
    assert made.newest().magnitude() == pytest.approx(0.0, abs=1e-9)
