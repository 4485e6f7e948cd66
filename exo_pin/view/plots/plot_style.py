"""One style for all plots: matplotlib, imported here, and palettes for colour-blind readers and grey prints."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ...core.optional_packages import optional
from ...core.tables import NOTES
from ...core.validation import FloatArray
from ..colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, SKY

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_Cut = Literal["neither", "min", "max", "both"]
#: Most steps of colour, of four decades: smaller forces are next to none.
_MOST_STEPS = 13
#: Width of a figure, inches, at which its print can still be read on a page of 7.7 inches.
WIDEST = 9.0
#: Names of the ends of a scale that are cut: none, the lower one, the upper one, both.
_CUTS: tuple[_Cut, ...] = ("neither", "min", "max", "both")
#: Colour and dashes of the first, second, ... line of a plot: lightness and dashes differ as well as hue.
LINES = (
    (BLUE, "-"),
    (ORANGE, (0, (5, 1.5))),
    (GREEN, (0, (1, 1))),
    (PURPLE, (0, (6, 1.5, 1, 1.5))),
    (SKY, (0, (3, 1))),
    (RED, (0, (8, 2))),
    (BLACK, (0, (2, 2))),
)


def pyplot() -> Any:
    """matplotlib.pyplot.

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    """
    return optional("plot", "matplotlib.pyplot")


def new_figure(width: float, height: float, **grid: Any) -> tuple[Figure, Any]:
    """A figure of a size in inches, and its axes."""
    figure, axes = pyplot().subplots(figsize=(width, height), layout="constrained", **grid)
    return figure, axes


def axes_or_new(ax: Any, width: float, height: float) -> Any:
    """The axes given, or those of a new figure of a size in inches."""
    return new_figure(width, height)[1] if ax is None else ax


#: The blank between a number and its unit, and between a force and its number.
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:N|N m|mm|kg|kPa|%|°)(?![\w]))|(?<=\|F_s\|) (?=\d)")


def wrapped(text: str, width: float, points: float) -> str:
    """Text in lines of about equal length that fit a width in inches, in print of a size in points.

    A number and its unit stay on one line, and |F_s| and its number.
    """
    text = _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", text)
    most = max(int(width * 72.0 / (0.56 * points)), 20)
    fewest = len(textwrap.wrap(text, most))
    lines = (textwrap.wrap(text, length) for length in range(20, most + 1))
    return "\n".join(next(found for found in lines if len(found) == fewest)).replace("\N{NO-BREAK SPACE}", " ")


def figure_title(figure: Any, *paragraphs: str, points: float = 11.0) -> None:
    """A title over a whole figure that stays on it."""
    width = figure.bbox.width / figure.dpi
    figure.suptitle("\n".join(wrapped(text, width, points) for text in paragraphs if text), fontsize=points)


def minded(cautions: Sequence[str]) -> list[str]:
    """Cautions that stand below a title: what was not checked is in the text of an answer."""
    return [f"Caution: {text}" for text in cautions if not text.startswith(NOTES)]


def line(number: int) -> dict[str, Any]:
    """Colour and dashes of the line of a number from 0, as arguments of ``plot``."""
    colour, dashes = LINES[number % len(LINES)]
    return {"color": colour, "linestyle": dashes}


def right_scale(ax: Any, unit: float, label: str) -> None:
    """A second scale on the right, in multiples of a unit of the left one."""
    right = ax.secondary_yaxis("right", functions=(lambda value: value / unit, lambda multiple: multiple * unit))
    right.set_ylabel(label)


def legend_below(ax: Any, columns: int = 2) -> None:
    """A legend of what has a label, under the axes, where it covers neither curves nor numbers."""
    from matplotlib.transforms import ScaledTranslation

    handles, labels = ax.get_legend_handles_labels()
    if not labels:
        return
    # Room for the numbers and the label of the axis, if it has them, in points below it.
    shared = ax.get_subplotspec() is not None and not ax.get_subplotspec().is_last_row()
    room = 6.0 if shared and not ax.get_xlabel() else 38.0
    below = ax.transAxes + ScaledTranslation(0.0, -room / 72.0, ax.figure.dpi_scale_trans)
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "bbox_transform": below}
    ncols = min(columns, len(labels))
    ax.legend(handles, labels, **place, ncols=ncols, fontsize=8.5, columnspacing=1.4, frameon=False)


def capsule_outline(p: FloatArray, q: FloatArray, radius: float) -> FloatArray:
    """Outline of a capsule as seen, shape (2, 48): a radius around the line of two points of shape (2,)."""
    half = float(np.arctan2(*(q - p)[::-1])) + np.linspace(-np.pi / 2, np.pi / 2, 24)
    arc = np.concatenate([half, half + np.pi])
    return np.asarray(np.repeat([q, p], 24, axis=0).T + radius * np.stack([np.cos(arc), np.sin(arc)]))


def legend_mark(label: str, **look: Any) -> Any:
    """An entry of a legend."""
    return pyplot().Line2D([], [], label=label, **look)


def outlined() -> list[Any]:
    """Path effects of dark text that has to be read on dark colours."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.5, foreground="white", alpha=0.85)]


def tidy(ax: Any, grid: str = "both") -> None:
    """The frame of a plot: no line at the top and right, a light grid along "x", "y" or "both"."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(axis=grid, color="0.9", linewidth=0.8)
    ax.set_axisbelow(True)


def name_rows(ax: Any, names: Sequence[str], size: float | None = None) -> None:
    """Names on the left of bars, the first on top."""
    ax.set_yticks(range(len(names)), names, fontsize=size)
    ax.invert_yaxis()


def force_scale(values: FloatArray) -> tuple[Any, _Cut]:
    """Steps of colour over the values, and which of the ends are cut: 1, 2, 5, 10, ... where forces differ much."""
    from matplotlib.colors import BoundaryNorm

    known = values[np.isfinite(values)]
    low, high = np.percentile(known, [0.5, 98.5]) if known.size else np.zeros(2)
    if low > 0.0 and high > 5.0 * float(np.median(known)):
        tens = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
        steps = np.outer(tens, [1.0, 2.0, 5.0]).ravel()
        steps = steps[max(np.searchsorted(steps, low, "right") - 1, 0) : np.searchsorted(steps, high) + 1]
        steps = steps[-_MOST_STEPS:]
    else:
        # A few poses beside a singular one do not stretch the scale.
        usual, most = (np.percentile(known, 95.0), known.max()) if known.size else (0.0, 0.0)
        top = 1.05 * most if most <= 3.0 * usual else 1.5 * usual
        steps = even_steps(float(top) if most > 0.0 else 1.0)
    extend = _CUTS[int((known < steps[0]).any()) + 2 * int((known > steps[-1]).any())]
    return BoundaryNorm(steps, 256, extend=extend), extend


def even_steps(high: float) -> FloatArray:
    """Round values at equal distances from 0 to a positive end or beyond, in at most some ten steps."""
    from matplotlib.ticker import MaxNLocator

    return np.asarray(MaxNLocator(nbins=10, steps=[1.0, 2.0, 2.5, 5.0, 10.0]).tick_values(0.0, high))
