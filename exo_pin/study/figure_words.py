"""Columns of a study in words: figures, parameters with their units, and what tells a row from the others."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput
from ..design.parameters.names import parameter

#: Columns of :func:`.evaluate`.
FIGURES = ("peak_F_s_N", "p95_F_s_N", "median_F_s_N", "can_hold", "holdable", "least_margin", "one_side", "reach")
#: Columns of the force in the joint with the wearer's own muscles.
JOINT_FIGURES = ("contact_N", "peak_contact_N", "contact_without_N", "relief")
#: A column of one component of an array.
_COMPONENT = re.compile(r"(.*?)(_\d+)?")
#: Figures in words, and which way they are better.
_WORDS = {
    "contact_N": ("force in the joint with muscles, median, N", "less"),
    "peak_contact_N": ("largest force in the joint with muscles, N", "less"),
    "contact_without_N": ("force in the joint without the device, median, N", ""),
    "relief": ("relief of the joint by the device, %", "more"),
    "common_peak_F_s_N": ("peak of |F_s| over the poses that all hold, N", "less"),
    "peak_F_s_N": ("peak of the shoulder force |F_s|, N", "less"),
    "p95_F_s_N": ("95th percentile of the shoulder force |F_s|, N", "less"),
    "median_F_s_N": ("median of the shoulder force |F_s|, N", "less"),
    "can_hold": ("poses that are known to be held, %", "more"),
    "holdable": ("poses held, as far as limits are known, %", "more"),
    "least_margin": ("least distance from a singular pose", "more"),
    "one_side": ("poses on one side of the singular ones, %", "more"),
    "reach": ("poses within all strokes, %", "more"),
}
#: Units at the end of a column's name, as they are written.
_UNITS = {"mm": "mm", "m": "m", "deg": "°", "rad": "rad", "N": "N", "kg": "kg"}
#: Most values that name a row, and letters of a value that is a word.
_MOST_VALUES, _LONGEST = 4, 30


def with_unit(column: str) -> str:
    """A column's name with the unit of its parameter, if it has one that the name lacks."""
    name, component = _COMPONENT.fullmatch(column).groups(default="")  # type: ignore[union-attr]
    try:
        full = parameter(name).full_name
    except InvalidInput:
        return column
    return column if full == name else f"{name}{component}{full.removeprefix(name)}"


def column_words(name: str) -> str:
    """A column of a study as the label of an axis: "cuff height, mm"."""
    return _WORDS[name][0] if name in _WORDS else ", ".join(filter(None, _parted(name)))


def better(name: str) -> str:
    """Whether "less" or "more" of a figure is better, if either is."""
    return _WORDS.get(name, ("", ""))[1]


def drawn_values(columns: Mapping[str, NDArray[Any]], name: str) -> NDArray[Any]:
    """Values of a column in the unit of :func:`column_words`: shares of poses in percent."""
    values = np.asarray(columns[name])
    return 100.0 * values if column_words(name).endswith(", %") else values


def varied(columns: Mapping[str, NDArray[Any]]) -> list[str]:
    """Columns before the figures that are not the same in every row: what was varied."""
    found = []
    for name in columns:
        if name in (*JOINT_FIGURES, *FIGURES):
            break
        if len(np.unique(columns[name])) > 1:
            found.append(name)
    return found


def row_words(columns: Mapping[str, NDArray[Any]], row: int) -> str:
    """What tells a row from the others: its design, else the values that were varied, else its number.

    "cuff height 180 mm".
    """
    if "design" in columns:
        return str(columns["design"][row])
    names = varied(columns)
    values = [columns[name][row] for name in names]
    blank = any(value == "" or value != value or (isinstance(value, str) and len(value) > _LONGEST) for value in values)
    if blank or not 0 < len(names) <= _MOST_VALUES:
        return f"row {row + 1}"
    return ", ".join(value_words(name, value) for name, value in zip(names, values, strict=True))


def value_words(name: str, value: Any) -> str:
    """A value of a column: "cuff height 180 mm"."""
    words, unit = _parted(name)
    text = value if isinstance(value, str) else f"{value:.4g}"
    return f"{words} {text}{unit}" if unit == "°" else f"{words} {text} {unit}".rstrip()


def _parted(name: str) -> tuple[str, str]:
    """A column in words, and its unit: "cuff height", "mm"."""
    full = with_unit(name)
    stem, _, unit = full.rpartition("_")
    if not stem or unit not in _UNITS:
        return full.replace("_", " "), ""
    # Symbols of dimensions keep their index: r_A, alpha_A[2].
    words = stem if re.match(r"[a-z]+_[A-Z]\b|[A-Z]\[", stem) else stem.replace("_", " ")
    return words.replace("].", "] "), _UNITS[unit]
