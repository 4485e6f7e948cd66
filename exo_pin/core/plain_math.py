"""The module ``math`` with NumPy's rules for errors: NaN and infinity instead of exceptions.

Compiled code follows these rules (``error_model="numpy"``); uncompiled kernels get this module in place of ``math``.
Every function returns a NumPy number, so that a division by zero afterwards gives infinity or NaN as well.
"""

from __future__ import annotations

import math

import numpy as np

pi, inf, nan = np.float64(math.pi), np.float64(math.inf), np.float64(math.nan)

#: These raise no exceptions.
isfinite, isinf, isnan = math.isfinite, math.isinf, math.isnan
#: NumPy's own functions follow the rules already; they take twice as long as the ones below.
asin, exp, floor, log, tan = np.arcsin, np.exp, np.floor, np.log, np.tan


def sqrt(x: float) -> np.float64:
    """Square root; NaN for a negative number."""
    return np.float64(math.sqrt(x)) if x >= 0.0 else nan


def sin(x: float) -> np.float64:
    """Sine; NaN for an infinite angle."""
    return np.float64(math.sin(x)) if isfinite(x) else nan


def cos(x: float) -> np.float64:
    """Cosine; NaN for an infinite angle."""
    return np.float64(math.cos(x)) if isfinite(x) else nan


def acos(x: float) -> np.float64:
    """Angle of a cosine, rad; NaN outside of [-1, 1]."""
    return np.float64(math.acos(x)) if -1.0 <= x <= 1.0 else nan


def atan(x: float) -> np.float64:
    """Angle of a tangent, rad."""
    return np.float64(math.atan(x))


def atan2(y: float, x: float) -> np.float64:
    """Angle of the point (x, y), rad."""
    return np.float64(math.atan2(y, x))


def hypot(x: float, y: float) -> np.float64:
    """Length of (x, y)."""
    return np.float64(math.hypot(x, y))


def copysign(x: float, y: float) -> np.float64:
    """The size of x with the sign of y."""
    return np.float64(math.copysign(x, y))
