"""Plots of reactions: forces along a motion, limb forces with their limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, require_type
from ...reaction import Reaction
from ..colours import BLACK, PURPLE, RED
from .plot_style import axes_or_new, legend_below, line, right_scale, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Label of the axis of time.
TIME = "time, s"
#: A curve that goes higher than so many times what it stays below in nine of ten poses is cut there, half as high.
_CUT = 3.0
#: Stands for an infinite limit where a band is filled, N.
_FAR = 1e9
#: About so many crosses mark a line that is beyond its limits.
_CROSSES = 20


def force_history(times: ArrayLike, reaction: Reaction, ax: Axes | None = None, label: str = TIME) -> Axes:
    """Shoulder force along a motion, over time or an angle: |F_s|, its components in the base frame, the cuff's pull.

    Poses without an answer are gaps; grey marks poses near a singularity, a dotted line where det X changes sign,
    which no arm can be carried across.

    Parameters
    ----------
    times : array_like
        Shape (k,), s, rising; or what ``label`` says, such as an angle.
    reaction : Reaction
        Of shape (k,).
    ax : matplotlib Axes, optional
        Where to draw; a new figure if left out.
    label : str
        What the curves are drawn over, with its unit.

    Returns
    -------
    matplotlib.axes.Axes
        N on the left; percent of body weight on the right, where that weight is known. Forces beside a singular pose
        that would press all others flat are cut, and a note on the picture has the highest |F_s|.
    """
    stamps = _stamps(times, reaction, label)
    axes = axes_or_new(ax, 7, 4.2)
    axes.plot(stamps, reaction.magnitude, color=BLACK, linewidth=2.2, label="|F_s|")
    for part, name in enumerate(("x forward", "y left", "z up")):
        axes.plot(stamps, reaction.shoulder_force[:, part], **line(part), linewidth=1.5, label=f"F_s {name}")
    if reaction.is_worn:
        axes.plot(stamps, reaction.cuff_pull, color=PURPLE, linestyle="--", linewidth=1.5, label="cuff, along the arm")
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set(xlabel=label, ylabel="shoulder on the arm, N")
    _mark_singular(axes, stamps, reaction)
    _cut_peaks(axes, np.column_stack([reaction.magnitude, reaction.shoulder_force]), "|F_s|")
    if reaction.body_weight is not None:
        right_scale(axes, reaction.body_weight / 100.0, "% of body weight")
    tidy(axes)
    legend_below(axes, 3)
    return axes


def tension_history(
    times: ArrayLike,
    reaction: Reaction,
    limits: tuple[ArrayLike, ArrayLike] | None = None,
    ax: Axes | None = None,
    label: str = TIME,
) -> Axes:
    """Limb forces along a motion, over time or over an angle, with what the actuators can give.

    Parameters
    ----------
    times : array_like
        Shape (k,), s, rising; or what ``label`` says, such as an angle.
    reaction : Reaction
        Of shape (k,).
    limits : (lower, upper), optional
        N, tension positive, each broadcasting to (k, n). Limits that all limbs share are drawn once, as a band;
        limits of their own in each limb's colour, thin. Crosses mark where a limb is beyond them.
    ax : matplotlib Axes, optional
        Where to draw; a new figure if left out.
    label : str
        What the curves are drawn over, with its unit.

    Returns
    -------
    matplotlib.axes.Axes
        Forces beside a singular pose that would press all others flat are cut, as a note on the picture says.

    Raises
    ------
    InvalidInput
        If shapes do not fit, or a lower limit is above its upper one.
    """
    stamps = _stamps(times, reaction, label)
    axes = axes_or_new(ax, 7, 4.2)
    forces, drives = reaction.actuator_forces, reaction.drive_units
    names = [name for name, _ in drives] or [f"limb {i}" for i in range(1, 1 + forces.shape[1])]
    units = " or ".join(sorted({unit for _, unit in drives}))
    # Without limits none are drawn.
    low, high = as_limits((-np.inf, np.inf) if limits is None else limits, forces.shape)
    shared = bool((low == low[:, :1]).all() and (high == high[:, :1]).all())
    if limits is not None and shared:
        order = np.argsort(stamps, kind="stable")
        band = (np.clip(edge[order, 0], -_FAR, _FAR) for edge in (low, high))
        axes.fill_between(stamps[order], *band, color="0.9", label="limits of the actuators")
        for edge in (low[:, 0], high[:, 0]):
            axes.plot(stamps, edge, color="0.45", linewidth=1.0)
    for i in range(forces.shape[1]):
        axes.plot(stamps, forces[:, i], **line(i), linewidth=1.8, label=names[i])
        if not shared:
            for edge in (low[:, i], high[:, i]):
                axes.plot(stamps, edge, **line(i), linewidth=0.8, alpha=0.7)
        with np.errstate(invalid="ignore"):
            beyond = np.flatnonzero((forces[:, i] < low[:, i]) | (forces[:, i] > high[:, i]))
        if beyond.size:
            # Crosses at every pose would hide the line.
            style = {"color": line(i)["color"], "markevery": max(beyond.size // _CROSSES, 1)}
            axes.plot(stamps[beyond], forces[beyond, i], "x", **style, label=f"{names[i]} beyond limits")
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set(xlabel=label, ylabel=f"effort, {units}" if drives else "limb force, N (tension positive)")
    _mark_singular(axes, stamps, reaction)
    edges = [edge[:, :1] for edge in (low, high) if shared and limits is not None]
    _cut_peaks(axes, forces, "|f|", *edges)
    tidy(axes)
    legend_below(axes, 3)
    return axes


def mark_not_held(ax: Any, stamps: FloatArray, reaction: Reaction) -> None:
    """A grey bar at the foot of the axes along poses that are not held: their forces are those that it would take.

    A hollow one along poses that are not evaluated.
    """
    lost, beyond = reaction.has_answer & ~reaction.can_hold & ~reaction.unknown, reaction.status == "not_evaluated"
    foot: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "linestyle": "", "marker": "s", "markersize": 4}
    for rows, label, face in (
        (lost, "not held: the force that it would take", "0.35"),
        (beyond, "not evaluated: no data of a spring", "none"),
    ):
        if rows.any():
            at = np.full(rows.sum(), 0.012)
            ax.plot(stamps[rows], at, color="0.35", markerfacecolor=face, label=label, zorder=1, **foot)


def _stamps(times: ArrayLike, reaction: Reaction, label: str) -> FloatArray:
    stamps = as_finite("times", times, (None,))
    require_type("reaction", reaction, Reaction)
    if reaction.status.shape != stamps.shape or not len(stamps):
        raise InvalidInput(f"expected a pose for every time, got {reaction.status.shape} and {stamps.shape}")
    if label == TIME and (np.diff(stamps) <= 0).any():
        raise InvalidInput("expected times that rise")
    return stamps


def as_limits(limits: tuple[ArrayLike, ArrayLike], shape: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper limits of a shape."""
    try:
        low, high = (np.broadcast_to(np.asarray(edge, dtype=float), shape) for edge in limits)
    except (TypeError, ValueError):
        raise InvalidInput(f"expected limits (lower, upper) that broadcast to {shape}") from None
    if not (low <= high).all():
        raise InvalidInput("expected limits with lower <= upper, and numbers throughout")
    return low, high


