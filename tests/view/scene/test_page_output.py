"""The scene served, exported and played."""

import socket
import time
import urllib.request
from urllib.parse import urlsplit

import numpy as np
import pytest
from scenes import pose

from exo_pin.core import errors
from exo_pin.view import Scene
from exo_pin.view.page.browser import viewer_script
from exo_pin.view.scene.page_output import viewpoint_of_points


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


@pytest.mark.parametrize("normal", [(0.6, 0.0, 0.8), (-0.8, 0.0, -0.6), (0.1, 0.9, -0.4), (0.0, 0.0, -1.0)])
def test_a_flat_chain_is_looked_at_from_its_side(normal):
    """Along the normal whose largest component is positive, a little from the right and from above."""
    normal = np.array(normal) / np.linalg.norm(normal)
    across = np.linalg.svd(normal[None])[2][1:]
    points = np.array([[0.0, 0.0], [1.0, 0.1], [1.2, 0.9], [-0.2, 0.7], [0.4, 0.5]]) @ across + [0.1, 0.2, 0.3]
    camera, target, extents = viewpoint_of_points(points, 1.5)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    assert target == pytest.approx(middle)
    towards = normal * np.sign(normal[np.abs(normal).argmax()]) + [0.0, -0.15, 0.045]
    towards /= np.linalg.norm(towards)
    # A ball of that size and a third more fills a view of 32 degrees.
    assert camera - target == pytest.approx(1.35 * 0.75 / np.sin(np.radians(16.0)) * towards)
    aside = np.cross([0.0, 0.0, 1.0], towards)
    assert extents[0] == pytest.approx(np.abs((points - middle) @ aside).max() / np.linalg.norm(aside) + 0.12 * 1.5)
