"""Dependent coordinates of closed loops from independent ones, compiled: one pivoted QR of the constraint Jacobian."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.pivoted_qr import pivoted_qr, solve_triangle
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
    W, order = np.empty((nv + k, m)), np.empty(nv, dtype=np.int64)  # columns lie one after the other
    largest = 0.0
    for c in range(nv + k):
        total = 0.0
        for r in range(m):
            W[c, r] = row_scale[r] * (J[r, c] * column[c] if c < nv else right[r, c - nv])
            total += W[c, r] * W[c, r]
        if c < nv:
            largest = max(largest, total)
    tolerance = rank_tolerance(J.shape, math.sqrt(largest), joints, residual)
    diagonal, half = np.empty(min(m, nv)), np.empty(min(m, nv))
    rank = pivoted_qr(W, allowed, order, tolerance, diagonal, half)
    count = nv - rank + k
    x, error, triangle = np.empty((rank, count)), np.zeros(count), np.zeros((rank, rank))
    for c in range(rank):
        triangle[:c, c] = W[c, :c]
        triangle[c, c] = diagonal[c]
    for s in range(count):
        own, unit = W[rank + s], -column[order[rank + s]] if rank + s < nv else 1.0
        for r in range(rank, m):
            error[s] = max(error[s], abs(own[r]))
        solve_triangle(W, diagonal, rank, own)
        for i in range(rank):
            x[i, s] = own[i] * column[order[i]] / unit
    return order, rank, x, error, triangle, tolerance
