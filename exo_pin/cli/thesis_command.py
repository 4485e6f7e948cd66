"""``exo-pin thesis``: the published numbers recomputed."""

from __future__ import annotations

import argparse
import json
from typing import Any

from ..core.results import plain
from ..core.tables import aligned
from ..thesis import Row, condensed, ledger, ledger_table
from ..thesis.all_rows import Section, printed_index, sections_named, summary
from . import deliver

#: Texts of a row.
_TEXTS = ("source", "quantity", "unit", "verdict", "reading", "note")


def run_thesis(options: argparse.Namespace) -> int:
    """Answer ``exo-pin thesis`` and return its exit status."""
    sections = printed_index()
    if options.section is not None:
        sections = sections_named(options.section, sections)
    everything = ledger()
    chosen = {id(row) for section in sections for entry in section.entries for row in entry.select(everything)}
    rows = [row for row in everything if id(row) in chosen]
    parts = [
        "\n".join(aligned(summary(sections, rows), words=1)),
        *([ledger_table(rows) if options.all else condensed(rows)] if rows else []),
    ]
    if options.reasons or options.section is not None:
        parts.append(_reasons(sections))
    else:
        parts.append("--section LABEL shows one section, --reasons the numbers that have no row")
    deliver(
        options,
        "\n\n".join(part for part in parts if part),
        json=lambda: json.dumps(plain(_as_data(sections, rows)), indent=2, ensure_ascii=False),
        columns=lambda: {name: [getattr(row, name) for row in rows] for name in _TEXTS},
    )
    return 0


def _reasons(sections: list[Section]) -> str:
    lines = [
        f"{section.label}: {entry.about}: {entry.printed or f'{entry.cells} numbers'}: {entry.reason}"
        for section in sections
        for entry in section.entries
        if entry.reason
    ]
    return "\n".join(["Numbers without a row, and why:", *lines]) if lines else ""


def _as_data(sections: list[Section], rows: list[Row]) -> dict[str, Any]:
    """Every row, and every number without one."""
    names = ("about", "printed", "count", "reason")
    return {
        "rows": [{name: getattr(row, name) for name in (*_TEXTS, "printed", "computed")} for row in rows],
        "without_row": [
            {"section": section.label, **{name: getattr(entry, name) for name in names}}
            for section in sections
            for entry in section.entries
            if entry.reason
        ],
    }
