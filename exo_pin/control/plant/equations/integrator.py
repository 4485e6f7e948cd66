"""Integration of the plant from one instant to another: Dormand and Prince, order 5(4), on the rotation group.

A Runge-Kutta-Munthe-Kaas method: the orientation is a rotation vector relative to that at the start of each step, and
the step's end is the next one's start. The quaternion is brought to length 1 there, against rounding.

Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Table II.5.2;
H. Munthe-Kaas, High order Runge-Kutta methods on manifolds, Appl. Numer. Math. 29 (1999) 115.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....core.compiled import kernel
from .plant_kernels import moved_quaternion, rates

#: How an integration ended.
DONE, TOO_SMALL, NOT_FINITE = 0, 1, 2
#: Most steps in one call.
_MOST = 200_000
#: Least step, s, and the limits of the change of a step.
_LEAST, _SHRINK, _GROW, _SAFETY = 1e-13, 0.2, 5.0, 0.9

_A = (
    (1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0),
    (44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0),
    (19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0),
    (9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0),
    (35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0),
)
#: Weights of the fifth order less those of the fourth.
_E = (71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0)


@kernel
def _place(q: Any, y: Any) -> None:
    """Turn the quaternion by ξ, which becomes zero."""
    x, yy, z, w = moved_quaternion(q, y)
    size = math.sqrt(x * x + yy * yy + z * z + w * w)
    q[0], q[1], q[2], q[3] = x / size, yy / size, z / size, w / size
    for j in range(3):
        y[j] = 0.0


@kernel(cost=301)
def advance(t: Any, flows: Any, q: Any, y: Any, duration: float, step: float, rtol: float, atol: Any) -> Any:
    """Change ``q`` and ``y`` to what they are ``duration`` seconds later, with constant flows.

    ``step`` is tried first; ``atol``, shape (size,), in the units of the state. Returns how it ended, the steps taken,
    a good next step in s, and the time that is left, s.
    """
    size = len(y)
    k = np.zeros((7, size))
    trial, new = np.zeros(size), np.zeros(size)
    left, taken = duration, 0
    rates(t, flows, q, y, k[0])
    while left > 0.0:
        last = step >= left * (1.0 - 1e-12)
        h = left if last else step
        for stage in range(6):
            for j in range(size):
                total = 0.0
                for m in range(stage + 1):
                    total += _A[stage][m] * k[m, j]
                trial[j] = y[j] + h * total
            rates(t, flows, q, trial, k[stage + 1])
        error = 0.0
        for j in range(size):
            new[j] = trial[j]
            off = 0.0
            for m in range(7):
                off += _E[m] * k[m, j]
            scale = atol[j] + rtol * max(abs(y[j]), abs(new[j]))
            error = max(error, abs(h * off) / scale)
            if not math.isfinite(new[j]):
                error = math.inf
        factor = _GROW
        if error > 0.0:
            factor = min(_GROW, max(_SHRINK, _SAFETY * error ** (-0.2)))
        if error <= 1.0:
            taken += 1
            left = 0.0 if last else left - h
            for j in range(size):
                y[j] = new[j]
                k[0, j] = k[6, j]
            _place(q, y)
            # ξ' at ξ = 0 is ω; the other rates are those of the last stage.
            for j in range(3):
                k[0, j] = y[3 + j]
            # A step cut short at the end says nothing about the next one.
            step = max(step, h * factor) if last else h * factor
        else:
            step = h * factor
            if h < _LEAST:
                return (NOT_FINITE if error == math.inf else TOO_SMALL), taken, step, left
        if taken > _MOST:
            return TOO_SMALL, taken, step, left
    return DONE, taken, step, left