def _cut_peaks(ax: Any, values: FloatArray, name: str, *edges: FloatArray) -> None:
    """Limit the axis to what most poses have, and the edges given, and note how far the rest goes."""
    known = np.abs(values[np.isfinite(values).all(axis=1)])
    finite = [np.abs(edge[np.isfinite(edge)]).max(initial=0.0) for edge in edges]
    if not known.size:
        return
    usual = max(float(np.percentile(known.max(axis=1), 90.0)), *finite, 0.0)
    if known.max() <= _CUT * usual:
        return
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    end = 0.5 * _CUT * usual
    ax.set_ylim(max(1.05 * low, -end), min(1.05 * high, end))
    peak = float(f"{known.max():.3g}")
    ax.set_title(f"axis cut: {name} up to {peak:.0f} N beside a singular pose", fontsize=9, loc="right", color="0.3")


def _mark_singular(ax: Any, stamps: FloatArray, reaction: Reaction) -> None:
    """Grey where poses are near a singularity, dotted lines where the motion crosses one."""
    near = np.isin(reaction.equilibrium_status, ("near_singular", "singular", "folded"))
    if near.any():
        edges = np.concatenate([stamps[:1], (stamps[1:] + stamps[:-1]) / 2, stamps[-1:]])
        for i in np.flatnonzero(near):
            label = "near singular" if not near[:i].any() else None
            ax.axvspan(*sorted(edges[i : i + 2]), color="0.82", linewidth=0, zorder=0, label=label)
    for k, (after,) in enumerate(reaction.crossings()):
        middle = (stamps[after] + stamps[after + 1]) / 2
        ax.axvline(middle, color=RED, linestyle=":", linewidth=1.5, label="det X = 0 crossed" if k == 0 else None)
