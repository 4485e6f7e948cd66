"""Figures of whole answers: a pose, a stack of poses, a movement, a map, a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.conventions import shoulder_angles
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.tables import newtons
from ...core.validation import FloatArray, as_choice, as_finite
from ...reaction import MovementReaction, Reaction
from ...reaction.holding.verdict import angle_words
from ..colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, SKY
from .plot_style import (
    WIDEST,
    figure_title,
    legend_below,
    line,
    minded,
    name_rows,
    new_figure,
    pyplot,
    right_scale,
    tidy,
    wrapped,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...uncertainty.force_uncertainty import ForceUncertainty
    from ...uncertainty.total_uncertainty import TotalUncertainty


#: A curve that goes higher than so many times what it stays below in nine of ten poses is cut there, half as high.
_CUT = 3.0
#: Stands for an infinite limit where a band is filled, N.
_FAR = 1e9
#: Label of poses that are numbered.
_NUMBER = "pose"
#: About so many crosses mark a line that is beyond its limits.
_CROSSES = 20


class _Broken:
    """Lines along a motion, with gaps where it crosses a singular pose: forces have no bound there."""

    def __init__(self, stamps: FloatArray, reaction: Reaction) -> None:
        self._before = [after + 1 for (after,) in reaction.crossings()]
        self.stamps = self.of(stamps)

    def of(self, values: FloatArray) -> FloatArray:
        return np.insert(np.asarray(values, dtype=float), self._before, np.nan)


def _force_curves(axes: Any, stamps: FloatArray, reaction: Reaction) -> None:
    """Shoulder force along a motion: |F_s|, its components in the base frame, the pull of the cuff."""
    own = _Broken(stamps, reaction)
    axes.plot(own.stamps, own.of(reaction.magnitude), color=BLACK, linewidth=2.2, label="|F_s|")
    for part, name in enumerate(("x forward", "y left", "z up")):
        axes.plot(
            own.stamps, own.of(reaction.shoulder_force[:, part]), **line(part), linewidth=1.5, label=f"F_s {name}"
        )
    if reaction.is_worn:
        look: dict[str, Any] = {"color": PURPLE, "linestyle": "--", "linewidth": 1.5, "label": "cuff, along the arm"}
        axes.plot(own.stamps, own.of(reaction.cuff_pull), **look)
    axes.set(ylabel="shoulder on the arm, N")
    if reaction.body_weight is not None:
        right_scale(axes, reaction.body_weight / 100.0, "% of body weight")


def _tension_curves(
    axes: Any, stamps: FloatArray, reaction: Reaction, limits: tuple[ArrayLike, ArrayLike] | None
) -> list[FloatArray]:
    """Limb forces along a motion with ``limits`` (lower, upper), N, tension positive, each broadcasting to (k, n).

    Limits that all limbs share are drawn once, as a band, and returned; limits of their own in each limb's colour,
    thin. Crosses mark where a limb is beyond them.
    """
    own, forces, drives = _Broken(stamps, reaction), reaction.actuator_forces, reaction.drive_units
    names, limbs = [name for name, _ in drives], reaction.source.poses.mechanism.has_limbs
    units = _units(reaction)
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
        axes.plot(own.stamps, own.of(forces[:, i]), **line(i), linewidth=1.8, label=names[i])
        if not shared:
            for edge in (low[:, i], high[:, i]):
                axes.plot(stamps, edge, **line(i), linewidth=0.8, alpha=0.7)
        with np.errstate(invalid="ignore"):
            beyond = np.flatnonzero((forces[:, i] < low[:, i]) | (forces[:, i] > high[:, i]))
        if beyond.size:
            # Crosses at every pose would hide the line.
            style = {"color": line(i)["color"], "markevery": max(beyond.size // _CROSSES, 1)}
            axes.plot(stamps[beyond], forces[beyond, i], "x", **style, label=f"{names[i]} beyond limits")
    axes.set(ylabel="limb force, N (tension positive)" if limbs else f"effort, {units}")
    return [edge[:, :1] for edge in (low, high) if shared and limits is not None]


def _units(reaction: Reaction) -> str:
    """Units of the efforts: "N", "N m", or "N or N m"."""
    return " or ".join(sorted({unit for _, unit in reaction.drive_units}))


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


def as_limits(limits: tuple[ArrayLike, ArrayLike], shape: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper limits of a shape."""
    try:
        low, high = (np.broadcast_to(np.asarray(edge, dtype=float), shape) for edge in limits)
    except (TypeError, ValueError):
        raise InvalidInput(f"expected limits (lower, upper) that broadcast to {shape}") from None
    if not (low <= high).all():
        raise InvalidInput("expected limits with lower <= upper, and numbers throughout")
    return low, high


