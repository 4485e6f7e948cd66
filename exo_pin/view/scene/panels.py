"""What the page says: the numbers of a pose, a bar of colours, and the frame around it in a notebook."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles, shoulder_rotation
from ...core.errors import ExoPinError
from ...core.records import OneProcess
from ...person.contact.result import NO_RESULT
from ...reaction.answer import BEYOND
from ..colours import CIVIDIS, hexadecimal, scale_colours
from ..page.live_server import Angles
from ..stage.force_arrows import PoseContact, ShownForces
from ..stage.stage import Stage

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo


#: A space at which no line ends.
_KEPT = "\N{NO-BREAK SPACE}"
_NEAR = "Near a singular pose: limb forces far above the load. Move the arm away from it."


def numbers_panel(
    exo: ShoulderExo,
    pose: Rotation,
    forces: ShownForces | None,
    notes: Sequence[str],
    asked: tuple[float, float, float] | None = None,
) -> dict[str, Any]:
    """The panel of a pose: what is shown, |F_s|, det X, and what to know about them.

    ``asked`` are angles, degrees, by which the pose was asked for: beyond 90° of abduction it has others, too.
    """
    angles = asked or shoulder_angles(pose, exo.side, degrees=True)
    flexion, abduction, internal = (_degrees(angle) for angle in angles)
    if forces is not None:
        determinant = forces.determinant
    else:
        determinant = float("nan") if exo.wrist is None else float(exo.singularity(pose).determinant)
    values, remarks, headline = list[dict[str, str]](), list[tuple[str, bool]](), ""
    size = float("nan") if forces is None else float(np.linalg.norm(forces.shoulder))
    if forces is not None and not np.isfinite(size):
        headline = f"No solution: {forces.status.replace('_', ' ')}"
        remarks = [(forces.verdict, False)]
    elif forces is not None:
        values = [{"name": "on the shoulder, |F_s|", "value": _newtons(size)}]
        if forces.contact is not None:
            values, remarks = _contact(forces.contact, size if forces.has_device else None)
        if forces.has_device and exo.wrist is None:
            values += _efforts(exo, forces)
        percent, split = forces.percent, forces.split
        has_percent = forces.contact is None and percent is not None and np.isfinite(percent)
        remarks += [
            (forces.verdict, forces.status in BEYOND),
            (_NEAR if forces.is_near_singular else "", True),
            (f"{percent:.1f} % of body weight" if has_percent else "", False),
            (forces.cuff_text, False),
            ("" if split is None else f"{split.caption(exo.device)} (split “{split.name}”)", False),
        ]
    if np.isfinite(determinant):
        # Adding zero turns -0 into 0.
        shown = f"{round(determinant, 3) + 0.0:+.3f}" if round(determinant, 3) else "0.000"
        values.append({"name": "det X", "value": shown.replace("-", "−")})
    said = "" if forces is None else forces.verdict
    remarks += [(note, True) for note in notes if note not in said]
    return {
        "title": (exo.device.title or exo.name) if forces is None or forces.has_device else "Without a device",
        # No line ends inside an angle.
        "pose": f"{exo.side} shoulder: {_KEPT.join(('flexion', flexion))}, {_KEPT.join(('abduction', abduction))}, "
        f"{_KEPT.join(('internal', 'rotation', internal))}",
        "headline": headline,
        "values": values,
        "notes": [{"text": text, "warn": warn} for text, warn in remarks if text],
    }


def _efforts(exo: ShoulderExo, forces: ShownForces) -> list[dict[str, str]]:
    """Efforts of drives and brakes, which arrows do not show to scale."""
    own = exo.chain_device
    named = zip(own.drive_units[: len(own.efforts)], forces.tensions, strict=False)
    rounded = ((name, round(float(value), 1) + 0.0, unit) for (name, unit), value in named)
    return [{"name": name, "value": f"{value:.1f} {unit}".replace("-", "−")} for name, value, unit in rounded]


def _contact(contact: PoseContact, size: float | None) -> tuple[list[dict[str, str]], list[tuple[str, bool]]]:
    """The joint's load with the wearer's own muscles, before what the device alone leaves there, if there is one."""
    load = float(np.linalg.norm(contact.force))
    alone = [] if size is None else [{"name": "F_s, no muscles", "value": _newtons(size)}]
    if not np.isfinite(load):
        return alone, [(f"No contact force of the joint: {NO_RESULT[contact.status]}", True)]
    text = f"{contact.percent:.0f} % of body weight, with the wearer's own muscles"
    if size is not None and np.isfinite(contact.bare):
        text += f"; without the device {_newtons(contact.bare)}"
    return [{"name": "load of the joint", "value": _newtons(load)}, *alone], [(text, False)]


def notebook_cell(source: str, height: int) -> Any:
    """A frame in a notebook; ``source`` is its attribute ``src`` or ``srcdoc``, escaped."""
    from IPython.display import HTML

    return HTML(
        f'<div style="height: {int(height)}px"><iframe {source} style="width: 100%; height: 100%; border: none">'
        "</iframe></div>"
    )


def _newtons(size: float) -> str:
    return f"{size:.1f} N" if size < 1000.0 else f"{size:.3g} N" if size >= 1e6 else f"{size:.0f} N"


def _degrees(angle: float) -> str:
    # Adding zero turns -0 into 0.
    return f"{round(angle) + 0:d}°".replace("-", "−")


def bar(label: str, low: float, high: float, scale: Sequence[str] = CIVIDIS) -> dict[str, Any]:
    """A colour bar of the legend."""
    steps = scale_colours(np.linspace(0.0, 1.0, 9), 0.0, 1.0, scale)
    return {
        "label": label,
        "low": f"{low:.3g}",
        "high": f"{high:.3g}",
        "colours": [hexadecimal(step) for step in steps],
    }


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
