"""Dependent coordinates of closed loops, and nearest motions, compiled: one pivoted QR of the constraint Jacobian."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....numerics.small_linear import copy_numbers, pivoted_qr, reflect, solve_transposed, solve_triangle
from ..rank import RESOLVED, ROUNDING, least_motion, rank_tolerance
from .closure_kernels import residual_jacobian

#: Scaled residual of loops whose redundant rows agree.
_CONSISTENT = 1e-11


@kernel(inline=True)
def fill_dependent(
    J: Any, right: Any, allowed: Any, scales: Any, joints: int, residual: float, factors: Any, order: Any, error: Any
) -> Any:
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
        As for :func:`exo_pin.chain.kinematics.rank.least_motion`.
    joints : int
        Number of joints of the tree.
    residual : float
        Largest scaled residual of the loops.
    factors : tuple of ndarray
        W, shape (nv + k, rows), and the triangle's diagonal and half the squares of the reflectors, shape (nv,),
        filled. Behind the reflectors W has in its rows the dependent coordinates per unit of each of the others, then
        those for the columns of ``right`` with the others at zero.
    order : ndarray of int
        Shape (nv,), filled: the dependent coordinates in the order in which they were taken, then the others.
    error : ndarray
        Shape (nv + k,), filled from the first on: the largest scaled error that each of these leaves in the rows.

    Returns
    -------
    tuple
        How many are dependent, and the tolerance: scaled columns no longer than it are rounding.
    """
    row_scale, column, _ = scales
    W, diagonal, half = factors
    m, nv, k = J.shape[0], J.shape[1], right.shape[1]
    largest = 0.0
    for c in range(nv + k):
        total = 0.0
        for r in range(m):
            W[c, r] = row_scale[r] * (J[r, c] * column[c] if c < nv else right[r, c - nv])
            total += W[c, r] * W[c, r]
        if c < nv:
            largest = max(largest, total)
    tolerance = rank_tolerance(J.shape, math.sqrt(largest), joints, residual)
    rank = pivoted_qr(W, allowed, order, tolerance, diagonal, half)
    for s in range(nv - rank + k):
        own, unit = W[rank + s], -column[order[rank + s]] if rank + s < nv else 1.0
        error[s] = 0.0
        for r in range(rank, m):
            error[s] = max(error[s], abs(own[r]))
        solve_triangle(W, diagonal, rank, own)
        for i in range(rank):
            own[i] *= column[order[i]] / unit
    return rank, tolerance


@kernel
def reduced_motion(J: Any, given: Any, scales: Any, joints: int, residual: float) -> Any:
    """Independent coordinates, and how all follow them.

    Parameters
    ----------
    J, scales, joints, residual
        As for :func:`fill_dependent`.
    given : ndarray of int
        Coordinates that have to be independent; if there are none, all are chosen.

    Returns
    -------
    own : ndarray of int
        The independent coordinates, as they are given if they are all, else ascending.
    G : ndarray
        Shape (nv, d), all velocities per unit of each of them.
    order, factors
        What :func:`fill_dependent` fills.
    choice : tuple
        How many coordinates are dependent; the largest scaled error that G leaves in the rows; what is rounding there.
    """
    (m, nv), distinct = J.shape, 0
    allowed, order, error = np.ones(nv, dtype=np.bool_), np.empty(nv, dtype=np.int64), np.empty(nv)
    for k in given:
        distinct += allowed[k]
        allowed[k] = False
    factors = np.zeros((nv, m)), np.zeros(nv), np.zeros(nv)
    rank, cut = fill_dependent(J, np.empty((m, 0)), allowed, scales, joints, residual, factors, order, error)
    own, G, most = np.empty(nv - rank, dtype=np.int64), np.zeros((nv, nv - rank)), 0.0
    if len(own) == len(given) == distinct:
        copy_numbers(given, own)
    else:
        fill_ascending(order[rank:], own)
    for s in range(len(own)):
        k = 0
        while own[k] != order[rank + s]:
            k += 1
        G[order[rank + s], k] = 1.0
        for i in range(rank):
            G[order[i], k] = factors[0][rank + s, i]
        most = max(most, error[s])
    return own, G, order, factors, (rank, most, cut)


@kernel
def reduced_loops(
    poses: Any, J: Any, loops: Any, q: Any, given: Any, scales: Any, tolerance: float, gap: Any, jacobian: Any
) -> Any:
    """:func:`reduced_motion` at a configuration.

    Parameters
    ----------
    poses, J, loops, q, gap, jacobian
        As for :func:`~exo_pin.chain.kinematics.kernels.closure_kernels.residual_jacobian`, which fills the last two.
    given, scales
        As for :func:`reduced_motion`.
    tolerance : float
        Of the geometry, scaled; 0 for an exact one.

    Returns
    -------
    tuple
        The largest residual; the independent coordinates; the dependent ones; the reduced Jacobian; the choice.
    """
    worst, known = residual_jacobian(poses, J, loops, q, gap, jacobian), tolerance
    for i in range(len(gap) if tolerance == 0.0 else 0):
        known = max(known, abs(gap[i] * scales[0][i]))
    own, G, order, _, choice = reduced_motion(jacobian, given, scales, len(poses), known)
    return worst, own, order[: choice[0]].copy(), G, choice


