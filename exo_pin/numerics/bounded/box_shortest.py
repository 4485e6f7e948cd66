"""Variables of least norm that give a force: step 3 of :mod:`exo_pin.numerics.bounded.box_program`, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import kernel
from ..small_linear import RANK_TOLERANCE, orthonormalise, row_rank
from ..vectors import dot
from .box_descent import NONE, ROUNDS, column, force_of

#: Relative step of z that counts as zero.
NO_STEP = 1e-13
#: Gradient, relative to the largest force of the problem, above which a bound is active.
_PRESSED = 1e-10


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
