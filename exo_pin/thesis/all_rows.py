"""The whole ledger, in the order of the thesis."""

from __future__ import annotations

from . import appendix_c, appendix_d, chapter_4, muscle_ledger, prototype, scenario_one
from .printed_index import printed_index
from .rows import Row


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
    found = [
        *muscle_ledger.rows(),
        *chapter_4.rows(),
        *scenario_one.rows(),
        *prototype.rows(),
        *appendix_c.rows(),
        *appendix_d.rows(),
    ]
    entries = [entry for section in printed_index() for entry in section.entries]
    place = {id(row): k for k, entry in enumerate(entries) for row in entry.select(found)}
    return sorted(found, key=lambda row: place.get(id(row), len(entries)))
