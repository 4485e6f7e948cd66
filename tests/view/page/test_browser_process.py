"""The browser as a process: what it is called with, how it fails, and what it leaves behind."""

import os
import signal
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from page_pictures import SIZE
from PIL import Image

from exo_pin.core.errors import BrowserFailed
from exo_pin.view import Browser
from exo_pin.view.page import chromium


@pytest.mark.full
@pytest.mark.usefixtures("needs_browser")
def test_command_writes_a_picture_of_the_given_size(tmp_path):
    target = tmp_path / "scene.png"
    command = [sys.executable, "-m", "exo_pin.cli", "view", "--no-human", "--plot", str(target), "--size", "400x300"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(target)]
    image = np.asarray(Image.open(target).convert("RGB"))
    assert image.shape == (300, 400, 3)
    assert image.std() > 10


@pytest.mark.full
def test_failing_browser_is_reported(tmp_path):
    with pytest.raises(BrowserFailed, match="/bin/false: it ended during the start"):
        Browser(SIZE, program="/bin/false")


@pytest.mark.full
@pytest.mark.usefixtures("needs_browser")
def test_a_browser_that_is_killed_is_reported_and_leaves_no_files(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with Browser(SIZE, timeout=20.0) as window:
        window.open_html("<!doctype html><body data-state='drawn'></body>")
        assert window.evaluate("1 + 1") == 2
        with pytest.raises(BrowserFailed, match="no_such_name is not defined"):
            window.evaluate("no_such_name")
        os.killpg(window._browser.subprocess.pid, signal.SIGKILL)
        with pytest.raises(BrowserFailed, match=r"ended|no answer"):
            window.evaluate("1 + 1")
    assert list(tmp_path.glob("exo_pin_browser_*")) == []


def test_the_arguments_of_the_program_are_left_alone():
    code = "import sys; sys.argv = ['a', '--l', '1']; import exo_pin.view.page.chromium; print(sys.argv)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "['a', '--l', '1']\n"


def test_the_end_of_the_browser_is_no_error_on_the_terminal(caplog):
    assert chromium.CHROMIUM_ERRORS  # the module that is imported with the browser
    from choreographer.channels.pipe import Pipe

    pipe = Pipe()
    pipe.open()
    try:
        os.write(pipe._write_from_browser, b'{"id": 1}\0{bye}\n\0')
        assert pipe.read_jsons()[0] == [{"id": 1}]
    finally:
        pipe.close()
    assert not caplog.records