@kernel(inline=True)
def fill_ascending(indices: Any, out: Any) -> None:
    """Fill a few indices in ascending order: Numba's sort takes longer for so few."""
    for i in range(len(indices)):
        k = i
        while k > 0 and out[k - 1] > indices[i]:
            out[k] = out[k - 1]
            k -= 1
        out[k] = indices[i]


@kernel
def nearest_motion(J: Any, right: Any, scales: Any, joints: int, residual: float, freedoms: bool) -> Any:
    """:func:`~exo_pin.chain.kinematics.rank.least_motion` from a pivoted QR of the rows.

    Where that does not show beyond doubt which rows depend on others, as near a singular configuration, the singular
    values decide. Parameters and results are those of that function, and whether forces and accelerations at the
    configuration are certain not to depend on rounding: :func:`~exo_pin.chain.kinematics.rank.configuration_error`
    times the largest singular value is at most :data:`~exo_pin.chain.kinematics.rank.RESOLVED` of the smallest one that
    is not zero. False means nothing: then the singular values decide. The rows that were chosen bound a block's
    smallest singular value that is not zero from below, by the norm of the inverse of their triangle; those left over
    bound the ones that are zero from above; the Frobenius norm bounds the largest.
    """
    row_scale, column, (rows, columns, row_starts, column_starts) = scales
    nv, longest, largest = len(column), 0.0, 0.0
    for b in range(len(row_starts) - 1):
        whole = 0.0
        for i in rows[row_starts[b] : row_starts[b + 1]]:
            total = 0.0
            for k in columns[column_starts[b] : column_starts[b + 1]]:
                entry = J[i, k] * row_scale[i] * column[k]
                total += entry * entry
            longest, whole = max(longest, total), whole + total
        largest = max(largest, whole)
    # The longest row and the Frobenius norm bound the largest singular value. Redundant rows of loops that are open
    # contradict each other: there singular values decide, too.
    small = min(residual, _CONSISTENT)
    zero = 0.5 * rank_tolerance(J.shape, math.sqrt(longest), joints, small) / math.sqrt(max(J.shape[0], 1))
    clear = 2.0 * rank_tolerance(J.shape, math.sqrt(largest), joints, residual)
    x, motions, filled = np.zeros(nv), np.zeros((nv, nv if freedoms else 0)), 0
    moved, weakest = np.zeros(nv, dtype=np.bool_), 0.0
    for b in range(len(row_starts) - 1):
        own, mine = rows[row_starts[b] : row_starts[b + 1]], columns[column_starts[b] : column_starts[b + 1]]
        n, m = len(own), len(mine)
        W = np.empty((n, m))
        for i in range(n):
            for k in range(m):
                W[i, k] = J[own[i], mine[k]] * row_scale[own[i]] * column[mine[k]]
        order, memory = np.empty(n, dtype=np.int64), np.empty((3, max(n, m)))
        y, diagonal, half = memory[0], memory[1, : min(n, m)], memory[2, : min(n, m)]
        rank = pivoted_qr(W, np.ones(n, dtype=np.bool_), order, zero, diagonal, half)
        # The sum of squares of the triangle's inverse is at least one over the square of the least singular value.
        total = 0.0
        for j in range(rank):
            y[:rank] = 0.0
            y[j] = 1.0
            solve_triangle(W, diagonal, rank, y)
            for i in range(rank):
                total += y[i] * y[i]
        if not total * clear * clear < 1.0:
            x, motions = least_motion(J, right, scales, joints, residual, freedoms)
            return x, motions, False
        weakest = max(weakest, total)
        y[:] = 0.0
        for i in range(rank):
            y[i] = row_scale[own[order[i]]] * right[own[order[i]]]
        solve_transposed(W, diagonal, half, rank, y)
        for k in range(m):
            moved[mine[k]] = True
            x[mine[k]] = column[mine[k]] * y[k]
        for s in range(rank, m if freedoms else rank):
            y[:] = 0.0
            y[s] = 1.0
            for k in range(rank - 1, -1, -1):
                reflect(W, half, k, y)
            for k in range(m):
                motions[mine[k], filled] = y[k]
            filled += 1
    if freedoms:
        for k in range(nv):
            if not moved[k]:
                motions[k, filled] = 1.0
                filled += 1
    error = max(residual, joints * ROUNDING) * math.sqrt(largest)
    return x, motions[:, :filled].copy(), error * weakest <= RESOLVED
