"""The scene served, exported, recorded and played."""

import base64
import socket
import time
import urllib.request
from urllib.parse import urlsplit

import numpy as np
import pytest
from scenes import pose

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.view import Scene
from exo_pin.view.page.browser import still_page, viewer_script


def test_a_used_port_moves_on(exo):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        scene = Scene(exo, human=False)
        try:
            url = scene.serve(port)
            assert urlsplit(url).port != port
            assert scene.serve() == url == scene.url
            page = urllib.request.urlopen(url, timeout=10).read().decode()
            assert "viewer.js" in page
            script = urllib.request.urlopen(f"{url}viewer.js", timeout=10).read().decode()
            assert script == viewer_script()
        finally:
            scene.close()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(url, timeout=10)


def test_exported_page_is_the_same_for_the_same_scene_and_is_written_whole(exo, tmp_path):
    scene = Scene(exo, human=False)
    assert scene.html() == scene.html()
    scene.save_html(tmp_path / "scene.html")
    assert (tmp_path / "scene.html").read_text() == scene.html()
    with pytest.raises(errors.InvalidInput, match="none"):
        scene.save_html(tmp_path / "none" / "scene.html")


def test_the_page_of_a_still_is_drawn_without_waiting_for_another_thread(exo):
    commands = Scene(exo, human=False)._stage.snapshot()
    page = still_page(commands)
    assert f'apply(bytes("{base64.b64encode(commands).decode()}"));' in page
    assert 'inflate("' not in page


def test_recording_holds_the_motion(exo):
    scene = Scene(exo, human=False)
    times = np.array([0.0, 0.1, 0.3])
    poses = pose([0.0, 30.0, 60.0], [0.0, 15.0, 30.0], 0.0)
    recording = scene.record(poses, times, motion=ep.Motion([0.0, -1.0, 0.0], [0.0, 0.0, 0.0]))
    expected = exo.reaction(poses, motion=ep.Motion([0.0, -1.0, 0.0], [0.0, 0.0, 0.0]))
    np.testing.assert_allclose(recording.reaction.shoulder_force, expected.shoulder_force)
    frames = recording._frames
    assert "/meshcat/exo/harness" not in frames["moving"]
    assert "/meshcat/exo/visuals/arm_0" in frames["moving"]
    values = [frame["numbers"]["values"][0]["value"] for frame in frames["panels"]]
    assert values == [f"{size:.1f} N" for size in expected.magnitude]


def test_playing_leaves_frames_out_where_drawing_is_slow(exo, monkeypatch):
    """A pose takes longer to draw than it lasts: the motion keeps its time, and its last pose is drawn."""
    scene = Scene(exo, human=False)
    drawn, draw = [], scene._draw

    def slow(frame):
        time.sleep(0.05)
        drawn.append(frame.placed.pose)
        draw(frame)

    monkeypatch.setattr(scene, "_draw", slow)
    scene.play(pose(np.linspace(0.0, 10.0, 41), 0.0, 0.0), np.linspace(0.0, 0.2, 41))
    assert len(drawn) < 20
    assert drawn[-1].approx_equal(pose(10, 0, 0))


def test_playing_takes_its_time(exo):
    scene = Scene(exo, human=False)
    start = time.monotonic()
    scene.play(pose([0.0, 5.0, 10.0], 0.0, 0.0), [0.0, 0.1, 0.2])
    assert time.monotonic() - start >= 0.2
    assert scene.orientation.approx_equal(pose(10, 0, 0))
