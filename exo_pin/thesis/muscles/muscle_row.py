"""A published number and the computed one."""

from __future__ import annotations

from dataclasses import dataclass

from ..rows import Verdict

__all__ = ["LedgerRow", "Verdict", "within"]


@dataclass(frozen=True)
class LedgerRow:
    """One published number.

    Attributes
    ----------
    source : str
        Table, equation or section.
    quantity : str
        What it is, with its unit.
    printed : float or None
        As printed.
    computed : float or None
        As computed here; None if the source lacks what is needed.
    verdict : str
        As in :class:`exo_pin.thesis.Row`.
    note : str
        Tolerance, correction or reason.
    """

    source: str
    quantity: str
    printed: float | None
    computed: float | None
    verdict: Verdict
    note: str = ""


def within(printed: float, computed: float, tolerance: float) -> Verdict:
    """Verdict "reproduced" if the two differ by no more than ``tolerance``, else "not reproducible"."""
    return "reproduced" if abs(printed - computed) <= tolerance + 1e-12 else "not reproducible"
