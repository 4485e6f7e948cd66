"""Strokes and force limits of many poses, and tensions within them, in compiled code.

Limits are what :func:`exo_pin.reaction.holding.hold_check.hold_check` says of poses whose forces are determined or
chosen.

Tensions of least norm are those of limbs that carry no side force: what
:class:`exo_pin.reaction.splits.split.Spherical` chooses in stacks, from the same programs of the numerics.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.validation import FloatArray
from ...numerics.bounded.box_descent import Scratch
from ...numerics.bounded.box_program import least_bounded
from ...numerics.bounded.polytope_program import least_sum_force
from ...numerics.small_linear import complete_basis
from ...numerics.vectors import SINGULAR, dot, root, rotation_matrix, turn, vector
from ...wrist.forces.wrench_feasibility import moment_margin
from ..answer import QUERY_STATUS
from ..constraints.actuator_limits import PullLaws

OUT_OF_STROKE, BEYOND = (QUERY_STATUS.index(name) for name in ("out_of_stroke", "beyond_limits"))
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


_NONE, _NO = np.empty(0), np.empty(0, dtype=np.bool_)
#: No limits.
UNLIMITED = CompiledLimits(
    _NONE, _NONE, _NO, _NO, _NONE, _NONE, _NO, PullLaws(np.empty((0, 0)), _NONE, _NONE, _NONE, _NONE)
)


# What a limb can do stands here and below: handing all limits to a function for each limb would take longer.
@kernel(inline=True)
def limits_of_pose(limits: CompiledLimits, length: Any, low: Any, high: Any) -> bool:
    """Fill the limits of the tensions at the lengths of a pose; whether all limbs can have these lengths."""
    possible = True
    for i in range(length.shape[0]):
        upper, open_above = limits.upper[i], limits.open_above[i]
        contraction = limits.laws.uncontracted[i] - length[i]
        if limits.laws.least[i] <= contraction <= limits.laws.most[i]:
            upper, open_above = _greatest_pull(limits.laws, i, contraction), False
        if limits.lower[i] > upper and not open_above:
            possible = False
        possible = possible and not (length[i] < limits.shortest[i] or length[i] > limits.longest[i])
        low[i], high[i] = min(limits.lower[i], upper), upper
    return possible


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
        Shape (N,), changed and written.
    """
    for k in range(q.shape[0]):
        unknown[k] = False
        if status[k] >= SINGULAR:
            continue
        largest = 0.0
        for i in range(base.shape[0]):
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
            if force < min(limits.lower[i], upper) - slack or force > upper + slack:
                strong = True
            elif (limits.open_below[i] and force < -slack) or (open_above and force > slack):
                open_ = True
        sure = strong or (long and long_for_sure)
        if long:
            status[k] = OUT_OF_STROKE
        elif strong:
            status[k] = BEYOND
        unknown[k] = not sure and (open_ or long)


#: The tensions are within their limits; no tensions are; rounding decides.
MET, NOT_HELD, UNDECIDED = 0, 1, 2
#: Margin of the moments, relative to forces and lever arms, beyond which rounding does not decide.
_CLEAR = 1e-9
#: Imbalance, relative to the largest tension, of an exact answer.
_EXACT = 1e-10


# inline=True: handing arrays to a function counts references to each, which takes longer than what it does with them.
@kernel(inline=True)
def _largest(f: Any) -> float:
    largest = 0.0
    for i in range(f.shape[0]):
        largest = max(largest, abs(f[i]))
    return largest


@kernel(inline=True)
def _inside(f: Any, low: Any, high: Any, slack: float) -> bool:
    inside = True
    for i in range(f.shape[0]):
        inside = inside and low[i] - slack <= f[i] <= high[i] + slack
    return inside


@kernel(inline=True)
def _lever_arms(X: Any, reach: Any, arms: Any) -> None:
    """Write b × s of every limb."""
    for i in range(arms.shape[0]):
        for j in range(3):
            arms[i, j] = -reach[i] * X[i, j]