def _cut_peaks(ax: Any, values: FloatArray, name: str, edges: list[FloatArray], unit: str = "N") -> None:
    """Limit the axis to what most poses have, and the edges given, and note how far the rest goes."""
    known = np.abs(values[np.isfinite(values).all(axis=1)])
    finite = [np.abs(edge[np.isfinite(edge)]).max(initial=0.0) for edge in edges]
    if not known.size:
        return
    usual = max([float(np.percentile(known.max(axis=1), 90.0)), *finite])
    if known.max() <= _CUT * usual:
        return
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    end = 0.5 * _CUT * usual
    ax.set_ylim(max(1.05 * low, -end), min(1.05 * high, end))
    peak = float(f"{known.max():.3g}")
    ax.set_title(
        f"axis cut: {name} up to {peak:.0f} {unit} beside a singular pose", fontsize=9, loc="right", color="0.3"
    )


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


#: What a movement can be drawn over: its label, and which clinical angle.
_AGAINST = {
    "time": ("time, s", None),
    "flexion": ("flexion, °", 0),
    "abduction": ("abduction, °", 1),
    "internal_rotation": ("internal rotation, °", 2),
}


@checked
def reaction_figure(
    reaction: Reaction,
    along: ArrayLike | None = None,
    label: str = _NUMBER,
    limits: tuple[ArrayLike, ArrayLike] | None = None,
) -> Figure:
    """Figure of a reaction; see :meth:`exo_pin.Reaction.plot`."""
    if reaction.status.ndim == 0:
        figure, (left, right) = new_figure(WIDEST, 4.4, ncols=2, width_ratios=[1.25, 1.0])
        pose_bars(figure, left, right, reaction, limits)
        return figure
    if reaction.status.ndim > 1:
        raise InvalidInput(
            f"expected poses along one dimension, got a stack of shape {reaction.status.shape}; draw one row of it, or "
            "a reaction_map of two dimensions"
        )
    places = np.arange(reaction.status.size, dtype=float) if along is None else as_finite("along", along, (None,))
    return _curves(places, reaction, label, limits, reaction.cautions)


def movement_figure(
    answer: MovementReaction,
    against: str = "time",
    side: str = "left",
    limits: tuple[ArrayLike, ArrayLike] | None = None,
) -> Figure:
    """Figure of a movement; see :meth:`exo_pin.reaction.MovementReaction.plot`."""
    label, angle = _AGAINST[as_choice("quantity to draw against", against, _AGAINST)]
    movement = answer.movement
    angles = shoulder_angles(movement.poses, side, degrees=True)
    places = movement.times if angle is None else angles[:, angle]
    return _curves(places, answer.reaction, label, limits, answer.cautions)


def uncertainty_figure(answer: ForceUncertainty) -> Figure:
    """Figure of how sure |F_s| is; see :meth:`exo_pin.uncertainty.force_uncertainty.ForceUncertainty.plot`."""
    effects = answer.effects
    canvas, axes = new_figure(7.2, 1.3 + 0.3 * len(effects))
    finite = [value for effect in effects for value in (effect.least, effect.greatest) if np.isfinite(value)]
    # A bar without an end leaves the picture.
    edge = max([*finite, answer.magnitude]) + 0.15 * (np.ptp([*finite, answer.magnitude]) or 1.0)
    for row, effect in enumerate(effects):
        most = min(effect.greatest, edge)
        colour = BLUE if effect.holds else ORANGE
        axes.barh(row, most - effect.least, left=effect.least, height=0.6, color=colour)
        if np.isinf(effect.greatest):
            axes.annotate("no bound", (edge, row), va="center", ha="right", fontsize=8, color="white")
    axes.axvline(answer.magnitude, color=BLACK, linewidth=1.2)
    names = [f"{quantity_words(effect.name)} ±{effect.size:g}{unit_words(effect.name)}" for effect in effects]
    name_rows(axes, names, 9)
    axes.set_xlabel("|F_s|, N")
    # Bars would hold the axis to their own ends.
    axes.use_sticky_edges = False
    axes.margins(x=0.06)
    lost = "" if all(effect.holds for effect in effects) else "; orange: not held over the whole range"
    mechanism, poses = answer.answer.source.poses.mechanism, answer.answer.case.poses
    figure_title(
        canvas,
        f"{mechanism.name}, {angle_words(poses, mechanism.side)}:",
        f"|F_s| {answer.magnitude:.1f} N, and with each quantity changed alone{lost}",
        points=10,
    )
    tidy(axes, "x")
    return canvas


