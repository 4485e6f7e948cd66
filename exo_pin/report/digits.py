"""Numbers of a report for reading: three digits, and a dash for what is not known."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike


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


def worst(values: ArrayLike) -> float:
    """The largest of those that are known, else NaN."""
    given = np.asarray(values, dtype=float)
    known = given[np.isfinite(given)]
    return float(known.max()) if known.size else math.nan
