"""Pictures of muscles: the force map with its validity region, a muscle in motion.

A page of plots of an experiment: what was wanted and what came, air, tensions, shoulder force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...control.experiments.tracking_report import drive_kinds, verdict_of
from ...core.errors import InvalidInput
from ...core.tables import enumerated
from ...core.validation import FloatArray, require_type
from ...device import as_device
from ...muscle.io.measured import SteadyStates
from ...muscle.laws.static import BAR, StaticModel
from ..colours import BLACK, BLUE, GREY, RED
from .plot_style import WIDEST, even_steps, figure_title, legend_below, legend_mark, line, new_figure, outlined, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...control.experiments.tracking import Tracking

_INK, _GREY = "#222222", "#8a8a8a"


def plot_force_map(model: StaticModel, states: SteadyStates | None = None) -> Figure:
    """Draw force over contraction and pressure, with the region where the model holds.

    Parameters
    ----------
    model : StaticModel
        Of any length.
    states : SteadyStates or None
        Measured states to mark, for a model of the length they were measured at; None for none.

    Returns
    -------
    matplotlib.figure.Figure
        Unfilled where the model does not hold; ``.savefig(path)`` writes it.

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    """
    require_type("model", model, StaticModel)
    require_type("states", states, SteadyStates | None)
    figure, axis = new_figure(7.6, 4.8)
    high = model.validity.strain[1]
    x = np.linspace(0.0, 1.12 * high, 700) * model.length
    p = np.linspace(0.0, 1.1 * model.validity.pressure[1], 600)
    force = model.force(x[np.newaxis], p[:, np.newaxis], outside="mark")
    raw = np.ma.getdata(force)
    levels = even_steps(max(float(force.max()), np.finfo(float).tiny))
    filled = axis.contourf(x * 1e3, p / BAR, force, levels=levels, cmap="cividis", alpha=0.9)
    lines = axis.contour(x * 1e3, p / BAR, raw, levels=levels, colors=_INK, linewidths=0.7, alpha=0.65)
    for text in axis.clabel(lines, fmt="%g N", fontsize=8.5, manual=_places(lines, x[-1] * 1e3, p[-1] / BAR)):
        text.set_path_effects(outlined())
    inside = (~np.ma.getmaskarray(force)).astype(float)
    axis.contour(x * 1e3, p / BAR, inside, levels=[0.5], colors=RED, linewidths=2.2)
    handles = [legend_mark("the model holds inside", color=RED, linewidth=2.2)]
    if states is not None:
        if not np.isclose(model.scale, 1.0):
            raise InvalidInput("expected a model of the length the states were measured at, got a scaled one")
        for valid, face, label in ((True, "white", "measured, called valid"), (False, "none", "measured, beyond")):
            pick = states.called_valid == valid
            edge = _INK if valid else _GREY
            style = {"s": 26, "facecolor": face, "edgecolor": edge, "linewidth": 1.1}
            axis.scatter(states.contraction[pick] * 1e3, states.pressure[pick] / BAR, **style, zorder=4, clip_on=False)
            look = {"linestyle": "", "marker": "o", "markerfacecolor": face, "markeredgecolor": edge}
            handles.append(legend_mark(label, **look))
    axis.spines[["top", "right"]].set_visible(False)
    axis.set(xlabel="contraction, mm", xlim=(0.0, x[-1] * 1e3), ylabel="pressure, bar", ylim=(0.0, p[-1] / BAR))
    axis.set_title(f"Pull of a {model.length * 1e3:.0f} mm muscle, {model.name}", loc="left", fontsize=11)
    figure.colorbar(filled, ax=axis, label="force, N", ticks=levels, format="{x:g}")
    figure.legend(handles=handles, loc="outside lower left", ncols=len(handles), frameon=False, fontsize=9)
    return figure


def _places(lines: Any, wide: float, high: float) -> list[Any]:
    """Where the numbers of contour lines stand: on the diagonal of the axes, which a line of equal force crosses."""
    places = []
    for path in lines.get_paths():
        shares = path.vertices / (wide, high)
        shares = shares[((shares > 0.08) & (shares < 0.92)).all(axis=1)]
        if len(shares):
            places.append(shares[np.abs(shares.sum(axis=1) - 1.0).argmin()] * (wide, high))
    return places


#: Columns of a motion that are drawn, with their labels.
_DRAWN = {
    "contraction_mm": "contraction, mm",
    "pressure_bar": "pressure, bar",
    "duty_percent": "valve fills,\n% of time",
}


def plot_motion(columns: Mapping[str, FloatArray]) -> Figure:
    """Draw a muscle in motion: contraction, pressure, and the share of time its valve fills it, where there is one.

    Parameters
    ----------
    columns : mapping
        Those that ``exo-pin muscle step --out`` and ``exo-pin muscle loop --out`` write.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    """
    columns = {**columns, **({"duty_percent": 100.0 * columns["duty"]} if "duty" in columns else {})}
    drawn = [name for name in _DRAWN if name in columns]
    ratios = [3] + [1] * (len(drawn) - 1)
    figure, axes = new_figure(8.4, 5.4, nrows=len(drawn), sharex=True, height_ratios=ratios)
    t = columns["time_s"]
    if "wanted_mm" in columns:
        axes[0].plot(t, columns["wanted_mm"], color=GREY, linewidth=1.2, label="wanted")
    axes[0].plot(t, columns["contraction_mm"], color=BLUE, linewidth=1.8, label="reached")
    for axis, name in zip(axes[1:], drawn[1:], strict=True):
        axis.plot(t, columns[name], color=_INK, linewidth=1.4)
    for axis, name in zip(axes, drawn, strict=True):
        axis.spines[["top", "right"]].set_visible(False)
        axis.set(ylabel=_DRAWN[name], ylim=(0.0, None))
    beyond = ~np.asarray(columns.get("inside", np.ones(len(t))), dtype=bool)
    if beyond.any():
        look = {"transform": axes[0].get_xaxis_transform(), "color": "0.9", "linewidth": 0, "zorder": 0}
        axes[0].fill_between(t, 0.0, 1.0, where=beyond, **look, label="outside the model's range")
    axes[0].legend(frameon=False, loc="lower right")
    axes[-1].set(xlabel=_TIME)
    return figure


_TIME = "time, s"
#: Cosine of the abduction below which flexion and internal rotation are not drawn.
_LOCK = 0.1
_ANGLES = ("flexion", "abduction", "internal rotation")


def tracking_figure(tracking: Tracking) -> Figure:
    """Six plots over time; see :meth:`exo_pin.control.Tracking.plot`.

    Wanted curves are thin, reached ones thick. A grey background marks wanted poses that the drives cannot hold.
    Muscles have pressures, motors forces; drives of another unit have a scale on the right. A dotted line marks the
    beginning of a fault.
    """
    figure, axes = new_figure(WIDEST, 8.6, nrows=3, ncols=2, sharex=True)
    run, t = tracking.run, tracking.times
    names = [name.replace("_", " ") for name, _ in as_device(run.plant.mechanism).drive_units[: run.plant.count]]
    reached, wanted = (_with_meaning(tracking.angles(wanted=which)) for which in (False, True))
    _pairs(axes[0, 0], t, reached, wanted, _ANGLES, "angle, °")
    axes[0, 1].plot(t, np.degrees(tracking.error), color=BLACK, linewidth=2.0)
    axes[0, 1].set(ylabel="angle to the reference, °", ylim=(0.0, None))
    _of_drives(tracking, names, (axes[1, 0], axes[1, 1], axes[2, 0]))
    force = tracking.shoulder_force
    _lines(axes[2, 1], t, force, ("F_s x forward", "F_s y left", "F_s z up"), "shoulder on the arm, N")
    axes[2, 1].plot(t, np.linalg.norm(force, axis=1), color=BLACK, linewidth=2.2, label="|F_s|", zorder=1)
    axes[2, 1].axhline(0.0, color="0.6", linewidth=0.8)
    faults = tracking.experiment.faults
    for ax in axes.flat:
        ax.set_ylim(ax.get_ylim())
        lost = {"where": ~tracking.reachable, "transform": ax.get_xaxis_transform()}
        ax.fill_between(t, 0.0, 1.0, **lost, color="0.93", linewidth=0, zorder=0)
        for fault in faults:
            ax.axvline(fault.start, color=BLACK, linewidth=1.0, linestyle=":", zorder=0)
        tidy(ax)
        ax.set_xlabel(_TIME if ax.get_subplotspec().is_last_row() else "")
        legend_below(ax, 4)
    axes[0, 0].set_xlim(t[0], t[-1])
    figure_title(figure, verdict_of(tracking))
    notes = "thin: reference; thick: reached"
    for fault in faults:
        notes += f"; dotted: {names[fault.limb]}, {fault.kind} from {fault.start:g} s on"
    if not tracking.reachable.all():
        notes += "; grey: reference poses that the drives cannot hold at rest"
    if np.isnan(reached + wanted).any():
        notes += "; near 90° of abduction flexion and internal rotation are not separate angles"
    figure.supxlabel(notes, fontsize=9, color=GREY)
    return figure


#: Coordinate, what acts on it, and effort of a drive by what it moves: labels, and the scales in which they are drawn.
_OF_DRIVES = {
    "limb": (("contraction, %", 100.0), ("motor force along the limb, N", 1.0), ("tension, N", 1.0)),
    "slide": (("position in the joint, mm", 1e3), ("motor force, N", 1.0), ("force in the joint, N", 1.0)),
    "turn": (("angle of the joint, °", 180.0 / np.pi), ("motor moment, N m", 1.0), ("moment in the joint, N m", 1.0)),
}
_PRESSURE = ("pressure, bar", 1.0 / BAR)


def _of_drives(tracking: Tracking, names: Sequence[str], axes: Any) -> None:
    """Coordinates, pressures or motor forces, and efforts of the drives; each unit has a scale of its own."""
    run, motors, kinds = tracking.run, tracking.run.plant.motors, drive_kinds(tracking.run.plant)
    is_limb = np.array(kinds, dtype=str) == "limb"
    reached = np.where(is_limb, tracking.ratios, run.lengths)
    wanted = np.where(is_limb, tracking.wanted_ratios, tracking.wanted_lengths)
    source = np.where(motors, run.motor_forces, run.pressures)
    for which, (ax, values) in enumerate(zip(axes, (reached, source, run.tensions), strict=True)):
        looks = [_OF_DRIVES[kind][which] for kind in kinds]
        if which == 1:
            looks = [look if motor else _PRESSURE for look, motor in zip(looks, motors, strict=True)]
        for place, (label, scale) in enumerate(dict.fromkeys(looks)):
            own = [k for k, look in enumerate(looks) if look == (label, scale)]
            part = ax if place == 0 else ax.twinx()
            part.set_ylabel(label if len(own) == len(looks) else f"{label}\n{enumerated(names[k] for k in own)}")
            if place > 0:
                part.spines[["top", "left"]].set_visible(False)
                part.spines["right"].set_position(("axes", 0.75 + 0.25 * place))
            for k in own:
                look = {**line(k), "linewidth": 1.8, "label": names[k]}
                part.plot(tracking.times, scale * values[:, k], **look)
                if place > 0:
                    ax.plot([], [], **look)
                if which == 0:
                    part.plot(tracking.times, scale * wanted[:, k], color=line(k)["color"], linewidth=0.9)
    if is_limb.any():
        axes[0].axhline(0.0, color="0.6", linewidth=0.8)


def _with_meaning(angles: FloatArray) -> FloatArray:
    """Angles in degrees without flexion and internal rotation near 90° of abduction, where only their sum has one."""
    shown = angles.copy()
    shown[np.abs(np.cos(np.radians(angles[:, 1]))) < _LOCK, ::2] = np.nan
    return shown


def _lines(ax: Any, t: FloatArray, values: FloatArray, names: Any, label: str) -> None:
    for k, (name, column) in enumerate(zip(names, values.T, strict=True)):
        ax.plot(t, column, **line(k), linewidth=1.8, label=name)
    ax.set_ylabel(label)


def _pairs(ax: Any, t: FloatArray, reached: FloatArray, wanted: FloatArray, names: Any, label: str) -> None:
    _lines(ax, t, reached, names, label)
    for k, column in enumerate(wanted.T):
        ax.plot(t, column, color=line(k)["color"], linewidth=0.9)
