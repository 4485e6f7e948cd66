"""Drawing of a design on a body: views from the front, from the side and from above."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from ...core.errors import MissingData
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_rotation, broadcast
from ...design.holding_frame import holding_bars, sleeve_size
from ...reaction.holding.verdict import angle_words
from ...wrist import BodyShape
from ..colours import BLACK
from .plot_style import capsule_outline, figure_title, legend_mark, line, pyplot, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo

#: Views: title, horizontal and vertical axis, and whether the horizontal one points left.
_VIEWS = (("from the front", 1, 2, False), ("from the left", 0, 2, True), ("from above", 1, 0, True))
_NAMES = ("x forward", "y left", "z up")
_TORSO, _ARM, _FRAME, _CUFF = "#C9CED6", "#E3B698", "#4D545E", "#8C96A3"
#: Inches: the three views together, the labels beside them, and the words over a row.
_VIEWS_WIDTH, _BESIDE, _OVER = 6.9, 2.1, 0.75


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
        Joints on the torso are squares, joints on the arm circles; lengths in mm, one scale for all views. The body's
        capsules are those of clearances.

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
    spans = _spans(exo, [bodies[0].torso, *arms], R)
    ranges = np.ptp(spans, axis=1)
    widths = ranges[[view[1] for view in _VIEWS]]
    height = _VIEWS_WIDTH * max(ranges[2], ranges[0]) / widths.sum() + _OVER
    figure = pyplot().figure(figsize=(_VIEWS_WIDTH + _BESIDE, height * len(R) + 1.1), layout="constrained")
    rows = figure.subfigures(len(R), 1, squeeze=False)[:, 0]
    for row, matrix, arm, body, bend in zip(rows, R, arms, bodies, bends, strict=True):
        panels = row.subplots(1, 3, width_ratios=widths)
        for ax, view in zip(panels, _VIEWS, strict=True):
            _draw_view(ax, view, exo, matrix, (bodies[0].torso, arm), body.arm[0, 3:6])
            _, first, second, leftward = view
            ax.set(xlim=spans[first][::-1] if leftward else spans[first], ylim=spans[second])
            ax.set(title=view[0] if row is rows[0] else "", xlabel=ax.get_xlabel() if row is rows[-1] else "")
        words = f"{angle_words(Rotation.from_matrix(matrix), exo.side)}, elbow {np.degrees(bend):.0f}°"
        seen = exo.accuracy(Rotation.from_matrix(matrix))
        words += f"; weakest rate {float(seen.mm_per_degree):.2g} {seen.unit}{', twin' if seen.has_twin else ''}"
        row.suptitle(words, fontsize=10.5, fontweight="bold")
    handles = _handles(exo.geometry.limb_count)
    figure.legend(handles=handles, loc="outside lower center", ncols=-(-len(handles) // 2), frameon=False, fontsize=9.5)
    figure_title(figure, exo.mechanism.title or exo.name, points=12)
    return figure


def _handles(limb_count: int) -> list[Any]:
    """What the legend names: limbs, frame, cuff, elbow and the shoulder's centre."""
    from matplotlib.patches import Patch

    return [
        *(legend_mark(f"limb {i + 1}", **line(i), linewidth=2.0) for i in range(limb_count)),
        legend_mark("joint on the torso", color="0.4", linestyle="", marker="s"),
        legend_mark("joint on the arm", color="0.4", linestyle="", marker="o"),
        legend_mark("frame", color=_FRAME, linewidth=3.5),
        Patch(facecolor=_CUFF, edgecolor=_FRAME, label="cuff"),
        legend_mark("elbow", color=BLACK, linestyle="", marker="o", markerfacecolor="white"),
        legend_mark("shoulder", color=BLACK, linestyle="", marker="+", markersize=9),
    ]


def _draw_view(
    ax: Any,
    view: tuple[str, int, int, bool],
    exo: ShoulderExo,
    R: FloatArray,
    body: tuple[FloatArray, FloatArray],
    elbow: FloatArray,
) -> None:
    """One view: body, frame and cuff, limbs and joints."""
    _, first, second, _ = view
    plane = [first, second]
    for capsules, colour in zip(body, (_TORSO, _ARM), strict=True):
        for capsule in capsules:
            p, q = 1e3 * capsule[plane], 1e3 * capsule[[3 + first, 3 + second]]
            outline = capsule_outline(p, q, 1e3 * capsule[6])
            ax.fill(*outline, facecolor=colour, edgecolor="0.45", linewidth=0.7, alpha=0.8)
    harness, cuff = holding_bars(exo.geometry)
    sleeve = 1e3 * (_sleeve(exo.geometry.platform_points) @ R.T)[:, plane]
    ax.fill(
        *sleeve[ConvexHull(sleeve).vertices].T, facecolor=_CUFF, edgecolor=_FRAME, linewidth=1.0, alpha=0.85, zorder=2
    )
    for bar in (*harness, *(bar @ R.T for bar in cuff)):
        ax.plot(*(1e3 * bar[:, plane]).T, color=_FRAME, linewidth=3.0, solid_capstyle="round", zorder=2)
    ends = exo.geometry.platform_points @ R.T
    for i, (a, b) in enumerate(zip(exo.geometry.base_points, ends, strict=True)):
        limb, look = 1e3 * np.array([a, b]), line(i)
        ax.plot(limb[:, first], limb[:, second], **look, linewidth=2.2, zorder=3)
        ax.plot(limb[0, first], limb[0, second], "s", color=look["color"], markersize=6, zorder=4)
        ax.plot(limb[1, first], limb[1, second], "o", color=look["color"], markersize=5, zorder=4)
    bent = 1e3 * (R @ elbow)[plane]
    ax.plot(*bent, "o", color=BLACK, markerfacecolor="white", markersize=6, zorder=5)
    ax.plot(0, 0, "+", color=BLACK, markersize=9, zorder=5)
    ax.set(xlabel=f"{_NAMES[first]}, mm", ylabel=f"{_NAMES[second]}, mm", aspect="equal", anchor="N")
    ax.locator_params(nbins=5)
    tidy(ax)


def _sleeve(points: FloatArray) -> FloatArray:
    """Points of both rims of the cuff's sleeve, arm frame, shape (k, 3), m."""
    radius, *rims = sleeve_size(points)
    turns = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    return np.concatenate(
        [np.stack([radius * np.cos(turns), radius * np.sin(turns), np.full(48, rim)], axis=1) for rim in rims]
    )


def _turned(capsules: FloatArray, R: FloatArray) -> FloatArray:
    """Capsules of the arm frame in the base frame."""
    moved = np.array(capsules)
    moved[:, 0:3], moved[:, 3:6] = moved[:, 0:3] @ R.T, moved[:, 3:6] @ R.T
    return moved


def _spans(exo: ShoulderExo, groups: list[FloatArray], R: FloatArray) -> FloatArray:
    """Least and greatest coordinate of all that is drawn, shape (3, 2), mm, by axis."""
    rows, (harness, cuff) = np.concatenate(groups), holding_bars(exo.geometry)
    balls = np.concatenate([rows[:, 0:3], rows[:, 3:6]])
    radii = np.tile(rows[:, 6:], (2, 1))
    thin = np.concatenate([exo.geometry.base_points, *harness, *(bar @ turn.T for bar in cuff for turn in R)])
    low = np.minimum((balls - radii).min(axis=0), thin.min(axis=0)) - 0.03
    high = np.maximum((balls + radii).max(axis=0), thin.max(axis=0)) + 0.03
    return 1e3 * np.stack([low, high], axis=1)
