"""A motion frame by frame, with placements, colours and numbers: drawn in real time, or a file that plays by itself."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.files import write_text
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive
from ...reaction import Reaction
from ..page.browser import static_page
from ..stage.stage import Stage

if TYPE_CHECKING:
    from ...control.plant.run import Run
    from .scene_of_exo import Scene


@dataclass(frozen=True, eq=False)
class SceneRecording(Record):
    """A motion with forces, ready to be written as a file that plays by itself.

    Attributes
    ----------
    times : ndarray
        Shape (k,), s.
    reaction : Reaction or None
        The forces of all frames, shape (k,); None for a design without an arm.

    Examples
    --------
    >>> from exo_pin.view import Scene
    >>> exo = ep.load("three-linear-actuators")
    >>> poses = exo.pose(flexion=[10, 20, 30])
    >>> film = Scene(exo, human=False).record(poses, [0.0, 0.5, 1.0])
    >>> bool(np.allclose(film.reaction.magnitude, exo.reaction(poses).magnitude))  # N
    True
    """

    times: FloatArray
    reaction: Reaction | None
    _commands: bytes
    _frames: dict[str, Any]

    def html(self) -> str:
        """The page, with a slider for time; it opens without a network.

        Returns
        -------
        str
            HTML with all that it needs, some MB.

        Examples
        --------
        >>> from exo_pin.view import Scene
        >>> exo = ep.load("three-linear-actuators")
        >>> scene = Scene(exo, human=False)
        >>> film = scene.record(exo.pose(flexion=[10, 20]), [0.0, 1.0])
        >>> len(film.html()) > len(scene.html())  # the page of one pose, and what moves
        True
        """
        return static_page(self._commands, {"times": self.times.tolist(), **self._frames})

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page. The file appears whole or not at all.

        Parameters
        ----------
        path : str or path-like
            The ``.html`` file to write.

        Examples
        --------
        >>> from pathlib import Path
        >>> from exo_pin.view import Scene
        >>> exo = ep.load("three-linear-actuators")
        >>> film = Scene(exo, human=False).record(exo.pose(flexion=[10, 20]), [0.0, 1.0])
        >>> film.save("film.html")
        >>> Path("film.html").read_text() == film.html()
        True
        """
        write_text(path, self.html())


def as_times(times: ArrayLike, what: str, shape: tuple[int, ...]) -> FloatArray:
    """Checked times of a motion, shape (k,), s, that has ``what`` of a shape."""
    stamps = as_finite("times", times, (None,))
    if shape != stamps.shape or not len(stamps):
        raise InvalidInput(f"expected a time for every {what}, got {what}s {shape} and times {stamps.shape}")
    if (np.diff(stamps) <= 0).any():
        raise InvalidInput("expected times that rise")
    return stamps


def play_frames(times: FloatArray, draw: Callable[[int], None]) -> None:
    """Draw the frames of a motion in real time."""
    start = time.monotonic()
    for index in range(len(times)):
        late = time.monotonic() - start
        # A machine that is too slow for all frames leaves some out, and never the last.
        if index + 1 < len(times) and times[index + 1] - times[0] < late:
            continue
        time.sleep(max(float(times[index] - times[0]) - late, 0.0))
        draw(index)


def record_frames(
    stage: Stage, times: FloatArray, draw: Callable[[int], None], reaction: Reaction | None
) -> SceneRecording:
    """Draw the frames of a motion on a stage and keep them: only what is not in one place throughout is in each."""
    placements, colours, panels = [], [], []
    for index in range(len(times)):
        draw(index)
        placements.append(stage.placements())
        colours.append(stage.colours())
        panels.append({name: stage.panel(name) for name in ("numbers", "labels")})
    moving, coloured = _changing(placements), _changing(colours)
    frames = {
        "moving": moving,
        "coloured": coloured,
        "transforms": _floats([frame[path].T.ravel() for frame in placements for path in moving]),
        "colours": _floats([frame[path] for frame in colours for path in coloured]),
        "panels": panels,
    }
    return SceneRecording(times, reaction, stage.snapshot(), frames)


def _changing(frames: Sequence[Mapping[str, Any]]) -> list[str]:
    """Paths whose value is replaced in some frame; the stage keeps the very object for what does not change."""
    return [path for path in frames[0] if any(frame[path] is not frames[0][path] for frame in frames)]


def _floats(rows: list[Any]) -> str:
    return base64.b64encode(np.asarray(rows, dtype="<f4").tobytes()).decode("ascii")


def record_run(scene: Scene, run: Run, frames_a_second: float = 25.0) -> SceneRecording:
    """Record a run of the plant, in real time.

    Parameters
    ----------
    scene : Scene
        Of the design that was run.
    run : Run
        From :meth:`exo_pin.control.Plant.simulate`.
    frames_a_second : float
        At most; frames are samples of the run.

    Returns
    -------
    SceneRecording
        Arm, and the forces that this motion takes: those of the reaction query with the run's own motion and moments of
        friction and stops. Limb forces are the run's tensions, as in
        :meth:`exo_pin.control.plant.run.Run.reaction`.

    Raises
    ------
    InvalidInput
        If the run has only one sample.
    """
    if len(run.times) < 2:
        raise InvalidInput("expected a run of two samples or more: this one ended where it began")
    first, last = float(run.times[0]), float(run.times[-1])
    count = max(int((last - first) * as_positive("frames_a_second", frames_a_second)), 1)
    wanted = np.linspace(first, last, count + 1)
    # The samples nearest to these times: between samples tensions and motion would not balance.
    after = np.clip(np.searchsorted(run.times, wanted), 1, len(run.times) - 1)
    nearer = wanted - run.times[after - 1] < run.times[after] - wanted
    rows = np.unique(np.where(nearer, after - 1, after))
    return scene.record(run.rotations[rows], run.times[rows], **run.question(rows))
