"""Rows of the ledger as tables: whole, or with long sources summed up."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..core.errors.checked import checked
from ..core.validation import FloatArray
from .rows import Row


@checked
def condensed(rows: Iterable[Row], most: int = 4) -> str:
    """Lay the ledger out as a Markdown table with one line for a source of many values, and matrices summed up.

    Parameters
    ----------
    rows : iterable of Row
        The rows.
    most : int
        A source with more rows of one verdict than this is summarised by their number.

    Returns
    -------
    str
        Markdown.

    Examples
    --------
    >>> from exo_pin.thesis import compare, condensed
    >>> rows = [compare("Table 1", f"length {i}", "m", 0.3, 0.3, 0.0005) for i in range(9)]
    >>> len(condensed(rows).splitlines())  # a head of two lines, and nine values in one
    3
    """
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        # What "reproduced" rests on differs: such rows are summed up only where they share a note.
        groups.setdefault((row.source, row.verdict, row.note if row.verdict == "reproduced" else ""), []).append(row)
    lines = list(_HEAD)
    for (source, verdict, _), group in groups.items():
        if len(group) <= most:
            lines += [_line(row) if row.printed.size <= _WIDEST else _short(row) for row in group]
            continue
        width = _width(group) if verdict == "reproduced" else ""
        lines.append(_cells([source, f"{len(group)} values", "", width, verdict, _notes(group)]))
    return "\n".join(lines)


@checked
def ledger_table(rows: Iterable[Row]) -> str:
    """Lay the whole ledger out as a Markdown table.

    Parameters
    ----------
    rows : iterable of Row
        The rows.

    Returns
    -------
    str
        Markdown.

    Examples
    --------
    >>> from exo_pin.thesis import compare, ledger_table
    >>> rows = [compare("Table 1", f"length {i}", "m", 0.3, 0.3, 0.0005) for i in range(9)]
    >>> len(ledger_table(rows).splitlines())  # a head of two lines, and all nine
    11
    """
    return "\n".join([*_HEAD, *map(_line, rows)])


#: More numbers than these in a row are summed up in the condensed table.
_WIDEST = 3
_COLUMNS = ["source", "quantity", "thesis says", "exo_pin computes", "verdict", "note"]


def _short(row: Row) -> str:
    """A line for a row of many numbers."""
    return _cells([row.source, _quantity(row), f"{row.printed.size} numbers", _width([row]), _verdict(row), row.note])


def _notes(group: list[Row]) -> str:
    """The note of several rows, or the first of several notes."""
    same = len({row.note for row in group}) == 1
    return group[0].note if same else f"{group[0].note} (of the first; --all has the others)"


def _quantity(row: Row) -> str:
    return f"{row.quantity}, {row.unit}" if row.unit else row.quantity


def _verdict(row: Row) -> str:
    return f"{row.verdict}: {row.reading}" if row.reading else row.verdict


def _width(group: list[Row]) -> str:
    """How far what is computed is from what is printed, at most, and how large that is."""
    gaps = np.concatenate([np.abs(row.printed - row.computed).ravel() for row in group])
    if not np.isfinite(gaps).any():
        return "-"
    size = max(float(np.abs(row.printed).max()) for row in group)
    word = "within" if group[0].verdict == "reproduced" else "off by up to"
    return f"{word} {np.nanmax(gaps):.2g} of up to {size:.3g}"


def _line(row: Row) -> str:
    def number(value: float) -> str:
        if not np.isfinite(value):
            return "-"
        # A small number that decimals would hide; rounding noise about zero stays hidden.
        hidden = 1e-9 < abs(value) < 0.5 * 10.0**-row.digits
        return f"{value:.4g}" if hidden else f"{round(value, row.digits) + 0.0:.{row.digits}f}"

    def numbers(values: FloatArray) -> str:
        return ", ".join(number(value) for value in values.ravel())

    return _cells([row.source, _quantity(row), numbers(row.printed), numbers(row.computed), _verdict(row), row.note])


def _cells(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


_HEAD = (_cells(_COLUMNS), _cells(["---"] * len(_COLUMNS)))
