"""How far along a path: s from 0 to 1 over the share of the time, with its first two derivatives.

* ``"constant_speed"``: s = τ with τ = t/T. The speed jumps at both ends, so that no real arm can follow it there.
* ``"minimum_jerk"``: s = 10 τ³ - 15 τ⁴ + 6 τ⁵, which has the least ∫ (d³s/dt³)² dt of all that start and end at rest;
  the peak speed is 15/8 of the mean speed.

Thesis Section 5.4.1 for constant speed; T. Flash, N. Hogan, J. Neurosci. 5 (1985) 1688 for minimum jerk.
"""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray

#: Names of the laws.
TIME_LAWS = ("constant_speed", "minimum_jerk")


def progress(law: str, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """S, ds/dτ and d²s/dτ², shape (N,) each, at shares τ of the time from 0 to 1, shape (N,), by a name of the laws."""
    if law == "constant_speed":
        return x.copy(), np.ones_like(x), np.zeros_like(x)
    s = x**3 * (10.0 + x * (6.0 * x - 15.0))
    rate = 30.0 * x**2 * (1.0 - x) ** 2
    return s, rate, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
