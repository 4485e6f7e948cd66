"""Figure of a detailed comparison of devices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.validation import FloatArray
from ..colours import BLACK, BLUE, GREEN, GREY, ORANGE, RED, SKY
from .plot_style import WIDEST, legend_below, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...study import StudyTable

#: Of a label that stands in the place of a bar or behind its end, points.
_SMALL = 8.5
#: |F_s| and changes of it leave the picture beyond so many times the largest median, and 10 mm beyond so many N.
_FAR, _FAR_CHANGE = 8.0, 100.0


def comparison_figure(table: StudyTable) -> Figure:
    """Six figures of every device of a detailed comparison; see :meth:`exo_pin.study.StudyTable.plot`."""
    at = np.arange(float(table.row_count))
    figure, axes = new_figure(WIDEST, 4.2 + 0.75 * table.row_count, nrows=3, ncols=2, sharey=True)
    columns = {name: np.asarray(table[name], dtype=float) for name in table if table[name].dtype.kind in "fiu"}
    panels = (_poses, _shoulder_force, _contact, _misalignment, _drives, _masses)
    for ax, panel in zip(axes.flat, panels, strict=True):
        panel(ax, at, columns)
        tidy(ax)
        ax.grid(False, axis="y")
        ax.set_xlim(left=0.0)
        if ax.get_legend_handles_labels()[0]:
            legend_below(ax)
    axes[0, 0].set_yticks(at, [str(name) for name in table["design"]])
    axes[0, 0].invert_yaxis()
    return figure


def _poses(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    share = {name: 100.0 * columns[name] for name in ("holdable", "held_after_failure", "clear", "singular")}
    ax.barh(at - 0.18, share["holdable"], 0.34, color=BLUE, label="held")
    ax.barh(at + 0.18, np.nan_to_num(share["held_after_failure"]), 0.34, color=ORANGE, label="held after a failure")
    ax.plot(share["clear"], at, "D", ms=5, markerfacecolor="none", color=BLACK, label="clear of the wearer")
    ax.plot(share["singular"], at, "x", ms=6, color=RED, clip_on=False, label="singular, of those reached")
    ax.set(title="poses", xlabel="%")


def _shoulder_force(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    _median_to_peak(ax, at, columns["median_F_s_N"], columns["peak_F_s_N"])
    ax.set(title="shoulder force of held poses", xlabel="|F_s|, N: median (dot) to peak")


def _contact(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    _median_to_peak(ax, at, columns["contact_N"], columns["peak_contact_N"])
    ax.plot(columns["contact_without_N"], at, "s", ms=5, color=GREY, label="without device, median there")
    ax.set(title="joint, with the wearer's muscles", xlabel="contact force, N: median (dot) to peak")


def _median_to_peak(ax: Any, at: FloatArray, median: FloatArray, peak: FloatArray) -> None:
    ax.hlines(at, median, peak, color=SKY, linewidth=2.5)
    ax.plot(median, at, "o", ms=6, color=BLUE)
    known = median[np.isfinite(median)]
    if known.size and np.nanmax(peak) > (far := _FAR * known.max()):
        # A peak beside a singular pose would press all others flat.
        ax.set_xlim(right=far)
    _say(ax, at[np.isnan(median)], "holds none, or not known")


def _misalignment(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    rigid, soft = columns["change_by_10_mm_N"], columns["change_on_cuff_N"]
    ax.barh(at, np.nan_to_num(rigid), 0.5, color=BLUE, label="rigid")
    ax.plot(soft, at, "D", ms=5, color=GREEN, label="on a soft cuff")
    known = np.concatenate([rigid, soft])
    if (known[np.isfinite(known)] > _FAR_CHANGE).any():
        ax.set_xlim(right=_FAR_CHANGE)
    _say(ax, at[columns["follows_10_mm"] == 0.0], "cannot follow: rigid")
    ax.set(title="10 mm off the centre", xlabel="change of F_s, N: worst direction, median pose")


def _drives(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    share = 100.0 * columns["effort_share"]
    ax.barh(at, np.nan_to_num(share), 0.6, color=BLUE)
    for row in range(len(at)):
        ends = [
            f"{columns[name][row]:.0f}{unit}"
            for name, unit in (("effort_N", " N"), ("effort_Nm", " N m"), ("stroke_mm", " mm"), ("stroke_deg", "°"))
            if np.isfinite(columns[name][row])
        ]
        ax.annotate(
            ", ".join(ends) or "no drives", (np.nan_to_num(share[row]), row), (3, 0), textcoords="offset points",
            va="center", fontsize=_SMALL,
        )  # fmt: skip
    ax.set(title="drives: largest effort and stroke", xlabel="effort, % of its limit", xlim=(0.0, 170.0))
    ax.set_xticks(np.arange(0, 101, 25))


def _masses(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    arm, links = columns["mass_on_arm_kg"], columns["mass_of_links_kg"]
    ax.barh(at, np.nan_to_num(arm), 0.6, color=BLUE, label="on the arm")
    ax.barh(at, np.nan_to_num(links), 0.6, left=np.nan_to_num(arm), color=GREY, label="other links")
    for missing, words in ((np.isnan(arm) & np.isnan(links), "not known"), (np.isnan(links) & ~np.isnan(arm), "+ ?")):
        for row in np.flatnonzero(missing):
            place = np.nan_to_num(arm[row]), row
            ax.annotate(words, place, (3, 0), textcoords="offset points", va="center", fontsize=_SMALL)
    ax.set(title="moving mass", xlabel="kg (?: limbs of unknown mass)")


def _say(ax: Any, rows: FloatArray, words: str) -> None:
    """Words in the place of a bar that has no value."""
    for row in rows:
        ax.annotate(words, (0.0, row), (3, 0), textcoords="offset points", va="center", fontsize=_SMALL, color="0.4")
