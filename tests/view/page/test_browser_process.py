"""The browser as a process: its pictures, how it fails, and what it leaves behind."""

import subprocess
import sys
import tempfile

import numpy as np
import pytest
from PIL import Image

from exo_pin.core.errors import BrowserFailed, InvalidInput
from exo_pin.view.page import browser
from exo_pin.view.page.browser import still_picture

PAGE = "<!doctype html><body data-state='drawn'></body>"


@pytest.mark.full
@pytest.mark.usefixtures("needs_browser")
def test_command_writes_a_picture_of_the_given_size(tmp_path):
    target = tmp_path / "scene.png"
    command = [sys.executable, "-m", "exo_pin.cli", "view", "--no-human", "--plot", str(target), "--size", "400x300"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == str(target)
    image = np.asarray(Image.open(target).convert("RGB"))
    assert image.shape == (300, 400, 3)
    assert image.std() > 10


@pytest.mark.full
@pytest.mark.usefixtures("needs_browser")
def test_a_still_is_what_the_page_shows(browser, tmp_path):
    """The same pixels as a window of that size, but for the edges that are smoothed."""
    from page_pictures import SIZE, make_scene, named_pose, shot_of

    scene = make_scene(human=False)
    scene.show(named_pose("raised"))
    scene._stage.set_panel("labels", [])
    scene.save_png(tmp_path / "scene.png", SIZE)
    still = np.asarray(Image.open(tmp_path / "scene.png").convert("RGB")) / 255.0
    assert (np.abs(still - shot_of(browser, scene)).max(axis=-1) > 0.05).mean() < 0.01


def program(folder, text):
    """A program that stands for a browser."""
    path = folder / "browser"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return str(path)


#: Writes the picture that is asked for.
DRAW = """for each in "$@"; do case "$each" in --screenshot=*) printf picture > "${each#*=}";; esac; done"""


def test_a_browser_is_asked_again_until_it_has_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    tells = f'echo "$@" >> {tmp_path}/asked; echo \'<body data-state="drawn">\''
    found = program(tmp_path, f"{tells}\nif [ $(wc -l < {tmp_path}/asked) -eq 2 ]; then {DRAW}; fi")
    assert still_picture(PAGE, (120, 80), found, pixel_ratio=2.0) == b"picture"
    first, second = (tmp_path / "asked").read_text().splitlines()
    assert first == second
    assert "--window-size=120,80 --force-device-scale-factor=2 " in first
    assert first.endswith("/scene.html#still")
    # A picture of a page that does not say that it has drawn may be of anything.
    with pytest.raises(BrowserFailed, match="ended with status 3"):
        still_picture(PAGE, (120, 80), program(tmp_path, f"{DRAW}\nexit 3"))


def test_a_picture_has_16_to_8192_pixels_each_way(tmp_path):
    found = program(tmp_path, f"echo '<body data-state=\"drawn\">'; {DRAW}")
    assert still_picture(PAGE, (16, 4096), found, pixel_ratio=2.0) == b"picture"
    assert still_picture(PAGE, (32, 8192), found, pixel_ratio=0.5) == b"picture"
    for size, ratio in (((15, 90), 2.0), ((31, 90), 0.5), ((90, 8193), 0.5), ((4097, 90), 2.0)):
        with pytest.raises(InvalidInput, match="expected a size of 16 to 8192 pixels each way"):
            still_picture(PAGE, size, found, pixel_ratio=ratio)


def test_failing_browser_is_reported_and_leaves_no_files(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for text, reason in (
        ("exit 7", "ended with status 7 and drew no picture"),
        ('echo \'<body class="still" data-state="failed">\'', "no WebGL"),
        ("echo '<body data-state=\"drawn\">'", "drew no picture"),
    ):
        with pytest.raises(BrowserFailed, match=reason):
            still_picture(PAGE, (100, 100), program(tmp_path, text))
    monkeypatch.setattr(browser, "_PATIENCE", 0.2)
    with pytest.raises(BrowserFailed, match="no picture within"):
        still_picture(PAGE, (100, 100), program(tmp_path, "exec sleep 5"))
    broken = program(tmp_path, "exit 0")
    (tmp_path / "browser").write_bytes(b"\x7fELF")
    with pytest.raises(BrowserFailed, match="does not start"):
        still_picture(PAGE, (100, 100), broken)
    assert list(tmp_path.glob("exo_pin_browser_*")) == []
