"""A page of plots of an experiment: what was wanted and what came, air, tensions, shoulder force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.validation import FloatArray
from ..colours import BLACK, GREY
from .plot_style import WIDEST, figure_title, legend_below, line, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...control.experiments.tracking import Tracking

_TIME = "time, s"
#: Cosine of the abduction below which flexion and internal rotation are not drawn.
_LOCK = 0.1
_ANGLES = ("flexion", "abduction", "internal rotation")


def tracking_figure(tracking: Tracking) -> Figure:
    """Six plots over time; see :meth:`exo_pin.control.Tracking.plot`.

    Wanted curves are thin, reached ones thick. A grey background marks wanted poses that the drives cannot hold. Limbs
    with motors have motor forces in place of pressures. A dotted line marks the beginning of a fault.
    """
    figure, axes = new_figure(WIDEST, 8.6, nrows=3, ncols=2, sharex=True)
    run, t = tracking.run, tracking.times
    limbs = [f"limb {i}" for i in range(1, run.tensions.shape[1] + 1)]
    reached, wanted = (_with_meaning(tracking.angles(wanted=which)) for which in (False, True))
    _pairs(axes[0, 0], t, reached, wanted, _ANGLES, "angle, °")
    _pairs(axes[1, 0], t, 100.0 * tracking.ratios, 100.0 * tracking.wanted_ratios, limbs, "contraction, %")
    axes[1, 0].axhline(0.0, color="0.6", linewidth=0.8)
    axes[0, 1].plot(t, np.degrees(tracking.error), color=BLACK, linewidth=2.0)
    axes[0, 1].set(ylabel="angle to the reference pose, °", ylim=(0.0, None))
    if run.plant.motors.any():
        _lines(axes[1, 1], t, run.motor_forces, limbs, "motor force along the limb, N")
    else:
        _lines(axes[1, 1], t, run.pressures / 1e5, limbs, "pressure, bar")
    _lines(axes[2, 0], t, run.tensions, limbs, "tension, N")
    force = tracking.shoulder_force
    _lines(axes[2, 1], t, force, ("F_s x forward", "F_s y left", "F_s z up"), "shoulder on the arm, N")
    axes[2, 1].plot(t, np.linalg.norm(force, axis=1), color=BLACK, linewidth=2.2, label="|F_s|", zorder=1)
    axes[2, 1].axhline(0.0, color="0.6", linewidth=0.8)
    faults = tracking.experiment.faults
    for ax in axes.flat:
        _shade(ax, t, ~tracking.reachable)
        for fault in faults:
            ax.axvline(fault.start, color=BLACK, linewidth=1.0, linestyle=":", zorder=0)
        tidy(ax)
    for ax in axes[-1]:
        ax.set_xlabel(_TIME)
    for ax in axes.flat:
        if curves := len(ax.get_legend_handles_labels()[0]):
            legend_below(ax, min(curves, 4))
    axes[0, 0].set_xlim(t[0], t[-1])
    figure_title(figure, tracking.verdict)
    notes = "thin: reference; thick: reached"
    for fault in faults:
        notes += f"; dotted: limb {fault.limb + 1}, {fault.kind} from {fault.start:g} s on"
    if not tracking.reachable.all():
        notes += "; grey: reference poses that the drives cannot hold at rest"
    if (np.abs(np.cos(np.radians(tracking.angles()[:, 1]))) < _LOCK).any():
        notes += "; near 90° of abduction flexion and internal rotation are not separate angles"
    figure.supxlabel(notes, fontsize=9, color=GREY)
    return figure


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


def _shade(ax: Any, t: FloatArray, where: Any) -> None:
    """Grey background over the samples ``where``."""
    if not where.any():
        return
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    for start, end in edges.reshape(-1, 2):
        ax.axvspan(t[start], t[min(end, len(t) - 1)], color="0.93", linewidth=0, zorder=0)
