"""Dependent coordinates of closed loops from independent ones, compiled: one pivoted QR of the constraint Jacobian."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from .rank import rank_tolerance


@kernel
def dependent_on(J: Any, right: Any, allowed: Any, scales: Any, joints: int, residual: float) -> Any:
    """Solve J x = right for the dependent coordinates of x, and their change with the others.

    Householder's QR with metres divided by the characteristic length. Every step takes the coordinate that may be
    dependent and whose column is farthest from the span of those taken before, until the rest is rounding.

    Parameters
    ----------
    J : ndarray
        Shape (rows, nv), the constraint Jacobian, not scaled.
    right : ndarray
        Shape (rows, k).
    allowed : ndarray of bool
        Shape (nv,), which coordinates may be dependent.
    scales : tuple
        As for :func:`exo_pin.chain.kinematics.rank.is_clearly_regular`.
    joints : int
        Number of joints of the tree.
    residual : float
        Largest scaled residual of the loops.

    Returns
    -------
    order : ndarray of int
        Shape (nv,), the dependent coordinates in the order in which they were taken, then the others.
    rank : int
        How many are dependent.
    x : ndarray
        Shape (rank, nv - rank + k): the dependent coordinates per unit of each of the others, then those for the
        columns of ``right`` with the others at zero.
    error : ndarray
        Shape (nv - rank + k,): the largest scaled error that these leave in the rows.
    triangle : ndarray
        Shape (rank, rank), the scaled columns' triangle.
    tolerance : float
        Scaled columns no longer than this are rounding.
    """
    row_scale, column, _ = scales
    m, nv, k = J.shape[0], J.shape[1], right.shape[1]
    W, order = np.empty((nv + k, m)), np.arange(nv)  # columns lie one after the other
    largest, rank, tolerance = 0.0, 0, 0.0
    for c in range(nv + k):
        total = 0.0
        for r in range(m):
            W[c, r] = row_scale[r] * (J[r, c] * column[c] if c < nv else right[r, c - nv])
            total += W[c, r] * W[c, r]
        if c < nv:
            largest = max(largest, total)
    if m:
        tolerance = rank_tolerance(J.shape, math.sqrt(largest), joints, residual)
    while rank < min(m, nv):
        best, longest = -1, tolerance * tolerance
        for c in range(rank, nv):
            if allowed[order[c]]:
                total = 0.0
                for r in range(rank, m):
                    total += W[c, r] * W[c, r]
                if total > longest:
                    best, longest = c, total
        if best < 0:
            break
        order[rank], order[best] = order[best], order[rank]
        for r in range(m):
            W[rank, r], W[best, r] = W[best, r], W[rank, r]
        size = math.sqrt(longest)
        pivot = W[rank, rank]
        corner = -size if pivot > 0.0 else size
        first = pivot - corner
        half = longest + size * abs(pivot)
        for c in range(rank + 1, nv + k):
            along = first * W[c, rank]
            for r in range(rank + 1, m):
                along += W[rank, r] * W[c, r]
            along /= half
            W[c, rank] -= along * first
            for r in range(rank + 1, m):
                W[c, r] -= along * W[rank, r]
        W[rank, rank] = corner
        for r in range(rank + 1, m):
            W[rank, r] = 0.0
        rank += 1
    count = nv - rank + k
    x, error, triangle = np.empty((rank, count)), np.zeros(count), np.zeros((rank, rank))
    for c in range(rank):
        for r in range(c + 1):
            triangle[r, c] = W[c, r]
    for s in range(count):
        own, sign, unit = W[rank + s], 1.0, 1.0
        if rank + s < nv:
            sign, unit = -1.0, column[order[rank + s]]
        for r in range(rank, m):
            error[s] = max(error[s], abs(own[r]))
        for i in range(rank - 1, -1, -1):
            part = own[i]
            for j in range(i + 1, rank):
                part -= W[j, i] * own[j]
            own[i] = part / W[i, i]
        for i in range(rank):
            x[i, s] = sign * own[i] * column[order[i]] / unit
    return order, rank, x, error, triangle, tolerance
