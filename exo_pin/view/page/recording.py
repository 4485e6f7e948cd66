"""A recorded motion: placements, colours and numbers of every frame."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from ...core.files import write_text
from ...core.records import OneProcess, Record
from ...core.validation import FloatArray
from ...reaction import Reaction
from ..scene.stage import Stage
from .page_overlay import static_page

__all__ = ["FrameTaker", "Recording"]


@dataclass(frozen=True, eq=False)
class Recording(Record):
    """A motion with forces, ready to be written as a file that plays by itself.

    Attributes
    ----------
    times : ndarray
        Shape (k,), s.
    reaction : Reaction or None
        The forces of all frames, shape (k,); None for a design without an arm.
    """

    times: FloatArray
    reaction: Reaction | None
    _commands: bytes
    _frames: dict[str, Any]

    def html(self) -> str:
        """The page, with a slider for time; it opens without a network."""
        return static_page(self._commands, {"times": self.times.tolist(), **self._frames})

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page. The file appears whole or not at all."""
        write_text(path, self.html())


class FrameTaker(OneProcess):
    """Collects frames from a stage."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._transforms: list[dict[str, FloatArray]] = []
        self._colours: list[dict[str, tuple[float, ...]]] = []
        self._panels: list[dict[str, Any]] = []

    def take(self) -> None:
        """Keep the scene as it is now as the next frame."""
        self._transforms.append(self._stage.placements())
        self._colours.append(self._stage.colours())
        self._panels.append({name: self._stage.panel(name) for name in ("numbers", "labels")})

    def finish(self, times: FloatArray, reaction: Reaction | None) -> Recording:
        """Make the recording: only what is not in one place throughout goes into the frames."""
        moving = _changing(self._transforms)
        coloured = _changing(self._colours)
        transforms = [np.asarray(frame[path]).T.ravel() for frame in self._transforms for path in moving]
        colours = [frame[path] for frame in self._colours for path in coloured]
        frames = {
            "moving": moving,
            "coloured": coloured,
            "transforms": _floats(transforms),
            "colours": _floats(colours),
            "panels": self._panels,
        }
        return Recording(times, reaction, self._stage.snapshot(), frames)


def _changing(frames: list[dict[str, Any]]) -> list[str]:
    """Paths whose value is replaced in some frame; the stage keeps the very object for what does not change."""
    return [path for path in frames[0] if any(frame[path] is not frames[0][path] for frame in frames)]


def _floats(rows: list[Any]) -> str:
    return base64.b64encode(np.asarray(rows, dtype="<f4").tobytes()).decode("ascii")
