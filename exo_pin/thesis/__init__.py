"""The thesis recomputed, row by row."""

from __future__ import annotations

from . import appendix_d, kinematics, muscles, scenario_one, table_5_4
from .ledger import Row, Verdict, compare, condensed, ledger_table

__all__ = ["Row", "Verdict", "compare", "condensed", "ledger", "ledger_table"]


def ledger() -> list[Row]:
    """All rows: what the thesis prints, what exo_pin computes, and the verdict, in the order of the thesis."""
    return [*muscles.rows(), *kinematics.rows(), *scenario_one.rows(), *table_5_4.rows(), *appendix_d.rows()]