def quantity_words(name: str) -> str:
    """An uncertain quantity in words: "joint A 1", "centre of mass"."""
    words = name.rpartition("_")[0]
    if words[:2] in ("A[", "B["):
        return f"joint {words[0]} of limb {words[2:-1]}" if words.endswith("]") else words
    return {"offset": "centre of the device", "guides": "stiffness of guides"}.get(words, words.replace("_", " "))


def unit_words(name: str) -> str:
    """The unit of an uncertain quantity: " mm", "°", " %"."""
    unit = name.rpartition("_")[2]
    return {"deg": "°", "percent": " %"}.get(unit, f" {unit}")


def pose_bars(
    figure: Any, left: Any, right: Any, reaction: Reaction, limits: tuple[ArrayLike, ArrayLike] | None = None
) -> None:
    """Bars of the limb forces with their limits, and of F_s with its components, N, and what they rest on."""
    # Only limbs have side forces that a split chooses.
    limbs = reaction.source.poses.mechanism.has_limbs
    state = f"split “{reaction.split}”".replace("_", " ") if limbs else ""
    none = "" if reaction.has_answer else f"No forces: the pose is {str(reaction.status).replace('_', ' ')}"
    figure_title(figure, none, reaction.verdict, *minded(reaction.cautions))
    f, g, sure = reaction.actuator_forces, reaction.constraint_forces, reaction.certificate
    names = [f"{name}\n{'pull f' if limbs else unit}" for name, unit in reaction.drive_units]
    heights, determined = list(f), list(sure.actuator_forces)
    if np.nan_to_num(np.abs(g)).max(initial=0.0) > 0.0:
        owner = "limb" if sure.words[1] == "side forces g" else "structure"
        names += [f"{owner} {i + 1}\nside g" for i in range(len(g))]
        heights, determined = [*heights, *g], [*determined, *sure.constraint_forces]
    _bars(left, names, heights, [BLUE if value >= 0 else ORANGE for value in heights], determined)
    if limits is not None:
        _limit_marks(left, limits, len(f))
    units = {unit for _, unit in reaction.drive_units} | ({"N"} if len(heights) > len(f) else set())
    left.set_ylabel(", or ".join(f"{'force' if unit == 'N' else 'moment'}, {unit}" for unit in sorted(units)))
    left.set_title("limbs: blue pulls, orange pushes" if limbs else "drives and their efforts", fontsize=10.5)
    whole = bool(sure.shoulder_force.all())
    values = [float(reaction.magnitude), *reaction.shoulder_force]
    known = [whole, *sure.shoulder_force]
    names, colours = ["|F_s|", "x\nforward", "y\nleft", "z\nup"], [RED, SKY, SKY, SKY]
    if reaction.cuff_text():
        # Whatever the cuff pulls with, the shoulder does not: one is determined if the other is.
        values, known = [*values, float(reaction.cuff_pull)], [*known, whole]
        names, colours = [*names, "cuff,\nalong\nthe arm"], [*colours, PURPLE]
    _bars(right, names, values, colours, known)
    share = reaction.percent_body_weight
    weight = "" if share is None or not np.isfinite(share) else f": {float(share):.1f} % of body weight"
    right.set_title(f"shoulder on the arm{weight}", fontsize=10.5)
    if not (all(determined) and all(known)):
        state += "; hatched: equilibrium alone does not determine it"
    note = wrapped(state.removeprefix("; "), figure.bbox.width / figure.dpi, 9.0)
    figure.supxlabel(note, fontsize=9, color="0.3")


def _bars(axes: Any, names: list[str], heights: list[float], colours: list[str], known: list[Any]) -> None:
    """Bars with their numbers; hatched where equilibrium does not determine them."""
    places = np.arange(len(names))
    drawn = np.nan_to_num(np.array(heights, dtype=float))
    bars = axes.bar(places, drawn, 0.62, color=colours)
    for bar, sure in zip(bars, known, strict=True):
        if not sure:
            bar.set(hatch="////", edgecolor="white", linewidth=0.0)
    # On white, so that a line of a limit does not cross the number.
    white = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85}
    words = [newtons(value) if np.isfinite(value) else "none" for value in heights]
    axes.bar_label(bars, words, padding=3.0, fontsize=9, bbox=white)
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.set_xticks(places, names, fontsize=9)
    # Bars that all go down leave room above for their numbers.
    axes.use_sticky_edges = bool(np.round(drawn).max(initial=0.0) > 0.0)
    axes.margins(y=0.18)
    if not drawn.any():
        axes.set(ylim=(-1.0, 1.0), yticks=[0.0])
    tidy(axes, "y")


