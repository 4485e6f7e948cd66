"""Strokes and constant force limits of many poses, checked in compiled code.

What :func:`exo_pin.reaction.holding.hold_check.hold_check` says of poses whose forces are determined or chosen.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.validation import FloatArray
from ...numerics.vectors import SINGULAR, dot, rotation_matrix, turn, vector
from ..answer import QUERY_STATUS

_INFEASIBLE, _OUT_OF_STROKE, _BEYOND = (
    QUERY_STATUS.index(name) for name in ("infeasible", "out_of_stroke", "beyond_limits")
)
#: Share of the largest tension by which a limit may be passed: rounding.
_ROUNDING = 1e-9


class ConstantLimits(NamedTuple):
    """Limits that are the same in all poses, one entry a limb.

    Attributes
    ----------
    lower, upper : ndarray
        N, infinite where there is none.
    open_below, open_above : ndarray of bool
        Whether the limit is not known.
    shortest, longest : ndarray
        m, NaN where not known.
    estimated : ndarray of bool
        Whether a limit of the limb is an estimate.
    """

    lower: FloatArray
    upper: FloatArray
    open_below: NDArray[np.bool_]
    open_above: NDArray[np.bool_]
    shortest: FloatArray
    longest: FloatArray
    estimated: NDArray[np.bool_]


@kernel(stack=True)
def check_limits(q: Any, base: Any, platform: Any, limits: ConstantLimits, f: Any, status: Any, unknown: Any) -> None:
    """Mark poses whose lengths or forces are beyond their limits in ``status``, and what is not known.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    base, platform : ndarray
        A_i and B_i, shape (n, 3), m, of the base and the arm frame.
    limits : ConstantLimits
        Of the limbs.
    f : ndarray
        Tensions, shape (N, n), N.
    status, unknown : ndarray
        Shape (N,), changed and written. "infeasible" rows have no forces; they stay so if their lengths are met.
    """
    for k in range(q.shape[0]):
        unknown[k] = False
        none = status[k] == _INFEASIBLE
        if status[k] >= SINGULAR and not none:
            continue
        largest = 0.0
        for i in range(0 if none else base.shape[0]):
            largest = max(largest, abs(f[k, i]))
        slack, R = _ROUNDING * largest, rotation_matrix(q[k, 0], q[k, 1], q[k, 2], q[k, 3])
        long, long_for_sure, strong, open_ = False, False, False, False
        for i in range(base.shape[0]):
            b, a = turn(R, vector(platform, i)), vector(base, i)
            span = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
            length = math.sqrt(dot(span, span))
            if length < limits.shortest[i] or length > limits.longest[i]:
                long = True
                long_for_sure |= not limits.estimated[i]
            elif not length >= limits.shortest[i] or not length <= limits.longest[i] or limits.estimated[i]:
                # A comparison with NaN is false.
                open_ = True
            force = f[k, i]
            if none:
                continue
            if force < limits.lower[i] - slack or force > limits.upper[i] + slack:
                strong = True
            elif (limits.open_below[i] and force < -slack) or (limits.open_above[i] and force > slack):
                open_ = True
        sure = none or strong or (long and long_for_sure)
        if long:
            status[k] = _OUT_OF_STROKE
        elif strong:
            status[k] = _BEYOND
        unknown[k] = not sure and (open_ or long)
