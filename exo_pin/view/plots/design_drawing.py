"""Drawing of a design on a body: views from the front, from the side and from above."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import MissingData
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_rotation, broadcast
from ...design.holding_frame import holding_bars
from ...reaction.holding.verdict import angle_words
from ...wrist import BodyShape
from ..colours import BLACK
from .plot_style import line, new_figure, pyplot, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo

#: Views: title, horizontal and vertical axis, and the sign of the horizontal one.
_VIEWS = (("from the front", 1, 2, 1.0), ("from the left", 0, 2, -1.0), ("from above", 1, 0, -1.0))
_NAMES = ("x forward", "y left", "z up")
_TORSO, _ARM, _FRAME = "#C9CED6", "#E3B698", "#4D545E"


@checked
def design_drawing(exo: ShoulderExo, poses: Rotation, elbow_flexion: ArrayLike | None = None) -> Figure:
    """Draw joints, limbs, frame and cuff on who wears the design, a row of three views for each posture.

    Parameters
    ----------
    exo : ShoulderExo
        The design, whose arm knows its wearer. Frame and cuff are drawn as the viewer draws them: a way in which the
        given joints could be held.
    poses : Rotation
        Single, or a stack of shape (k,).
    elbow_flexion : array_like, optional
        Of the wearer, one angle or shape (k,), rad; left out, as the design has it.

    Returns
    -------
    matplotlib.figure.Figure
        Joints on the torso are squares, joints on the arm circles; lengths in mm. The body's capsules are those of
        clearances.

    Raises
    ------
    MissingData
        If it is not known who wears the design.
    """
    stack = as_rotation("poses", poses)
    R = stack.as_matrix().reshape(-1, 3, 3)
    worn_by = None if exo.arm is None else exo.arm.wearer
    if worn_by is None:
        raise MissingData(["wearer of the arm"], "a drawing", exo.name, "exo.worn_by(ep.Wearer(...)) says it")
    asked = worn_by.elbow_flexion if elbow_flexion is None else elbow_flexion
    bends, _ = broadcast(elbow_flexion=asked, poses=np.zeros(len(R)))
    bodies = [BodyShape.of(replace(worn_by, elbow_flexion=bend), exo.side) for bend in bends.tolist()]
    arms = [_turned(body.arm, matrix) for body, matrix in zip(bodies, R, strict=True)]
    figure, grid = new_figure(11.0, 3.7 * len(R) + 0.5, nrows=len(R), ncols=3, squeeze=False)
    low, high = _span(exo, [bodies[0].torso, *arms])
    for row, matrix, arm, bend in zip(grid, R, arms, bends, strict=True):
        for ax, view in zip(row, _VIEWS, strict=True):
            _draw_view(ax, view, exo, matrix, (bodies[0].torso, arm))
            ax.set(ylim=(low, high), xlim=(low, high) if view[3] > 0.0 else (high, low))
        words = f"{angle_words(Rotation.from_matrix(matrix), exo.side)}, elbow {np.degrees(bend):.0f}°"
        row[1].set_title(f"{words}\n{row[1].get_title()}", fontsize=11)
    handles = [
        pyplot().Line2D([], [], **line(i), linewidth=2.0, marker="s", label=f"limb {i + 1}")
        for i in range(exo.geometry.limb_count)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    figure.suptitle(exo.mechanism.title or exo.name)
    return figure


def _draw_view(
    ax: Any, view: tuple[str, int, int, float], exo: ShoulderExo, R: FloatArray, body: tuple[FloatArray, FloatArray]
) -> None:
    """One view: body, frame and cuff, limbs and joints."""
    title, first, second, _ = view
    for capsules, colour in zip(body, (_TORSO, _ARM), strict=True):
        for capsule in capsules:
            _capsule(ax, capsule, first, second, colour)
    harness, cuff = holding_bars(exo.geometry)
    for bar in (*harness, *(bar @ R.T for bar in cuff)):
        ax.plot(*(1e3 * bar[:, [first, second]]).T, color=_FRAME, linewidth=3.5, solid_capstyle="round", zorder=2)
    ends = exo.geometry.platform_points @ R.T
    for i, (a, b) in enumerate(zip(exo.geometry.base_points, ends, strict=True)):
        limb, look = 1e3 * np.array([a, b]), line(i)
        ax.plot(limb[:, first], limb[:, second], **look, linewidth=2.0, zorder=3)
        ax.plot(limb[0, first], limb[0, second], "s", color=look["color"], markersize=6, zorder=4)
        ax.plot(limb[1, first], limb[1, second], "o", color=look["color"], markersize=5, zorder=4)
    ax.plot(0, 0, "+", color=BLACK, markersize=9, zorder=5)
    ax.set(xlabel=f"{_NAMES[first]}, mm", ylabel=f"{_NAMES[second]}, mm", title=title, aspect="equal")
    tidy(ax)


def _turned(capsules: FloatArray, R: FloatArray) -> FloatArray:
    """Capsules of the arm frame in the base frame."""
    moved = np.array(capsules)
    moved[:, 0:3], moved[:, 3:6] = moved[:, 0:3] @ R.T, moved[:, 3:6] @ R.T
    return moved


def _span(exo: ShoulderExo, groups: list[FloatArray]) -> tuple[float, float]:
    """One range, mm, that holds all that is drawn along every axis."""
    rows = np.concatenate(groups)
    points = np.concatenate([rows[:, 0:3], rows[:, 3:6], exo.geometry.base_points])
    edge = float(rows[:, 6].max(initial=0.0)) + 0.05
    return 1e3 * (float(points.min()) - edge), 1e3 * (float(points.max()) + edge)


def _capsule(ax: Any, capsule: FloatArray, first: int, second: int, colour: str) -> None:
    """Fill the outline of a capsule in a view."""
    p, q = 1e3 * capsule[[first, second]], 1e3 * capsule[[3 + first, 3 + second]]
    radius = 1e3 * float(capsule[6])
    along = float(np.arctan2(q[1] - p[1], q[0] - p[0])) if np.linalg.norm(q - p) > 1e-9 else 0.0
    half = np.linspace(-np.pi / 2, np.pi / 2, 24)
    arc = np.concatenate([half + along, half + along + np.pi])
    centres = np.concatenate([np.tile(q, (24, 1)), np.tile(p, (24, 1))])
    outline = centres + radius * np.stack([np.cos(arc), np.sin(arc)], axis=-1)
    ax.fill(*outline.T, facecolor=colour, edgecolor="0.45", linewidth=0.7, alpha=0.8)
