"""The ledger: numbers of the thesis, numbers of exo_pin, and the verdict.

Numbers of exo_pin are computed on demand; printed numbers are typed in as printed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..core.records import Record
from ..core.validation import FloatArray, frozen

__all__ = [
    "INPUT_NOT_PRINTED",
    "NOT_REPRODUCIBLE",
    "NO_READING",
    "OTHER_READING",
    "Row",
    "Verdict",
    "compare",
    "condensed",
    "ledger_table",
]

Verdict = Literal[
    "reproduced", "misprint, corrected", "reproduced under another reading", "input not printed", "not reproducible"
]
NOT_REPRODUCIBLE: Verdict = "not reproducible"
OTHER_READING: Verdict = "reproduced under another reading"
INPUT_NOT_PRINTED: Verdict = "input not printed"
#: Ends the note of a row that :mod:`.reading_searches` has searched in vain.
NO_READING = "; no other reading was found (exo-pin thesis --readings)"


@dataclass(frozen=True, eq=False)
class Row(Record):
    """One published result.

    Attributes
    ----------
    source : str
        Table, equation or section of the thesis.
    quantity : str
        What it is.
    unit : str
        Of both numbers.
    printed, computed : ndarray
        Same shape.
    verdict : str
        "reproduced": equal to within the rounding of the print. "misprint, corrected": not so, but equal once a
        named slip of the print is mended. "reproduced under another reading": it follows from the printed data when
        they are read in another way than the text says; ``computed`` is what the text says. "input not printed": it
        depends on data that the thesis does not print, so nothing is said for or against it. "not reproducible": no
        reading of the print that was tried gives it.
    note : str
        What was mended, or why it cannot be.
    digits : int
        Decimals to show.
    reading : str
        Name of the other reading, if it is that which reproduces the print.
    """

    source: str
    quantity: str
    unit: str
    printed: FloatArray
    computed: FloatArray
    verdict: Verdict
    note: str = ""
    digits: int = 4
    reading: str = ""


def compare(
    source: str,
    quantity: str,
    unit: str,
    printed: ArrayLike,
    computed: ArrayLike,
    rounding: float,
    mended: ArrayLike | None = None,
    note: str = "",
    digits: int = 4,
    reading: tuple[str, ArrayLike] | None = None,
    verdict: Verdict | None = None,
) -> Row:
    """Make a row, with the verdict drawn from the numbers.

    Parameters
    ----------
    source, quantity, unit, note : str
        As in :class:`Row`.
    printed, computed : array_like
        The two results, same shape.
    rounding : float
        Largest difference that the rounding of the print, and of the printed inputs, explains.
    mended : array_like, optional
        The print with its slip put right.
    digits : int
        Decimals to show.
    reading : (str, array_like), optional
        Name and result of another reading of the text.
    verdict : str, optional
        That of a row whose two numbers do not tell it.

    Returns
    -------
    Row
        "reproduced" if ``printed`` agrees, "misprint, corrected" if only ``mended`` does, "reproduced under another
        reading" if only the result of ``reading`` is what is printed, else "not reproducible".
    """
    shown, own = (frozen(np.atleast_1d(np.array(value, dtype=float))) for value in (printed, computed))

    def agree(one: ArrayLike, other: ArrayLike) -> bool:
        return bool(np.abs(np.atleast_1d(one) - np.atleast_1d(other)).max() <= rounding)

    name = ""
    if verdict is None:
        if agree(shown, own):
            verdict = "reproduced"
        elif mended is not None and agree(mended, own):
            verdict = "misprint, corrected"
        elif reading is not None and agree(shown, reading[1]):
            verdict, name = OTHER_READING, reading[0]
    return Row(source, quantity, unit, shown, own, verdict or NOT_REPRODUCIBLE, note, digits, name)


def condensed(rows: Iterable[Row], most: int = 4) -> str:
    """Lay the ledger out as a Markdown table with one line for a source of many values, and matrices summed up.

    Parameters
    ----------
    rows : iterable of Row
        The rows.
    most : int
        A source with more rows of one verdict than this is summarised by their number.
    """
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.source, row.verdict), []).append(row)
    lines = list(_HEAD)
    for (source, verdict), group in groups.items():
        if len(group) <= most:
            lines += [_line(row, notes=False) if row.printed.size <= _WIDEST else _short(row) for row in group]
            continue
        width = _width(group) if verdict == "reproduced" else ""
        lines.append(_cells([source, f"{len(group)} values", "", width, verdict]))
    return "\n".join(lines)


def _short(row: Row) -> str:
    """A line for a row of many numbers."""
    return _cells([row.source, _quantity(row), f"{row.printed.size} numbers", _width([row]), _verdict(row)])


def _quantity(row: Row) -> str:
    return f"{row.quantity}, {row.unit}" if row.unit else row.quantity


def _verdict(row: Row) -> str:
    return f"{row.verdict}: {row.reading}" if row.reading else row.verdict


def _width(group: list[Row]) -> str:
    """How far what is computed is from what is printed, at most, and how large that is."""
    gaps = np.concatenate([np.abs(row.printed - row.computed).ravel() for row in group])
    size = max(float(np.abs(row.printed).max()) for row in group)
    word = "within" if group[0].verdict == "reproduced" else "off by up to"
    return f"{word} {np.nanmax(gaps):.2g} of up to {size:.3g}"


def ledger_table(rows: Iterable[Row], notes: bool = True) -> str:
    """Lay the whole ledger out as a Markdown table.

    Parameters
    ----------
    rows : iterable of Row
        The rows.
    notes : bool
        Whether to show the column of notes.
    """
    head = [line + end for line, end in zip(_HEAD, (" note |", " --- |"), strict=True)] if notes else list(_HEAD)
    return "\n".join(head + [_line(row, notes) for row in rows])


#: More numbers than these in a row are summed up in the condensed table.
_WIDEST = 3
_HEAD = ("| source | quantity | thesis says | exo_pin computes | verdict |", "| --- | --- | --- | --- | --- |")


def _line(row: Row, notes: bool) -> str:
    def number(value: float) -> str:
        if not np.isfinite(value):
            return "-"
        # A small number that decimals would hide; rounding noise about zero stays hidden.
        hidden = 1e-9 < abs(value) < 0.5 * 10.0**-row.digits
        return f"{value:.4g}" if hidden else f"{round(value, row.digits) + 0.0:.{row.digits}f}"

    def numbers(values: FloatArray) -> str:
        return ", ".join(number(value) for value in values.ravel())

    cells = [row.source, _quantity(row), numbers(row.printed), numbers(row.computed), _verdict(row)]
    return _cells(cells + [row.note] * notes)


def _cells(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
