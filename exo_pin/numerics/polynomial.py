"""Real roots of a polynomial on [-1, 1] without eigenvalues, compiled.

Between two neighbouring roots of p' a polynomial p is monotonic, so it has at most one root there, where its
sign changes. Starting from the derivative that is linear, the roots of each derivative bracket those of
the one before. That costs a few hundred multiplications where a companion matrix costs an eigenvalue problem, works in
real numbers throughout, and gives the extrema too, at which a double root touches zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiled import kernel

#: Largest degree that is solved.
MAX_DEGREE = 8
#: Roots are searched a little beyond ±1, so that rounding cannot lose one on the border of two charts.
HALF_WIDTH = 1.0 + 1e-6

#: Accuracy of the roots.
_ROOT = 1e-15
#: Accuracy of the roots of derivatives, which only bracket others: off by δ, an extremum's value is off by δ².
_FENCE = 1e-8


@kernel
def _value(p: Any, degree: int, t: float) -> float:
    """Horner."""
    total = p[degree]
    for k in range(degree - 1, -1, -1):
        total = total * t + p[k]
    return total


@kernel
def _bracketed(p: Any, slope: Any, degree: int, low: float, high: float, at_low: float, exact: float) -> float:
    """The root, to ``exact``, between ``low`` and ``high``, where p changes sign."""
    t = 0.5 * (low + high)
    last = np.inf
    for _ in range(200):
        value = _value(p, degree, t)
        if value == 0.0:
            return t
        if (value > 0.0) == (at_low > 0.0):
            low = t
        else:
            high = t
        rate = _value(slope, degree - 1, t)
        step = value / rate if rate != 0.0 else np.inf
        # Newton's step, or half of the bracket where that leaves it or does not halve the step before: Newton's method
        # can alternate between two points on either side of the root for ever.
        following = t - step
        if abs(step) <= exact:
            return min(max(following, low), high)
        if not low < following < high or abs(step) > 0.5 * last:
            following = 0.5 * (low + high)
        last = abs(following - t)
        if last <= exact:
            return following
        t = following
    return t


@kernel
def roots_and_touches(p: Any, degree: int, touch: float, out: Any) -> int:
    """Write the real roots of p on [-1, 1], and the extrema where |p| <= touch, into ``out``; return their number.

    Parameters
    ----------
    p : ndarray
        Coefficients, p[k] of t^k, k <= degree <= :data:`MAX_DEGREE`.
    degree : int
        1 or more; leading coefficients may be zero.
    touch : float
        Extrema no farther than this from zero are written too: rounding may have lifted a double root.
    out : ndarray
        Shape (2 * MAX_DEGREE,), written.
    """
    derivatives = np.empty((len(p), len(p)))
    for k in range(degree + 1):
        derivatives[degree, k] = p[k]
    # Row m holds the derivative of degree m, scaled, which changes no root.
    for m in range(degree, 1, -1):
        for k in range(m):
            derivatives[m - 1, k] = derivatives[m, k + 1] * (k + 1) / m
    fences, found = np.empty_like(out), np.empty_like(out)
    count = 0
    for m in range(1, degree + 1):
        fences[0] = -HALF_WIDTH
        for k in range(count):
            fences[k + 1] = found[k]
        fences[count + 1] = HALF_WIDTH
        pieces = count + 1
        count = 0
        exact = _ROOT if m == degree else _FENCE
        current = derivatives[m]
        slope = derivatives[m - 1] if m > 1 else derivatives[1, 1:]
        at_low = _value(current, m, fences[0])
        for k in range(pieces):
            at_high = _value(current, m, fences[k + 1])
            if at_low == 0.0:
                found[count] = fences[k]
                count += 1
            elif at_high != 0.0 and (at_low > 0.0) != (at_high > 0.0):
                found[count] = _bracketed(current, slope, m, fences[k], fences[k + 1], at_low, exact)
                count += 1
            at_low = at_high
    written = 0
    for k in range(count):
        out[written] = found[k]
        written += 1
    for k in range(1, pieces):
        if abs(_value(derivatives[degree], degree, fences[k])) <= touch:
            out[written] = fences[k]
            written += 1
    return written
