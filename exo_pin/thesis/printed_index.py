"""The index of all numbers that the thesis prints, section by section, and where each went: to a row, or to a reason.

``printed_numbers.toml`` holds it.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..core.errors import UnknownName
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
        entries = [
            IndexEntry(
                entry.pop("of"),
                rows=tuple(entry.pop("rows", ())),
                reason=reasons.get(entry.get("reason"), entry.get("reason", "")),
                **{key: value for key, value in entry.items() if key != "reason"},
            )
            for entry in section["numbers"]
        ]
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
    kinds = [
        "printed numbers",
        "  compared in a row",
        "  not compared, with a reason",
        "rows",
        *(f"  {one}" for one in VERDICTS),
    ]
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
