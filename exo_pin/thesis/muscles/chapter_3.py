"""Chapter 3 and Appendices A and B: the pneumatic muscle."""

from __future__ import annotations

import numpy as np

from ..rows import Row
from . import muscle_ledger as ledger

__all__ = ["rows"]


def rows() -> list[Row]:
    """Rows of the ledger."""
    return [
        Row(
            row.source,
            row.quantity,
            "",
            np.array([np.nan if row.printed is None else row.printed]),
            np.array([np.nan if row.computed is None else row.computed]),
            row.verdict,
            row.note,
        )
        for row in ledger.rows()
    ]
