"""Bounded-variable least squares in space: step 2 of :mod:`exo_pin.numerics.bounded.box_program`, compiled.

Variables of least norm that give a force: step 3 of :mod:`exo_pin.numerics.bounded.box_program`, compiled.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import kernel
from ..small_linear import RANK_TOLERANCE, orthonormalise, row_rank
from ..vectors import dot, root

#: Most rounds of a search; the methods end by themselves, this guards against an error in the proof.
ROUNDS = 1000
#: In place of a variable, where there is none.
NONE = -1
#: Gain of a direction, relative to the largest force of the problem, that counts as zero.
_NO_GAIN = 1e-14


#: Relative step of z that counts as zero.
NO_STEP = 1e-13
#: Gradient, relative to the largest force of the problem, above which a bound is active.
_PRESSED = 1e-10


# inline=True: handing arrays to a function counts references to each, which takes longer than what it does with them.
@kernel(inline=True)
def column(G: Any, i: int) -> Any:
    """Column i of G as a tuple."""
    return G[0, i], G[1, i], G[2, i]


@kernel(inline=True)
def force_of(c: Any, G: Any, z: Any) -> Any:
    """The force c + G z."""
    x, y, w = c[0], c[1], c[2]
    for i in range(G.shape[1]):
        x, y, w = x + G[0, i] * z[i], y + G[1, i] * z[i], w + G[2, i] * z[i]
    return x, y, w


@kernel(inline=True)
def size_of(v: Any) -> float:
    """Length of a tuple."""
    return root(dot(v, v))


@kernel(inline=True)
def _without(v: Any, q: Any) -> Any:
    overlap = dot(v, q)
    return v[0] - overlap * q[0], v[1] - overlap * q[1], v[2] - overlap * q[2]


@kernel(inline=True)
def _across(v: Any, q1: Any, q2: Any, q3: Any) -> Any:
    """The part of v orthogonal to the orthonormal q; done twice, which makes it exact to rounding."""
    v = _without(_without(_without(v, q1), q2), q3)
    return _without(_without(_without(v, q1), q2), q3)


@kernel(inline=True)
def _basis(G: Any, i1: int, i2: int, i3: int) -> Any:
    """Orthonormal basis q of the columns of the free variables, and u_jj, the length of the new part of each.

    An index of :data:`NONE` stands for none: q is zero there and u is one.
    """
    q1 = q2 = q3 = (0.0, 0.0, 0.0)
    u1 = u2 = u3 = 1.0
    if i1 >= 0:
        q1 = column(G, i1)
        u1 = size_of(q1)
        q1 = (q1[0] / u1, q1[1] / u1, q1[2] / u1)
    if i2 >= 0:
        q2 = _across(column(G, i2), q1, q3, q3)
        u2 = size_of(q2)
        q2 = (q2[0] / u2, q2[1] / u2, q2[2] / u2)
    if i3 >= 0:
        q3 = _across(column(G, i3), q1, q2, q3)
        u3 = size_of(q3)
        q3 = (q3[0] / u3, q3[1] / u3, q3[2] / u3)
    return q1, q2, q3, u1, u2, u3


@kernel(inline=True)
def _share(z: float, goal: float, low: float, high: float) -> float:
    """Share of the step from z to its goal that the bounds allow; more than one if the goal is inside the bounds."""
    if low < goal < high:
        return 2.0
    bound = low if goal <= low else high
    return max((bound - z) / (goal - z), 0.0) if goal != z else 0.0


@kernel(inline=True)
def _moved(z: Any, i: int, goal: float, share: float, low: Any, high: Any) -> None:
    """Move variable i by that share of its step, onto its bound if the step ends there."""
    if share >= 1.0:
        z[i] = goal
    else:
        z[i] += share * (goal - z[i])
    z[i] = min(max(z[i], low[i]), high[i])


@kernel(inline=True)
def _entrant(
    r: Any, G: Any, low: Any, high: Any, z: Any, basis: Any, free: Any, tried: Any, gain: float, largest: float
) -> int:
    """The variable whose release lowers the force r most, :data:`NONE` if none gains more than ``gain``."""
    q1, q2, q3 = basis
    best, most = NONE, gain
    for i in range(G.shape[1]):
        if i == free[0] or i == free[1] or i == free[2] or tried[i] or not low[i] < high[i]:
            continue
        part = _across(column(G, i), q1, q2, q3)
        size = size_of(part)
        if size <= RANK_TOLERANCE * largest:
            continue  # its column adds nothing to the span of the free ones
        slope = dot(part, r) / size
        if abs(slope) > most and ((slope < 0.0 and z[i] < high[i]) or (slope > 0.0 and z[i] > low[i])):
            best, most = i, abs(slope)
    return best


@kernel
def descend(c: Any, G: Any, low: Any, high: Any, z: Any, scale: float, tried: Any, before: Any) -> None:
    """Least |c + G z| within the bounds, from z within them: step 2 of the module's description.

    The free variables are i1, i2, i3, filled from the first, :data:`NONE` for none. ``tried`` and ``before`` are
    scratch of the shape of z.
    """
    largest = 0.0
    for i in range(G.shape[1]):
        tried[i] = False
        largest = max(largest, size_of(column(G, i)))
    i1 = i2 = i3 = NONE
    q1 = q2 = q3 = (0.0, 0.0, 0.0)
    r = force_of(c, G, z)
    size = size_of(r)
    for _ in range(ROUNDS):
        across = _across(r, q1, q2, q3)
        i = _entrant(across, G, low, high, z, (q1, q2, q3), (i1, i2, i3), tried, _NO_GAIN * scale, largest)
        if i < 0:
            return
        i1, i2, i3 = (i, NONE, NONE) if i1 < 0 else ((i1, i, NONE) if i2 < 0 else (i1, i2, i))
        for j in range(G.shape[1]):
            before[j] = z[j]
        while i1 >= 0:
            # Least squares of the free variables: the change that it takes, by back substitution.
            q1, q2, q3, u1, u2, u3 = _basis(G, i1, i2, i3)
            t3 = -dot(q3, r) / u3
            t2 = -(dot(q2, r) + (dot(q2, column(G, i3)) * t3 if i3 >= 0 else 0.0)) / u2
            t1 = dot(q1, r) + (dot(q1, column(G, i2)) * t2 if i2 >= 0 else 0.0)
            t1 = -(t1 + (dot(q1, column(G, i3)) * t3 if i3 >= 0 else 0.0)) / u1
            goal1, goal2, goal3 = z[i1] + t1, z[max(i2, 0)] + t2, z[max(i3, 0)] + t3
            share1 = _share(z[i1], goal1, low[i1], high[i1])
            share2 = _share(z[i2], goal2, low[i2], high[i2]) if i2 >= 0 else 2.0
            share3 = _share(z[i3], goal3, low[i3], high[i3]) if i3 >= 0 else 2.0
            share = min(share1, share2, share3)
            _moved(z, i1, goal1, share, low, high)
            if i2 >= 0:
                _moved(z, i2, goal2, share, low, high)
            if i3 >= 0:
                _moved(z, i3, goal3, share, low, high)
            r = force_of(c, G, z)
            if not share <= 1.0:
                break
            # One reached its bound: set it exactly, and continue with the others.
            if share1 == share:
                z[i1] = low[i1] if goal1 <= low[i1] else high[i1]
                i1, i2, i3 = i2, i3, NONE
            elif share2 == share:
                z[i2] = low[i2] if goal2 <= low[i2] else high[i2]
                i2, i3 = i3, NONE
            else:
                z[i3] = low[i3] if goal3 <= low[i3] else high[i3]
                i3 = NONE
            r = force_of(c, G, z)
        now = size_of(r)
        if now < size:
            size = now
            for j in range(G.shape[1]):
                tried[j] = False
        else:
            # No gain, by rounding. Undo the step; variables that were free stay and are found again if they gain.
            for j in range(G.shape[1]):
                z[j] = before[j]
            r = force_of(c, G, z)
            tried[i] = True
            i1 = i2 = i3 = NONE
        q1, q2, q3, _, _, _ = _basis(G, i1, i2, i3)


class Scratch(NamedTuple):
    """Scratch arrays for programs of m variables, so that the kernels allocate nothing per pose."""

    A: Any
    c: Any
    Q: Any
    U: Any
    goal: Any
    saved: Any
    movable: Any
    mark: Any


@kernel
def scratch(m: int) -> Scratch:
    """Make the scratch arrays."""
    A, Q, U = np.empty((3, m)), np.empty((m, 3)), np.empty((3, 3))
    indices, mark = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64)
    return Scratch(A, np.empty(3), Q, U, np.empty(m), np.empty(m), indices, mark)


@kernel
def shorten(c: Any, G: Any, low: Any, high: Any, z: Any, scale: float, work: Scratch) -> None:
    """Shortest z within the bounds with the same force: step 3 of the module's description."""
    m = G.shape[1]
    A, movable, held, effect = work.A, work.movable, work.mark, work.c
    goal, Q, U = work.goal, work.Q, work.U
    r = force_of(c, G, z)
    v = 0
    for i in range(m):
        slope = dot(column(G, i), r)
        pressed = (z[i] == low[i] and slope > _PRESSED * scale) or (z[i] == high[i] and slope < -_PRESSED * scale)
        if low[i] < high[i] and not pressed:
            for j in range(3):
                A[j, v] = G[j, i]
            movable[v] = i
            held[v] = False
            v += 1
    rank = row_rank(A[:, :v], effect, RANK_TOLERANCE)  # of the columns alone; the right side is written below
    if rank == v:
        return
    for _ in range(ROUNDS):
        longest, count = 0.0, 0
        for k in range(v):
            longest = max(longest, abs(z[movable[k]]))
            if not held[k]:
                for j in range(rank):
                    Q[count, j] = A[j, k]
                count += 1
        if count < rank:
            return
        orthonormalise(Q[:count], U, rank)
        # Shortest values of the variables that are not held, with the same effect: their part in the span of Q.
        for j in range(rank):
            overlap, k_free = 0.0, 0
            for k in range(v):
                if not held[k]:
                    overlap += Q[k_free, j] * z[movable[k]]
                    k_free += 1
            effect[j] = overlap
        largest_step, k_free = 0.0, 0
        for k in range(v):
            goal[k] = z[movable[k]]
            if not held[k]:
                goal[k] = 0.0
                for j in range(rank):
                    goal[k] += Q[k_free, j] * effect[j]
                k_free += 1
                largest_step = max(largest_step, abs(goal[k] - z[movable[k]]))
        slack = NO_STEP * longest
        if largest_step <= slack:
            for k in range(v):
                z[movable[k]] = min(max(goal[k], low[movable[k]]), high[movable[k]])
            # Multipliers λ of the unchanged effect: Aᵀ λ = z for the variables that are not held.
            for j in range(rank - 1, -1, -1):
                for k in range(j + 1, rank):
                    effect[j] -= U[j, k] * effect[k]
                effect[j] /= U[j, j]
            released = NONE
            for k in range(v):
                i = movable[k]
                if held[k]:
                    multiplier = z[i]
                    for j in range(rank):
                        multiplier -= A[j, k] * effect[j]
                    if (multiplier if z[i] == low[i] else -multiplier) < 0.0:
                        released = k
                        break
            if released < 0:
                return
            held[released] = False
            continue
        share, blocking = 1.0, NONE
        for k in range(v):
            i = movable[k]
            # An excess by rounding alone does not block: fixing the variable could lower the rank of the others.
            if held[k] or low[i] - slack <= goal[k] <= high[i] + slack:
                continue
            bound = low[i] if goal[k] < low[i] else high[i]
            reached = max((bound - z[i]) / (goal[k] - z[i]), 0.0)
            if reached < share:
                share, blocking = reached, k
        for k in range(v):
            i = movable[k]
            if not held[k]:
                z[i] = min(max(z[i] + share * (goal[k] - z[i]), low[i]), high[i])
        if blocking >= 0:
            i = movable[blocking]
            z[i] = low[i] if goal[blocking] < low[i] else high[i]
            held[blocking] = True
