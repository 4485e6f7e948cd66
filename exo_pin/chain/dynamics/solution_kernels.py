"""All multipliers that make a motion, and the least of them, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.small_linear import solve_cholesky
from ..kinematics.rank import rank_tolerance
from .equation_kernels import wrenches_of

#: No component is called undetermined for less than this share of a self-stress, nor unique for more.
_SHARPEST, _BLUNTEST = 1e-10, 1e-6
#: A light link's forces have errors of rounding of the heaviest link's, a share of 1e-13 of these.
_ROUNDING = 1e-6


@kernel
def solutions(J: Any, tau: Any, tree: Any, owners: Any, passive: Any, scales: Any, length: float, gap: float) -> Any:
    """All λ with tau - Jᵀλ = 0 in the passive coordinates.

    The loops of each block are solved by themselves, so that a robot of many loops takes as many small singular value
    decompositions, and no large one, on which LAPACK would start threads that cost more than they save.

    Parameters
    ----------
    J, tau : ndarray
        Shapes (rows, nv) and (nv,).
    tree : ndarray
        Shape (njoints, 6), the open tree's wrenches: against them a generalised force counts as rounding.
    owners : ndarray of int
        Shape (nv,), the joint of each coordinate.
    passive : ndarray of int
        Indices in v.
    scales : tuple
        As for :func:`exo_pin.chain.kinematics.rank.is_clearly_regular`.
    length : float
        Characteristic length, m.
    gap : float
        Largest scaled residual of the loops.

    Returns
    -------
    tuple
        The λ of least sum of squares of forces and of moments over the length; a basis of the self-stresses,
        orthonormal in that metric, shape (rows, k); the share of a self-stress that is rounding; what is missing in
        the passive coordinates, N m (scaled); the forces with which it compares there, N m (scaled); the largest share
        of these that is missing; the smallest singular value of the equations that is not zero, infinite if there is
        none.
    """
    row_scale, column, (rows, columns, row_starts, column_starts) = scales
    count, height, blocks_count = len(passive), len(row_scale), len(row_starts) - 1
    right, is_passive = np.empty(count), np.zeros(len(tau), dtype=np.int64)
    for i in range(count):
        right[i] = column[passive[i]] * tau[passive[i]]
        is_passive[passive[i]] = 1 + i
    found, left = np.zeros(height), right.copy()
    parts, largest = [], 0.0
    for b in range(blocks_count):
        own = rows[row_starts[b] : row_starts[b + 1]]
        mine = np.array([is_passive[k] - 1 for k in columns[column_starts[b] : column_starts[b + 1]] if is_passive[k]])
        A = np.empty((len(mine), len(own)))
        for i in range(len(mine)):
            for r in range(len(own)):
                A[i, r] = J[own[r], passive[mine[i]]] * row_scale[own[r]] * column[passive[mine[i]]]
        if len(mine):
            # V is needed whole, for the self-stresses; U is not.
            U, values, Vt = np.linalg.svd(A, len(mine) < len(own))
            largest = max(largest, values[0])
        else:
            U, values, Vt = np.empty((0, 0)), np.empty(0), np.eye(len(own))
        parts.append((own, mine, A, U, values, Vt))
    tolerance = rank_tolerance((count, height), largest, len(tree), gap)
    null, filled, weakest = np.zeros((height, height)), 0, np.inf
    for own, mine, A, U, values, Vt in parts:
        rank = 0
        for value in values:
            rank += value > tolerance
        if rank:
            weakest = min(weakest, values[rank - 1])
        # The second time for the rounding of an ill-conditioned solution.
        for _ in range(2):
            for s in range(rank):
                part = 0.0
                for i in range(len(mine)):
                    part += U[i, s] * left[mine[i]]
                part /= values[s]
                for r in range(len(own)):
                    found[own[r]] += part * Vt[s, r]
            for i in range(len(mine)):
                total = right[mine[i]]
                for r in range(len(own)):
                    total -= A[i, r] * found[own[r]]
                left[mine[i]] = total
        for s in range(rank, len(own)):
            for r in range(len(own)):
                null[own[r], filled] = Vt[s, r]
            filled += 1
    sharpness = _SHARPEST
    if weakest < np.inf:
        sharpness = min(max(10.0 * tolerance / weakest, _SHARPEST), _BLUNTEST)
    sizes = np.empty(len(tau))
    for k in range(len(tau)):
        wrench = tree[owners[k]]
        sizes[k] = max(length * np.abs(wrench[:3]).max(), np.abs(wrench[3:]).max())
    for i in range(count):
        sizes[passive[i]] = max(sizes[passive[i]], abs(right[i]), abs(right[i] - left[i]))
    all_rows = sizes.max() if len(tau) else 0.0
    largest_of_loops(sizes, columns, column_starts)
    sizes += _ROUNDING * all_rows
    share = 0.0
    for i in range(count):
        # Of nothing if there are no forces at all.
        share = max(share, abs(left[i]) / sizes[passive[i]] if left[i] != 0.0 else 0.0)
    for r in range(height):
        # λ over row_scale is length times a force, for rows in metres.
        found[r] *= row_scale[r]
        for s in range(filled):
            null[r, s] *= row_scale[r] * length
    null = null[:, :filled].copy()
    return found, null, sharpness, left, sizes[passive], share, weakest


@kernel
def largest_of_loops(sizes: Any, columns: Any, starts: Any) -> None:
    """Give all coordinates of each block the largest of their sizes, shape (nv,): errors of one are in all."""
    for b in range(len(starts) - 1):
        largest = 0.0
        for k in columns[starts[b] : starts[b + 1]]:
            largest = max(largest, sizes[k])
        for k in columns[starts[b] : starts[b + 1]]:
            sizes[k] = largest


@kernel
def least(start: Any, null: Any, poses: Any, tree: Any, unit: Any, carried: Any, loops: Any, length: float) -> Any:
    """The λ = start + null z whose wrenches of all joints and closures have the least sum of squares.

    Moments count divided by the length. The normal equations do no harm: the closures' own wrenches alone make
    their matrix at least the identity.

    Parameters
    ----------
    start, null : ndarray
        What :func:`solutions` returns.
    poses, tree, unit, carried, loops
        As for :func:`exo_pin.chain.dynamics.equation_kernels.wrenches_of`.
    length : float
        Characteristic length, m.
    """
    count = null.shape[1]
    columns = np.empty((len(start), 1 + count))
    columns[:, 0] = start
    columns[:, 1:] = null
    wrenches = np.empty((6 * (len(poses) - 1 + len(loops[0])), 1 + count))
    wrenches_of(poses, tree, unit, carried, loops, columns, wrenches)
    matrix, z = np.zeros((count, count)), np.zeros(count)
    for i in range(len(wrenches)):
        weight = 1.0 if i % 6 < 3 else 1.0 / (length * length)
        for s in range(count):
            product = weight * wrenches[i, 1 + s]
            if product == 0.0:
                continue
            z[s] -= product * wrenches[i, 0]
            for t in range(s + 1):
                matrix[s, t] += product * wrenches[i, 1 + t]
    solve_cholesky(matrix, z)
    multipliers = start.copy()
    for r in range(len(start)):
        for s in range(count):
            multipliers[r] += null[r, s] * z[s]
    return multipliers


@kernel
def efforts_and_residual(
    J: Any, tau: Any, multipliers: Any, null: Any, passive: Any, unit: Any, sharpness: float
) -> Any:
    """Efforts, what is missing in the passive coordinates, and which efforts every solution shares.

    Parameters
    ----------
    J, tau, passive, null, sharpness
        As for :func:`solutions`.
    multipliers : ndarray
        λ, shape (rows,).
    unit : ndarray
        Shape (nv,), which takes generalised forces to N.
    """
    nv, height, count = len(tau), len(multipliers), null.shape[1]
    efforts, unique = tau.copy(), np.ones(nv, dtype=np.bool_)
    for k in range(nv):
        for r in range(height):
            efforts[k] -= J[r, k] * multipliers[r]
        for s in range(count):
            total = 0.0
            for r in range(height):
                total += J[r, k] * null[r, s]
            if abs(total) * unit[k] > sharpness:
                unique[k] = False
    residual = 0.0
    for k in passive:
        residual = max(residual, abs(efforts[k]))
        efforts[k] = 0.0
        unique[k] = True
    return efforts, residual, unique
