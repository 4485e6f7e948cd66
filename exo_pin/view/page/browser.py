"""Still pictures by a headless browser, if there is one: Chromium or a relative."""

from __future__ import annotations

import base64
import functools
import gzip
import json
import os
import re
import shutil
import subprocess
import tempfile
from importlib.resources import files
from pathlib import Path
from typing import Any

from ...core.errors import BrowserFailed, BrowserNotFound, InvalidInput
from ...core.validation import as_positive


@functools.cache
def viewer_script() -> str:
    """Meshcat's viewer with three.js in it, as one script."""
    return files("meshcat").joinpath("viewer", "dist", "main.min.js").read_bytes().decode()


def live_page() -> str:
    """The page of a server; it loads the viewer and the scene from the same server."""
    return _page('<script src="viewer.js"></script>', "connect();")


def static_page(commands: bytes, recording: dict[str, Any] | None = None) -> str:
    """One file with everything in it.

    Parameters
    ----------
    commands : bytes
        The scene, a run of commands as :meth:`exo_pin.view.stage.stage.Stage.snapshot` gives it.
    recording : dict, optional
        Frames, those of a :class:`exo_pin.view.scene.scene_recording.SceneRecording`; they play when the page opens.

    Returns
    -------
    str
        HTML that needs no network.
    """
    start = f'inflate("{_deflated(commands)}").then(apply)'
    if recording is not None:
        text = json.dumps(recording, separators=(",", ":"), allow_nan=False).encode()
        start += f'.then(() => inflate("{_deflated(text)}")).then((text) => play(JSON.parse(decoded(text))))'
    return _page(f"<script>{viewer_script()}</script>", f"{start};")


def still_page(commands: bytes) -> str:
    """The page of a still picture, larger: a browser without a screen may end before another thread has unpacked it.

    Parameters
    ----------
    commands : bytes
        As :func:`static_page` takes them.

    Returns
    -------
    str
        HTML that needs no network.
    """
    return _page(f"<script>{viewer_script()}</script>", f'apply(bytes("{_text(commands)}"));')


def _deflated(data: bytes) -> str:
    # No time stamp, so that the same scene is the same file.
    return _text(gzip.compress(data, mtime=0))


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _page(viewer: str, start: str) -> str:
    page = (files("exo_pin.view") / "page.html").read_text(encoding="utf-8")
    return page.replace("<!--MESHCAT-->", viewer, 1).replace("/*START*/", start, 1)


#: Names of browser programs, tried in this order, and the environment variable that names another one.
BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "brave-browser",
)
BROWSER_VARIABLE = "EXO_PIN_BROWSER"
#: WebGL is drawn in software, so that it works without a screen and a graphics card; no page uses the network. The
#: page's own clock runs until it has been drawn, however long that takes.
_OPTIONS = (
    "--headless=new",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--disable-quic",
    "--disable-background-networking",
    "--virtual-time-budget=20000",
    "--dump-dom",
)
#: How long to wait for a picture, s.
_PATIENCE = 120.0
#: How often to try.
_ATTEMPTS = 3


def find_browser(program: str | None = None) -> str:
    """Path of a browser that can draw without a screen.

    Parameters
    ----------
    program : str, optional
        Its name or path. Left out: what ``EXO_PIN_BROWSER`` names, else the first of :data:`BROWSERS` that is there.

    Returns
    -------
    str

    Raises
    ------
    BrowserNotFound
        If there is none.

    Examples
    --------
    >>> import sys
    >>> from exo_pin.view import find_browser
    >>> find_browser(sys.executable) == sys.executable  # a path is taken as it is
    True
    """
    named = program or os.environ.get(BROWSER_VARIABLE)
    for name in (named,) if named else BROWSERS:
        found = shutil.which(name)
        if found is not None:
            return found
    raise BrowserNotFound((named,) if named else BROWSERS, BROWSER_VARIABLE)


def still_picture(html: str, size: tuple[int, int], program: str | None = None, pixel_ratio: float = 1.0) -> bytes:
    """A still picture of a scene's page, without its controls, PNG.

    Parameters
    ----------
    html : str
        The page.
    size : (int, int)
        Width and height of the page, its pixels.
    program : str, optional
        See :func:`find_browser`.
    pixel_ratio : float
        Pixels of the picture for each of the page, along each side.

    Raises
    ------
    InvalidInput
        If a size of the page or of the picture is not 16 to 8192 pixels.
    BrowserNotFound
        If there is no browser.
    BrowserFailed
        If it cannot draw the scene.
    """
    width, height = (int(part) for part in size)
    ratio = as_positive("pixel_ratio", pixel_ratio)
    sides = [width, height, ratio * width, ratio * height]
    if not (min(sides) >= 16 and max(sides) <= 8192):
        raise InvalidInput(f"expected a size of 16 to 8192 pixels each way, got {width} x {height}, times {ratio:g}")
    found = find_browser(program)
    # The sandbox needs a user that root is not.
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    with tempfile.TemporaryDirectory(prefix="exo_pin_browser_", ignore_cleanup_errors=True) as folder:
        page, picture = Path(folder, "scene.html"), Path(folder, "scene.png")
        page.write_text(html, encoding="utf-8")
        options = [*_OPTIONS, *(["--no-sandbox"] if root else []), f"--user-data-dir={folder}/profile"]
        options += [f"--window-size={width},{height}", f"--force-device-scale-factor={ratio:g}"]
        command = [found, *options, f"--screenshot={picture}"]
        # On a busy machine Chromium may end well without having drawn the page.
        for _ in range(_ATTEMPTS):
            try:
                done = subprocess.run([*command, f"{page.as_uri()}#still"], capture_output=True, timeout=_PATIENCE)
            except subprocess.TimeoutExpired:
                raise BrowserFailed(found, f"no picture within {_PATIENCE:g} s") from None
            except OSError as error:
                raise BrowserFailed(found, f"it does not start: {error}") from error
            state = re.search(rb'<body[^>]* data-state="(\w+)"', done.stdout)
            if state is not None and state[1] == b"failed":
                raise BrowserFailed(found, "it has no WebGL, so it cannot draw the scene")
            if state is not None and picture.is_file():
                return picture.read_bytes()
            if done.returncode:
                break
        raise BrowserFailed(found, f"it ended with status {done.returncode} and drew no picture")
