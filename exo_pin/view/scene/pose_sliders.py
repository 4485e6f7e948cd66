"""Sliders of the live page: they move the pose, and follow it where something else moves it."""

from __future__ import annotations

from collections.abc import Callable

from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles, shoulder_rotation
from ...core.errors import ExoPinError
from ...core.records import OneProcess
from ..page.pose_requests import Angles
from ..stage.stage import Stage

#: Angles by name, with the range of their sliders, degrees.
ANGLES = {"flexion": (-40.0, 150.0), "abduction": (-10.0, 130.0), "internal_rotation": (-70.0, 80.0)}


class PoseSliders(OneProcess):
    """The pose of a scene under sliders.

    Parameters
    ----------
    stage : Stage
        Its page.
    side : {"left", "right"}
        Of the body.
    show : callable
        Draws a pose of the arm, and calls :meth:`follow`.
    """

    def __init__(self, stage: Stage, side: str, show: Callable[[Rotation], object]) -> None:
        self._stage, self._side, self._show = stage, side, show
        self._values: Angles = (0.0, 0.0, 0.0)
        #: Angles that a page asks for, while they are drawn.
        self.asked: Angles | None = None
        self._answered = 0
        stage.listen(self._move)

    def follow(self, pose: Rotation) -> None:
        """Put the sliders where a pose is. Those of a page that asked for it stay where its user has put them."""
        flexion, abduction, internal = shoulder_angles(pose, self._side, degrees=True).tolist()
        self._values = self.asked or (flexion, abduction, internal)
        self._write("")

    def _move(self, angles: Angles) -> None:
        with self._stage.update():
            self.asked = angles
            self._answered += 1
            try:
                self._show(shoulder_rotation(*angles, side=self._side, degrees=True))
            except ExoPinError as error:
                self._write(str(error))
            finally:
                self.asked = None

    def _write(self, refusal: str) -> None:
        """Fill the panel: sliders with their values, how many requests were answered, and why one was refused."""
        angles = [
            {"name": name.replace("_", " "), "low": low, "high": high, "value": round(value, 3)}
            for (name, (low, high)), value in zip(ANGLES.items(), self._values, strict=True)
        ]
        self._stage.set_panel("sliders", {"angles": angles, "answered": self._answered, "refusal": refusal})
