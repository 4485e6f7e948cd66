"""The whole ledger in the order of the thesis: its rows, the index of all printed numbers, and the tables of them."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import UnknownName
from ..core.errors.checked import checked
from ..core.validation import FloatArray
from . import chapter_4, muscle_ledger, prototype
from .rows import VERDICTS, Row

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:,\d{3})*(?:\.\d+)?(?:e-?\d+)?")


@dataclass(frozen=True)
class IndexEntry:
    """Printed numbers that belong together.

    Attributes
    ----------
    about : str
        What they are.
    printed : str
        The numbers as printed, with their units; empty for a long table and for formulas that are evaluated.
    cells : int
        How many numbers a long table has; 0 for others.
    rows : tuple of str
        Beginnings of "source: quantity" of the rows on them; empty if there is a reason.
    reason : str
        Why no row has a verdict on them.
    derived : bool
        Whether the rows compare what follows from the numbers (a difference, a norm) instead of the numbers.
    """

    about: str
    printed: str = ""
    cells: int = 0
    rows: tuple[str, ...] = ()
    reason: str = ""
    derived: bool = False

    @property
    def numbers(self) -> list[float]:
        """The numbers of ``printed``."""
        return [float(found.replace(",", "")) for found in _NUMBER.findall(self.printed)]

    @property
    def count(self) -> int:
        """How many numbers it is about."""
        return self.cells or len(self.numbers)

    def select(self, rows: Iterable[Row]) -> list[Row]:
        """Those of the rows that are on these numbers."""
        return [row for row in rows if f"{row.source}: {row.quantity}".startswith(self.rows)] if self.rows else []


@dataclass(frozen=True)
class Section:
    """A section of the thesis with its entries."""

    label: str
    title: str
    entries: tuple[IndexEntry, ...]


def printed_index() -> list[Section]:
    """All sections of the thesis that have a text of their own, in its order."""
    content = tomllib.loads(Path(__file__).with_name("printed_numbers.toml").read_text(encoding="utf-8"))
    reasons = content["reasons"]
    found = []
    for label, section in content["sections"].items():
        entries = []
        for entry in section["numbers"]:
            rows, reason = tuple(entry.pop("rows", ())), entry.pop("reason", "")
            entries.append(IndexEntry(entry.pop("of"), rows=rows, reason=reasons.get(reason, reason), **entry))
        found.append(Section(label, section["title"], tuple(entries)))
    return found


def sections_named(name: str, sections: Sequence[Section]) -> list[Section]:
    """The section of this label and those inside it: "5.1" finds 5.1, 5.1.1 and 5.1.2; "D" finds D.1 and D.2.

    Raises
    ------
    UnknownName
        If there is none; it lists all.
    """
    found = [one for one in sections if one.label == name or one.label.startswith(f"{name}.")]
    if not found:
        raise UnknownName("section", name, [one.label for one in sections], "the thesis")
    return found


def summary(sections: Iterable[Section], rows: Sequence[Row]) -> list[list[str]]:
    """A table by chapters: printed numbers with and without a row, and the verdicts of the rows.

    Returns
    -------
    list of list of str
        A head with the chapters and appendices, and a line for each count.
    """
    kinds = ["printed numbers", "  compared in a row", "  not compared, with a reason", "rows"]
    kinds += [f"  {one}" for one in VERDICTS]
    counts: dict[str, Counter[str]] = {}
    for section in sections:
        count = counts.setdefault(section.label.split(".")[0], Counter())
        for entry in section.entries:
            count[kinds[0]] += entry.count
            count[kinds[2 if entry.reason else 1]] += entry.count
            found = entry.select(rows)
            count["rows"] += len(found)
            count.update(f"  {row.verdict}" for row in found)
    counts["all"] = sum(counts.values(), Counter())
    lines = [[kind, *(str(count[kind] or "-") for count in counts.values())] for kind in kinds]
    return [["chapter", *counts], *lines]


def ledger() -> list[Row]:
    """All rows: what the thesis prints, what exo_pin computes, and the verdict, in the order of the thesis.

    Returns
    -------
    list of Row

    Examples
    --------
    >>> from collections import Counter
    >>> from exo_pin.thesis import ledger
    >>> Counter(row.verdict for row in ledger())["reproduced"]
    233
    """
    found = [row for part in (muscle_ledger, chapter_4, prototype) for row in part.rows()]
    entries = [entry for section in printed_index() for entry in section.entries]
    place = {id(row): k for k, entry in enumerate(entries) for row in entry.select(found)}
    return sorted(found, key=lambda row: place.get(id(row), len(entries)))


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
