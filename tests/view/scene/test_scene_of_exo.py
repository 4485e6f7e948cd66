"""The scene without a browser: what is sent, and what is refused."""

import sys
from contextlib import closing
from urllib.request import urlopen

import numpy as np
import pytest
from described_scenes import read
from scenes import placements, pose

from exo_pin.core import errors
from exo_pin.view import Scene, find_browser


def test_the_viewer_needs_no_tunnel(exo, monkeypatch):
    """Meshcat requires pyngrok, and its users may remove it."""
    for name in ("pyngrok", "pyngrok.conf", "pyngrok.ngrok"):
        monkeypatch.setitem(sys.modules, name, None)
    with closing(exo.view(human=False)) as scene, urlopen(scene.url, timeout=20) as page:
        assert b"meshcat" in page.read().lower()


def test_a_pose_sends_only_what_moves(exo):
    """In one piece: a placement for every shape that moves, and the panels; benchmarks/view.py tells the time."""
    scene = Scene(exo)
    sent = []
    scene.attach(sent.append)
    for k in range(1, 30):
        before = placements(scene)
        scene.show(pose(k, 10 + k / 2, 0))
        after = placements(scene)
        assert len(sent) == 1
        got = list(read(sent.pop()))
        assert {item["type"] for item in got} <= {"set_transform", "panel", "serial"}
        paths = [item["path"] for item in got if item["type"] == "set_transform"]
        assert len(paths) == len(set(paths))
        assert set(paths) == {path for path in after if np.abs(after[path] - before[path]).max() > 1e-9}
        assert len(paths) < len(after)


@pytest.mark.parametrize(
    ("act", "kind", "message"),
    [
        (lambda s: s.show(pose([0, 1], 0, 0)), errors.InvalidInput, "single rotation"),
        (lambda s: Scene("prototype"), errors.InvalidInput, "ShoulderExo"),
        (lambda s: s.show([0, 0, 0]), errors.InvalidInput, "scipy Rotation"),
        (lambda s: s.record(pose([0, 1], 0, 0), [0.0]), errors.InvalidInput, "a time for every pose"),
        (lambda s: s.record(pose([0, 1], 0, 0), [1.0, 1.0]), errors.InvalidInput, "rise"),
        (lambda s: s.camera(position=[0, 0, 0], target=[0, 0, 0]), errors.InvalidInput, "differs from its target"),
        (lambda s: s.camera(field_of_view=200), errors.InvalidInput, "below 180"),
        (lambda s: s.replace_exo(3), errors.InvalidInput, "exo to be a ShoulderExo"),
        (lambda s: s.serve("7000"), errors.InvalidInput, "port"),
        (lambda s: s.serve(True), errors.InvalidInput, "port"),
        (lambda s: s.serve(-1), errors.InvalidInput, "port"),
        (lambda s: s.serve(65536), errors.InvalidInput, "port"),
        (lambda s: s.save_png("/tmp/none.png", size=(4, 4)), errors.InvalidInput, "16 to 8192"),
        (lambda s: s.save_png("/tmp/none.png", browser="no-such"), errors.BrowserNotFound, "no-such"),
        (lambda s: Scene(s.exo, limbs="ropes"), errors.UnknownName, "muscles, rods"),
    ],
)
def test_bad_input_is_refused(exo, act, kind, message):
    with pytest.raises(kind, match=message):
        act(Scene(exo, human=False))


def test_no_browser_is_a_clear_error(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("EXO_PIN_BROWSER", raising=False)
    with pytest.raises(errors.BrowserNotFound, match="chromium") as caught:
        find_browser()
    assert "chromium" in caught.value.programs
    monkeypatch.setenv("EXO_PIN_BROWSER", "/no/such/browser")
    with pytest.raises(errors.BrowserNotFound, match="/no/such/browser"):
        find_browser()
