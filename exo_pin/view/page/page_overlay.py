"""The page around Meshcat's viewer: numbers, legend and labels over the scene, live and in exported files.

Meshcat has no text. The page wraps its viewer, unchanged, and takes two more kinds of command: panels of text, and a
serial number that shows that an update has arrived.
"""

from __future__ import annotations

import base64
import functools
import gzip
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

from ..meshcat_viewer import meshcat


@functools.cache
def viewer_script() -> str:
    """Meshcat's viewer with three.js in it, as one script."""
    return (Path(meshcat.__file__).parent / "viewer" / "dist" / "main.min.js").read_text(encoding="utf-8")


@functools.cache
def _template() -> str:
    return (files("exo_pin.view") / "page.html").read_text(encoding="utf-8")


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
    return _template().replace("<!--MESHCAT-->", viewer, 1).replace("/*START*/", start, 1)