def _limit_marks(axes: Any, limits: tuple[ArrayLike, ArrayLike], count: int) -> None:
    edges = np.concatenate(as_limits(limits, (count,)))
    known = np.flatnonzero(np.isfinite(edges))
    if known.size:
        ends = known % count - 0.42, known % count + 0.42
        axes.hlines(edges[known], *ends, color=GREEN, linewidth=2.4, label="limits of the actuator")
    legend_below(axes)


def _curves(places: FloatArray, reaction: Reaction, label: str, limits: Any, cautions: Sequence[str]) -> Figure:
    """Forces of shoulder and limbs along a motion.

    Poses without an answer are gaps, and so is where det X changes sign, at a dotted line, which no arm can be carried
    across; grey marks poses near a singularity. Forces beside a singular pose that would press all others flat are cut,
    and a note on the picture has the highest.
    """
    if reaction.status.shape != places.shape or not len(places):
        raise InvalidInput(f"expected a place for every pose, got {places.shape} and {reaction.status.shape}")
    figure, (top, bottom) = new_figure(7.6, 8.0, nrows=2, sharex=True)
    figure_title(figure, reaction.source.poses.mechanism.name, reaction.verdict, *minded(cautions), points=10.5)
    for ax in (top, bottom):
        mark_not_held(ax, places, reaction)
    _force_curves(top, places, reaction)
    edges = _tension_curves(bottom, places, reaction, limits)
    bottom.set_xlabel(label)
    if label == _NUMBER:
        bottom.locator_params(axis="x", integer=True)
    on_arm = np.column_stack([reaction.magnitude, reaction.shoulder_force])
    for ax in (top, bottom):
        ax.axhline(0.0, color="0.6", linewidth=0.8)
        _mark_singular(ax, places, reaction)
        tidy(ax)
        legend_below(ax, 3)
    _cut_peaks(top, on_arm, "|F_s|", [])
    _cut_peaks(bottom, reaction.actuator_forces, "|f|", edges, _units(reaction))
    return figure


def total_uncertainty_figure(spread: TotalUncertainty) -> Figure:
    """Figure of all that is uncertain at once; :meth:`exo_pin.uncertainty.total_uncertainty.TotalUncertainty.plot`."""
    looks = [("|F_s|, N", spread.shoulder_forces, spread.magnitude, "of_F_s", BLUE)]
    looks += [("force in the joint, N", spread.joint_forces, spread.joint_N, "of_joint", ORANGE)]
    looks = [look for look in looks if np.isfinite(look[1]).any()]
    quantiles = list(spread.quantiles.values())
    named = [each for each in spread.explained if max(np.nan_to_num((each.of_F_s, each.of_joint))) >= 0.01]
    rows, words = np.arange(len(named)), []
    for each in named:
        size = f"{'0 to ' if each.name == 'tone_percent' else '±'}{each.size:g}"
        words.append(f"{quantity_words(each.name)} {size}{unit_words(each.name)}")
    canvas = pyplot().figure(figsize=(9.0, 3.2 + 0.3 * len(named)), layout="constrained")
    panels = canvas.subplots(2, len(looks), squeeze=False, height_ratios=(1.0, 0.5 + 0.16 * len(named)))
    for column, (label, values, asked, share, colour) in enumerate(looks):
        above, below = panels[:, column]
        above.hist(values[np.isfinite(values)], bins=24, color=colour)
        low, middle, high = quantiles[column]
        above.axvspan(low, high, color="0.5", alpha=0.18, zorder=0)
        above.axvline(asked, color=BLACK, linewidth=1.4)
        above.set(xlabel=label, yticks=[])
        above.set_title(f"{low:.0f} to {high:.0f} N in nine of ten, median {middle:.0f}; line: as asked", fontsize=9)
        below.barh(rows, [100.0 * np.nan_to_num(getattr(each, share)) for each in named], height=0.65, color=colour)
        name_rows(below, [""] * len(words) if column else words, 8)
        below.set_xlabel("explains alone, % of the variance")
        for axes in (above, below):
            tidy(axes, "x")
    figure_title(canvas, f"{spread.title}: everything uncertain at once")
    return canvas
