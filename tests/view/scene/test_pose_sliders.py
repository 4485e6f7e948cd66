"""Sliders of the live page: what a page asks for is drawn, and the sliders stand where the pose is."""

import json
import threading

import numpy as np
import pytest
from scenes import panel

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.view import Scene
from exo_pin.view.page.live_server import PoseRequests


def ask(scene, *angles):
    """What a page sends when a slider moves."""
    scene._stage._requests.put(json.dumps({"pose": angles}))
    scene._stage._requests.finish()


def slid(scene):
    return [angle["value"] for angle in panel(scene, "sliders")["angles"]]


def test_a_page_moves_the_pose_and_gets_its_forces():
    exo = ep.load("four-linear-actuators-worn", side="right")
    scene = Scene(exo, human=False)
    scene.show(exo.pose(20, 30, 10), split="minimal")
    assert slid(scene) == [20.0, 30.0, 10.0]
    # Beyond 90° of abduction a pose has two names: the page keeps those that it asked for.
    for angles in ((60.0, 30.0, 0.0), (20.0, 110.0, 0.0)):
        ask(scene, *angles)
        # Of the last question asked, so that a split stays.
        answer = exo.reaction(exo.pose(*angles), split="minimal")
        numbers = panel(scene, "numbers")
        assert numbers["values"][0]["value"] == f"{answer.magnitude:.1f} N"
        assert answer.verdict in [note["text"] for note in numbers["notes"]]
        assert f"{angles[1]:.0f}°" in numbers["pose"]
        assert slid(scene) == list(angles)
        np.testing.assert_allclose(scene.orientation.as_matrix(), exo.pose(*angles).as_matrix(), atol=1e-12)


def test_a_pose_that_cannot_be_drawn_leaves_the_last_one_and_says_why(monkeypatch):
    exo = ep.load("three-linear-actuators")
    scene = Scene(exo, human=False)
    ask(scene, 30.0, 10.0, 0.0)
    before = panel(scene, "numbers")

    def refused(*_, **__):
        raise InvalidInput("no such pose")

    monkeypatch.setattr(scene, "show", refused)
    ask(scene, 90.0, 10.0, 0.0)
    assert panel(scene, "sliders")["refusal"] == "no such pose"
    assert slid(scene) == [30.0, 10.0, 0.0]
    assert panel(scene, "numbers") == before


@pytest.mark.parametrize(
    "message",
    ["", "{", "[]", "1", '{"pose": 1}', '{"pose": [1, 2]}', '{"pose": [1, 2, "x"]}', '{"pose": [1, 2, NaN]}', b"\xff",
     '{"pose": [1, 2, 1e9]}', '{"pose": {"a": 1}}', "[" * 5000],
)  # fmt: skip
def test_what_is_no_pose_is_ignored(message):
    drawn = []
    requests = PoseRequests(drawn.append)
    requests.put(message)
    requests.finish()
    assert drawn == []


def test_of_poses_that_wait_the_newest_alone_is_drawn():
    drawn, go = [], threading.Event()

    def draw(angles):
        drawn.append(angles)
        go.wait(30.0)

    requests = PoseRequests(draw)
    for k in range(5):
        requests.put(json.dumps({"pose": [k, 0, 0]}))
        while not drawn:
            pass  # the first is being drawn
    go.set()
    requests.finish()
    assert drawn == [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0)]