@kernel(inline=True)
def _taken(s: Any, X: Any, reach: Any, radius: float, low: Any, high: Any, within: Any, f: Any, shoulder: Any) -> bool:
    """Take the tensions in the first row of ``within``, if they have the moment of f."""
    miss_x = miss_y = miss_z = most = 0.0
    for i in range(f.shape[0]):
        within[0, i] = min(max(within[0, i], low[i]), high[i])
        most = max(most, abs(within[0, i]))
        change = within[0, i] - f[i]
        miss_x += change * reach[i] * X[i, 0]
        miss_y += change * reach[i] * X[i, 1]
        miss_z += change * reach[i] * X[i, 2]
    if max(abs(miss_x), max(abs(miss_y), abs(miss_z))) > _EXACT * radius * most:
        return False
    for i in range(f.shape[0]):
        for j in range(3):
            shoulder[j] += (within[0, i] - f[i]) * s[i, j]
        f[i] = within[0, i]
    return True


@kernel(inline=True)
def _without(
    X: Any, reach: Any, M: Any, radius: float, low: Any, high: Any, arms: Any, moment: Any, relief: Any, largest: float,
    shoulder: Any,
) -> int:  # fmt: skip
    """The code of a pose for which no tensions were found."""
    scale = max(largest, root(shoulder[0] ** 2 + shoulder[1] ** 2 + shoulder[2] ** 2))
    for i in range(low.shape[0]):
        scale = max(scale, max(low[i], -high[i]))
    _lever_arms(X, reach, arms)
    moment[0, 0], moment[0, 1], moment[0, 2] = M
    margin = moment_margin(arms, moment[0], low, high, moment[1], relief[0], relief[1])
    return NOT_HELD if margin < -_CLEAR * scale * radius else UNDECIDED


@kernel
def tensions_within(
    s: Any, X: Any, reach: Any, M: Any, radius: float, Q: Any, low: Any, high: Any, N: Any, G: Any, c: Any, z: Any,
    arms: Any, moment: Any, relief: Any, f: Any, shoulder: Any,
) -> int:  # fmt: skip
    """Replace f, the tensions of least norm, and F_s by those of least norm within limits; return one of the codes.

    For four to six limbs.

    Parameters
    ----------
    s, X, reach, M, radius : ndarray, tuple, float
        Directions, normals and lever arms of the limbs, shape (n, 3), (n, 3), (n,); the moment that they carry, N m;
        the largest |B_i|, m.
    Q : ndarray
        What :func:`exo_pin.wrist.forces.force_kernels.spherical_forces` leaves, shape (n, 3).
    low, high : ndarray
        Shape (n,), N, infinite where there is no limit.
    N, G, c, z, arms, moment, relief : ndarray
        Room, shapes (n, n - 3), (3, n - 3), (3,), (n - 3,), (n, 3), (2, 3) and (2, n).
    f, shoulder : ndarray
        Shape (n,), N, and (3,), N, changed if the result is :data:`MET`.
    """
    n, m = f.shape[0], N.shape[1]
    largest = _largest(f)
    if _inside(f, low, high, _ROUNDING * largest):
        return MET
    complete_basis(Q, N)
    for j in range(3):
        c[j] = 0.0
        for k in range(m):
            G[j, k] = 1.0 if j == k else 0.0
    for k in range(m):
        for i in range(n):
            c[k] += N[i, k] * f[i]
    if not least_sum_force(c, G, f, N, low, high, z[:m]):
        return _without(X, reach, M, radius, low, high, arms, moment, relief, largest, shoulder)
    for i in range(n):
        relief[0, i] = f[i]
        for k in range(m):
            relief[0, i] += N[i, k] * z[k]
    return MET if _taken(s, X, reach, radius, low, high, relief, f, shoulder) else UNDECIDED


@kernel
def many_tensions_within(
    s: Any, X: Any, reach: Any, M: Any, radius: float, low: Any, high: Any, c: Any, arms: Any, moment: Any, relief: Any,
    work: Scratch, f: Any, shoulder: Any,
) -> int:  # fmt: skip
    """:func:`tensions_within` for any number of limbs: the shortest of the tensions that come nearest to the moment."""
    largest = _largest(f)
    if _inside(f, low, high, _ROUNDING * largest):
        return MET
    _lever_arms(X, reach, arms)
    c[0], c[1], c[2] = -M[0], -M[1], -M[2]
    least_bounded(c, np.ascontiguousarray(arms.T), low, high, relief[0], work)
    if _taken(s, X, reach, radius, low, high, relief, f, shoulder):
        return MET
    return _without(X, reach, M, radius, low, high, arms, moment, relief, largest, shoulder)
