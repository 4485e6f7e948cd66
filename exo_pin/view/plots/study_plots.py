"""Figure of a study: designs over one parameter or two, or beside each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.tables import percent
from ...core.validation import FloatArray
from ...study.figure_words import better as better_of
from ...study.figure_words import column_words, drawn_values, row_words, value_words, varied
from ..colours import BLACK, BLUE, GREEN, GREY, ORANGE, RED, SKY
from .plot_style import LINES, WIDEST, figure_title, legend_below, line, name_rows, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...study import StudyTable


#: Of a label that stands in the place of a bar or behind its end, points.
_SMALL = 8.5
#: Share of an axis that is left free for the numbers at the ends of its bars.
_ROOM = 1.22
#: Most bars of a study: more would be read by nobody.
_MOST_BARS = 40
#: Upper end of an axis of shares, %, with room for the marks at 100 %.
_WHOLE = 103.0
#: |F_s| and changes of it leave the picture beyond so many times the largest median, and 10 mm beyond so many N.
_FAR, _FAR_CHANGE = 8.0, 100.0


def ranking_figure(table: StudyTable) -> Figure:
    """The figures that rank the designs of a comparison, the best on top; see :meth:`.StudyTable.plot`."""
    rows, names = in_rank_order(table)
    known, far, peak = (
        np.asarray(table[name], dtype=float)[rows] for name in ("can_hold", "holdable", "common_peak_F_s_N")
    )
    at = np.arange(float(len(rows)))
    joint = "contact_N" in table
    figure, (*first, held, force) = new_figure(WIDEST, 1.9 + 0.42 * len(rows), ncols=2 + joint, sharey=True)
    for ax in first:
        _joint(ax, at, *(np.asarray(table[name], dtype=float)[rows] for name in ("contact_N", "contact_without_N")))
    held.barh(at, 100.0 * known, 0.62, color=BLUE, label="known to be held")
    if (far > known).any():
        held.barh(at, 100.0 * (far - known), 0.62, left=100.0 * known, color=SKY, label="if unknown limits allow it")
        legend_below(held)
    for row, share in enumerate(far):
        words = percent(share) if share > 0.0 else "none"
        _at_end(held, 100.0 * share, row, words)
    held.set(
        title="poses that are held" if joint else "first: poses that are held",
        xlabel="% of the poses (more is better)",
        xlim=(0.0, 100.0 * _ROOM),
    )
    held.set_xticks(np.arange(0, 101, 25))
    alone = far > 0.0
    force.barh(at, np.where(alone, np.nan_to_num(peak), 0.0), 0.62, color=BLUE)
    force.barh(at, np.where(alone, 0.0, np.nan_to_num(peak)), 0.62, color="white", edgecolor=BLUE, hatch="////")
    for row, value in enumerate(peak):
        words = "no pose in common" if alone[row] else "holds no pose"
        if np.isfinite(value):
            words = f"{value:.1f} N" if alone[row] else f"{value:.1f} N, its wearer makes the rest"
        _at_end(force, float(np.nan_to_num(value)), row, words)
    top = np.nanmax(peak) if np.isfinite(peak).any() else 1.0
    force.set(
        title="force without muscles" if joint else "between equals: force on the shoulder",
        xlim=(0.0, _ROOM * float(top)),
    )
    force.set_xlabel("common peak |F_s|, N" if joint else "common peak |F_s|, N (less is better)")
    for ax in (*first, held, force):
        tidy(ax, "x")
        ax.title.set_fontsize(10.5)
    name_rows((*first, held)[0], names)
    figure_title(figure, *table.heading)
    return figure


def _joint(ax: Any, at: FloatArray, force: FloatArray, bare: FloatArray) -> None:
    """The force in the joint with the device and without it, which leads where it is known."""
    ax.barh(at, np.nan_to_num(force), 0.62, color=BLUE)
    ax.plot(bare, at, "D", ms=5, markerfacecolor="none", color=BLACK, label="without the device")
    for row, value in enumerate(force):
        _at_end(ax, float(np.nan_to_num(value)), row, f"{value:.0f} N" if np.isfinite(value) else "not known")
    top = max((value for value in (*force, *bare) if np.isfinite(value)), default=1.0)
    ax.set(title="in the joint, with muscles", xlabel="median, N (less is better)", xlim=(0.0, _ROOM * float(top)))
    if np.isfinite(bare).any():
        legend_below(ax)


def in_rank_order(table: StudyTable) -> tuple[NDArray[np.intp], list[str]]:
    """Rows of a table from the best, with the labels of the bars; as they are where nothing ranks them."""
    names = [row_words(table, row) for row in range(table.row_count)]
    ranks = table.ranks if "design" in table else ()
    if len(ranks) < 2:
        return np.arange(len(names)), names
    rows = np.array(table.ranking)
    return rows, [f"{ranks[row]}{'=' if ranks.count(ranks[row]) > 1 else '.'} {names[row]}" for row in rows]


def comparison_figure(table: StudyTable) -> Figure:
    """Six figures of every device of a detailed comparison, the best on top; see :meth:`.StudyTable.plot`."""
    at = np.arange(float(table.row_count))
    figure, axes = new_figure(WIDEST, 4.2 + 0.75 * table.row_count, nrows=3, ncols=2, sharey=True)
    rows, names = in_rank_order(table)
    columns = {name: np.asarray(table[name], dtype=float)[rows] for name in table if table[name].dtype.kind in "fiu"}
    panels = (_poses, _shoulder_force, _contact, _misalignment, _drives, _masses)
    for ax, panel in zip(axes.flat, panels, strict=True):
        panel(ax, at, columns)
        tidy(ax, "x")
        ax.set_xlim(left=0.0)
        legend_below(ax)
    name_rows(axes[0, 0], names)
    figure_title(figure, *table.heading[:1])
    return figure


def _at_end(ax: Any, value: float, row: float, words: str, colour: str = BLACK) -> None:
    """Words behind the end of a bar, or in its place."""
    ax.annotate(words, (value, row), (3, 0), textcoords="offset points", va="center", fontsize=_SMALL, color=colour)


def _poses(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    share = {name: 100.0 * columns[name] for name in ("holdable", "held_after_failure", "clear", "singular")}
    ax.barh(at - 0.18, share["holdable"], 0.34, color=BLUE, label="held")
    if "not_evaluated" in columns and columns["not_evaluated"].any():
        rest = 100.0 * columns["not_evaluated"]
        ax.barh(at - 0.18, rest, 0.34, left=share["holdable"], color=GREY, label="not evaluated: no data of a spring")
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
        _at_end(ax, np.nan_to_num(share[row]), row, ", ".join(ends) or "no drives")
    ax.set(title="drives: largest effort and stroke", xlabel="effort, % of its limit", xlim=(0.0, 170.0))
    ax.set_xticks(np.arange(0, 101, 25))


def _masses(ax: Any, at: FloatArray, columns: dict[str, FloatArray]) -> None:
    arm, links = columns["mass_on_arm_kg"], columns["mass_of_links_kg"]
    ax.barh(at, np.nan_to_num(arm), 0.6, color=BLUE, label="on the arm")
    ax.barh(at, np.nan_to_num(links), 0.6, left=np.nan_to_num(arm), color=GREY, label="other links")
    for missing, words in ((np.isnan(arm) & np.isnan(links), "not known"), (np.isnan(links) & ~np.isnan(arm), "+ ?")):
        for row in np.flatnonzero(missing).tolist():
            _at_end(ax, np.nan_to_num(arm[row]), row, words)
    ax.set(title="moving mass", xlabel="kg (?: limbs of unknown mass)")


def _say(ax: Any, rows: FloatArray, words: str) -> None:
    """Words in the place of a bar that has no value."""
    for row in rows:
        _at_end(ax, 0.0, row, words, "0.4")


@checked
def study_figure(table: StudyTable, figure: str = "peak_F_s_N") -> Figure:
    """Figure of a study; see :meth:`exo_pin.study.StudyTable.plot`."""
    if np.asarray(table[figure]).dtype.kind not in "fiu":
        raise InvalidInput(f"expected a column of numbers, got {figure!r}")
    values = drawn_values(table, figure).astype(float)
    # Designs with names stand beside each other, whatever else is in the table.
    changed = [] if "design" in table else sorted(varied(table), key=lambda name: table[name].dtype.kind not in "fiu")
    bars = not 0 < len(changed) <= 2 or table[changed[0]].dtype.kind not in "fiu"
    canvas, axes = new_figure(6.8, max(4.2, 1.6 + 0.22 * min(table.row_count, _MOST_BARS)) if bars else 4.2)
    if table.verdict:
        figure_title(canvas, table.verdict, points=10)
    tidy(axes)
    label, lost, reasons = column_words(figure), ~np.isfinite(values), _reasons(table)
    if bars:
        rows, names = in_rank_order(table)
        if len(rows) > _MOST_BARS:
            rows = np.array(table.ranking or rows)[:_MOST_BARS]
            names = [row_words(table, row) for row in rows]
            best = "the best " if table.ranking else ""
            axes.set_title(f"{best}{len(rows)} of {table.row_count} designs", fontsize=9, loc="right", color="0.3")
        better = better_of(figure) if len(table.ranking) > 1 else ""
        axes.barh(np.arange(len(names)), values[rows], color=BLUE, height=0.65)
        name_rows(axes, names)
        axes.set(xlabel=label + (f" ({better} is better)" if better else ""), ylim=(len(names) - 0.4, -0.6))
        axes.grid(False, axis="y")
        for place in np.flatnonzero(lost[rows]):
            look = {"xycoords": ("axes fraction", "data"), "va": "center", "fontsize": 9}
            axes.annotate(reasons[rows[place]], (0.01, place), **look)
        return canvas
    if len(changed) == 2 and len(np.unique(table[changed[1]])) > len(LINES) and table[changed[1]].dtype.kind in "fiu":
        # More lines would look alike: the other way round there are fewer.
        changed.sort(key=lambda name: -len(np.unique(table[name])))
    first, *second = changed
    groups: Any = np.unique(table[second[0]]) if second else [None]
    for k, group in enumerate(groups):
        rows = np.flatnonzero(table[second[0]] == group) if second else np.arange(table.row_count)
        rows = rows[np.argsort(table[first][rows])]
        name = value_words(second[0], group) if second else None
        axes.plot(table[first][rows], values[rows], **line(k), linewidth=1.8, marker="o", label=name)
    axes.set(xlabel=column_words(first), ylabel=label)
    if label.endswith(", %"):
        axes.set_ylim(min(0.0, np.nanmin(values, initial=0.0)), _WHOLE)
    if lost.any():
        foot: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "clip_on": False, "linestyle": ""}
        axes.plot(table[first][lost], np.full(lost.sum(), 0.02), "x", color=BLACK, **foot)
        found = " or ".join(dict.fromkeys(reasons[row] for row in np.flatnonzero(lost)))
        axes.set_title(f"crosses: {found}", fontsize=9, loc="right", color="0.3")
    if lost.all():
        axes.set_yticks([])
    if second:
        legend_below(axes, 3)
    return canvas


def _reasons(table: StudyTable) -> list[str]:
    """Why each row would have no figure."""
    none = np.zeros(table.row_count)
    errors, held = (dict(table).get(name, none) for name in ("error", "holdable"))
    return [
        "no design" if error else "not known" if share > 0.0 else "no pose is held"
        for error, share in zip(errors, held, strict=True)
    ]
