"""Numbers of a report for reading: three digits, and a dash for what is not known."""

from __future__ import annotations

import math
from collections.abc import Iterable


def shown(value: float) -> str:
    """A number with three significant digits, without exponent."""
    if not math.isfinite(value):
        return "–"
    if abs(value) < 5e-4:
        return "0"
    rounded = float(f"{value:.3g}")
    return f"{rounded:.{max(0, 2 - math.floor(math.log10(abs(rounded))))}f}"


def ends(low: float, high: float) -> str:
    """Two ends of a range."""
    return "–" if not (math.isfinite(low) or math.isfinite(high)) else f"{shown(low)} to {shown(high)}"


def worst(values: Iterable[float]) -> float:
    """The largest of those that are known, else NaN."""
    return max((value for value in values if math.isfinite(value)), default=math.nan)
