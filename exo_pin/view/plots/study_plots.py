"""Figure of a study: designs over one parameter or two, or beside each other."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray
from ..colours import BLACK, BLUE
from .comparison_plots import in_rank_order
from .plot_style import legend_below, line, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...study import StudyTable

#: Figures of a study in words.
_WORDS = {
    "common_peak_F_s_N": "peak of |F_s| over the poses that all hold, N",
    "peak_F_s_N": "peak of the shoulder force |F_s|, N",
    "p95_F_s_N": "95th percentile of the shoulder force |F_s|, N",
    "median_F_s_N": "median of the shoulder force |F_s|, N",
    "can_hold": "share of the poses that are known to be held",
    "holdable": "share of the poses held, as far as limits are known",
    "pull_only": "share of the poses that pulling limbs hold",
    "least_margin": "least distance from a singular pose",
    "one_side": "share of the poses on one side of the singular ones",
    "reach": "share of the poses within all strokes",
}
#: Units at the end of a column's name, as they are written.
_UNITS = {"mm": "mm", "m": "m", "deg": "°", "N": "N", "kg": "kg"}


#: Which way a figure of a comparison is better.
_BETTER = {
    **dict.fromkeys(("common_peak_F_s_N", "peak_F_s_N", "p95_F_s_N", "median_F_s_N"), "less"),
    **dict.fromkeys(("can_hold", "holdable", "pull_only", "least_margin", "one_side", "reach"), "more"),
}


@checked
def study_figure(table: StudyTable, figure: str = "peak_F_s_N") -> Figure:
    """Figure of a study; see :meth:`exo_pin.study.StudyTable.plot`."""
    values = np.asarray(table[figure])
    if values.dtype.kind not in "fiu":
        raise InvalidInput(f"expected a column of numbers, got {figure!r}")
    # Designs with names stand beside each other, whatever else is in the table.
    varied = [] if "design" in table else _varied(table)
    canvas, axes = new_figure(6.8, 4.2)
    tidy(axes)
    if not varied or len(varied) > 2:
        rows, names = in_rank_order(table) if "design" in table else _numbered(table)
        values, at = values[rows], np.arange(len(names))
        axes.barh(at, values, color=BLUE, height=0.65)
        axes.set_yticks(at, names)
        better = f" ({_BETTER[figure]} is better)" if "rank" in table and figure in _BETTER else ""
        axes.set(xlabel=column_words(figure) + better, ylabel="" if "design" in table else "design, row of the table")
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.grid(False, axis="y")
        _name_gaps(axes, values, np.arange(len(names), dtype=float), upright=True)
        return canvas
    first, *second = varied
    groups: Any = np.unique(table[second[0]]) if second else [None]
    for k, group in enumerate(groups):
        rows = np.flatnonzero(table[second[0]] == group) if second else np.arange(table.row_count)
        rows = rows[np.argsort(table[first][rows])]
        name = f"{column_words(second[0])}: {group:.4g}" if second else None
        axes.plot(table[first][rows], values[rows], **line(k), linewidth=1.8, marker="o", label=name)
    axes.set(xlabel=column_words(first), ylabel=column_words(figure))
    _name_gaps(axes, values, np.asarray(table[first], dtype=float), upright=False)
    if second:
        legend_below(axes, columns=min(len(groups), 3))
    return canvas


def _numbered(table: StudyTable) -> tuple[NDArray[np.intp], list[str]]:
    """Rows of a table as they are, with their numbers."""
    return np.arange(table.row_count), [str(number) for number in range(1, table.row_count + 1)]


def _name_gaps(axes: Any, values: FloatArray, places: FloatArray, upright: bool) -> None:
    """Say where a design has no value: a word for each bar, or crosses at the foot of curves, and one note."""
    lost = ~np.isfinite(values.astype(float))
    if not lost.any():
        return
    if upright:
        for place in places[lost]:
            axes.annotate("no pose is held", (0.01, place), xycoords=("axes fraction", "data"), va="center", fontsize=9)
        return
    foot: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "clip_on": False, "linestyle": ""}
    axes.plot(places[lost], np.full(lost.sum(), 0.02), "x", color=BLACK, **foot)
    axes.set_title("crosses: designs that hold no pose", fontsize=9, loc="right", color="0.3")
    if lost.all():
        axes.set_yticks([])


def column_words(name: str) -> str:
    """A column of a study as the label of an axis: "cuff height, mm"."""
    from ...study.study_table import with_unit

    full = with_unit(name)
    if full in _WORDS:
        return _WORDS[full]
    stem, _, unit = full.rpartition("_")
    if not stem or unit not in _UNITS:
        return full.replace("_", " ")
    # Symbols of dimensions keep their index: r_A, alpha_A[2].
    words = stem if re.match(r"[a-z]+_[A-Z]\b|[A-Z]\[", stem) else stem.replace("_", " ")
    return f"{words.replace('].', '] ')}, {_UNITS[unit]}"


def _varied(table: StudyTable) -> list[str]:
    """Columns of numbers before the figures that are not the same in every row."""
    from ...study.evaluation import FIGURES

    found = []
    for name in table:
        if name in FIGURES:
            break
        column = np.asarray(table[name])
        if column.dtype.kind in "fiu" and len(np.unique(column)) > 1:
            found.append(name)
    return found
