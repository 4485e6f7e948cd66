"""Strokes and force limits of many poses, checked in compiled code.

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
from ..constraints.actuator_limits import PullLaws

_INFEASIBLE, _OUT_OF_STROKE, _BEYOND = (
    QUERY_STATUS.index(name) for name in ("infeasible", "out_of_stroke", "beyond_limits")
)
#: Share of the largest tension by which a limit may be passed: rounding.
_ROUNDING = 1e-9


class CompiledLimits(NamedTuple):
    """Limits that are the same in all poses, or depend on the lengths by laws of muscles; one entry a limb.

    Attributes
    ----------
    lower, upper : ndarray
        N, infinite where there is none; ``upper`` where no law gives it.
    open_below, open_above : ndarray of bool
        Whether the limit is not known; ``open_above`` where no law gives it.
    shortest, longest : ndarray
        m, NaN where not known.
    estimated : ndarray of bool
        Whether a limit of the limb is an estimate.
    laws : PullLaws
        Greatest tensions that depend on the length.
    """

    lower: FloatArray
    upper: FloatArray
    open_below: NDArray[np.bool_]
    open_above: NDArray[np.bool_]
    shortest: FloatArray
    longest: FloatArray
    estimated: NDArray[np.bool_]
    laws: PullLaws


@kernel(inline=True)
def _greatest_pull(laws: PullLaws, i: int, contraction: float) -> float:
    """Greatest tension of limb i by its law, N."""
    pull = 0.0
    for j in range(laws.powers.shape[1] - 1, -1, -1):
        pull = pull * contraction + laws.powers[i, j]
    return min(max(pull, 0.0), laws.ceiling[i])


@kernel(stack=True)
def check_limits(q: Any, base: Any, platform: Any, limits: CompiledLimits, f: Any, status: Any, unknown: Any) -> None:
    """Mark poses whose lengths or forces are beyond their limits in ``status``, and what is not known.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    base, platform : ndarray
        A_i and B_i, shape (n, 3), m, of the base and the arm frame.
    limits : CompiledLimits
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
            upper, open_above = limits.upper[i], limits.open_above[i]
            contraction = limits.laws.uncontracted[i] - length
            if limits.laws.least[i] <= contraction <= limits.laws.most[i]:
                upper, open_above = _greatest_pull(limits.laws, i, contraction), False
            # At a length at which it cannot give its least tension an actuator cannot be.
            weak = limits.lower[i] > upper and not open_above
            if weak or length < limits.shortest[i] or length > limits.longest[i]:
                long = True
                long_for_sure |= not limits.estimated[i]
            elif not length >= limits.shortest[i] or not length <= limits.longest[i] or limits.estimated[i]:
                # A comparison with NaN is false.
                open_ = True
            force = f[k, i]
            if none:
                continue
            if force < min(limits.lower[i], upper) - slack or force > upper + slack:
                strong = True
            elif (limits.open_below[i] and force < -slack) or (open_above and force > slack):
                open_ = True
        sure = none or strong or (long and long_for_sure)
        if long:
            status[k] = _OUT_OF_STROKE
        elif strong:
            status[k] = _BEYOND
        unknown[k] = not sure and (open_ or long)
