"""All multipliers that make a motion, compiled.

The least of all multipliers that make a motion, and the efforts that go with multipliers, compiled.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....numerics.small_linear import (
    copy_numbers,
    orthonormalise,
    pivoted_qr,
    solve_cholesky,
    solve_factored,
    solve_triangle,
)
from ...kinematics.rank import rank_tolerance
from .equation_kernels import wrenches_of

#: No component is called undetermined for less than this share of a self-stress, nor unique for more.
_SHARPEST, _BLUNTEST = 1e-10, 1e-6
#: A light link's forces have errors of rounding of the heaviest link's, a share of 1e-13 of these.
_ROUNDING = 1e-6


@kernel
def new_memory(height: int, nv: int, count: int) -> Any:
    """Numbers, indices and flags for :func:`fill_solutions`, which makes no array: rows, nv, passive coordinates."""
    numbers = np.empty(2 * height * (count + height + 1) + height + 2 * count)
    return numbers, np.empty(nv + count + height, dtype=np.int64), np.ones(max(height, nv), dtype=np.bool_)


@kernel(inline=True)
def fill_solutions(
    J: Any, tau: Any, tree: Any, owners: Any, passive: Any, scales: Any, length: float, gap: float, memory: Any,
    found: Any, left: Any, sizes: Any, null: Any,
) -> Any:  # fmt: skip
    """All λ with tau - Jᵀλ = 0 in the passive coordinates.

    The loops of each block are solved by themselves, so that a robot of many loops takes as many small factorisations.

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
        As for :func:`exo_pin.chain.kinematics.rank.least_motion`.
    length : float
        Characteristic length, m.
    gap : float
        Largest scaled residual of the loops.
    memory : tuple of ndarray
        What :func:`new_memory` makes.
    found, left, sizes, null : ndarray
        Shapes (rows,), (passive,), (nv,) and (rows, rows), filled: the λ of least sum of squares of forces and of
        moments over the length; what is missing, and the forces with which it compares, N m (scaled); self-stresses in
        the first columns, orthonormal in that metric.

    Returns
    -------
    tuple
        The number of self-stresses; the share of one that is rounding; the largest share that is missing; a lower bound
        of the equations' smallest singular value that is not zero, which is at most their number times that; infinite
        if there is none.
    """
    row_scale, column, (rows, columns, row_starts, column_starts) = scales
    count, height, blocks_count, nv = len(passive), len(row_scale), len(row_starts) - 1, len(tau)
    numbers, indices, _ = memory
    right, is_passive, mine = numbers[:count], indices[:nv], indices[nv : nv + count]
    for k in range(nv):
        is_passive[k] = 0
    for i in range(count):
        right[i] = left[i] = column[passive[i]] * tau[passive[i]]
        is_passive[passive[i]] = 1 + i
    largest = 0.0
    for r in range(height):
        total, found[r] = 0.0, 0.0
        for s in range(height):
            null[r, s] = 0.0
        for i in range(count):
            entry = J[r, passive[i]] * row_scale[r] * column[passive[i]]
            total += entry * entry
        largest = max(largest, total)
    tolerance = rank_tolerance((count, height), math.sqrt(largest), len(tree), gap)
    filled, weakest = 0, math.inf
    for b in range(blocks_count):
        own, m = rows[row_starts[b] : row_starts[b + 1]], 0
        for k in columns[column_starts[b] : column_starts[b + 1]]:
            if is_passive[k]:
                mine[m] = is_passive[k] - 1
                m += 1
        A = numbers[count : count + len(own) * m].reshape((len(own), m))
        for r in range(len(own)):
            for i in range(m):
                A[r, i] = J[own[r], passive[mine[i]]] * row_scale[own[r]] * column[passive[mine[i]]]
        rank, least_value = _solve_block(own, mine[:m], A, right, tolerance, memory, found, left, null, filled)
        weakest = min(weakest, least_value)
        filled += len(own) - rank
    # Loops of an exact geometry are closed to 1e-8; the self-stresses of a rounded one are known no better than it.
    sharpness = min(max(10.0 * tolerance / weakest, _SHARPEST), _BLUNTEST if gap <= 1e-8 else 0.1)
    for k in range(nv):
        j, sizes[k] = owners[k], 0.0
        for i in range(3):
            sizes[k] = max(sizes[k], length * abs(tree[j, i]), abs(tree[j, 3 + i]))
    for i in range(count):
        sizes[passive[i]] = max(sizes[passive[i]], abs(right[i]), abs(right[i] - left[i]))
    all_rows = 0.0
    for k in range(nv):
        all_rows = max(all_rows, sizes[k])
    largest_of_loops(sizes, columns, column_starts)
    share = 0.0
    for k in range(nv):
        sizes[k] += _ROUNDING * all_rows
    for i in range(count):
        # Of nothing if there are no forces at all.
        share = max(share, abs(left[i]) / sizes[passive[i]] if left[i] != 0.0 else 0.0)
    for r in range(height):
        # λ over row_scale is length times a force, for rows in metres.
        found[r] *= row_scale[r]
        for s in range(filled):
            null[r, s] *= row_scale[r] * length
    return filled, sharpness, share, weakest


@kernel(inline=True)
def fill_factored(
    A: Any, tolerance: float, allowed: Any, W: Any, order: Any, diagonal: Any, half: Any, N: Any, U: Any
) -> int:
    """Pivoted QR of equations' columns, shape (n, m), one λ after the other, and the λ that make nothing.

    W, diagonal and half have what :func:`~exo_pin.numerics.small_linear.pivoted_qr` leaves of the columns, ``order``
    their order, and the first columns of N, shape (n, n) as U, the orthonormal λ. The rank is returned.
    """
    n, m = A.shape
    for r in range(n):
        for i in range(m):
            W[r, i] = A[r, i]
    rank = pivoted_qr(W, allowed, order, tolerance, diagonal, half)
    for s in range(n - rank):
        solve_triangle(W, diagonal, rank, W[rank + s])
        for i in range(n):
            N[i, s] = 0.0
        for i in range(rank):
            N[order[i], s] = -W[rank + s, i]
        N[order[rank + s], s] = 1.0
    orthonormalise(N, U, n - rank)
    return rank


@kernel(inline=True)
def _solve_block(
    own: Any,
    mine: Any,
    A: Any,
    right: Any,
    tolerance: float,
    memory: Any,
    found: Any,
    left: Any,
    null: Any,
    filled: int,
) -> Any:
    """The least λ of a block and its self-stresses, from one pivoted QR.

    Parameters
    ----------
    own, mine : ndarray of int
        The block's rows, and its places among the passive coordinates.
    A : ndarray
        Shape (len(own), len(mine)), the equations' columns, scaled; one λ after the other. A window on the memory.
    right : ndarray
        The equations' right sides, scaled, at the memory's start.
    tolerance : float
        Columns no longer than this are rounding.
    memory : tuple
        As for :func:`fill_solutions`.
    found, left, null : ndarray
        λ, what is missing, and self-stresses, filled from column ``filled`` on.

    Returns
    -------
    tuple
        The rank, and a lower bound of the smallest singular value that is not zero, by the triangle's inverse.
    """
    numbers, indices, allowed = memory
    n, m = len(own), len(mine)
    order, first = indices[len(indices) - n :], len(right) + n * m
    W, second = numbers[first : first + n * m].reshape((n, m)), first + n * m
    N, third = numbers[second : second + n * n].reshape((n, n)), second + n * n
    U, fourth = numbers[third : third + n * n].reshape((n, n)), third + n * n
    each, last = numbers[fourth : fourth + 3 * n].reshape((3, n)), fourth + 3 * n
    diagonal, half, x, b = each[0], each[1], each[2], numbers[last : last + m]
    rank = fill_factored(A, tolerance, allowed[:n], W, order, diagonal, half, N, U)
    free = n - rank
    for s in range(free):
        for r in range(n):
            null[own[r], filled + s] = N[r, s]
    for r in range(n):
        x[r] = 0.0
    # The second time for the rounding of an ill-conditioned solution.
    for _ in range(2):
        for i in range(m):
            b[i] = left[mine[i]]
        solve_factored(W, diagonal, half, rank, b)
        for i in range(rank):
            x[order[i]] += b[i]
        for s in range(free):
            along = 0.0
            for r in range(n):
                along += N[r, s] * x[r]
            for r in range(n):
                x[r] -= along * N[r, s]
        for i in range(m):
            total = right[mine[i]]
            for r in range(n):
                total -= A[r, i] * x[r]
            left[mine[i]] = total
    for r in range(n):
        found[own[r]] = x[r]
    inverse, total = b[:rank], 0.0
    for j in range(rank):
        for i in range(rank):
            inverse[i] = 1.0 if i == j else 0.0
        solve_triangle(W, diagonal, rank, inverse)
        for i in range(rank):
            total += inverse[i] * inverse[i]
    return rank, 1.0 / math.sqrt(total) if rank else math.inf


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
        What :func:`fill_solutions` fills.
    poses, tree, unit, carried, loops
        As for :func:`exo_pin.chain.dynamics.equations.equation_kernels.wrenches_of`.
    length : float
        Characteristic length, m.
    """
    count = null.shape[1]
    columns = np.empty((len(start), 1 + count))
    for r in range(len(start)):
        columns[r, 0] = start[r]
        copy_numbers(null[r], columns[r, 1:])
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


@kernel(inline=True)
def fill_efforts(
    J: Any, tau: Any, multipliers: Any, null: Any, passive: Any, unit: Any, sharpness: float, efforts: Any, unique: Any
) -> float:
    """Fill the efforts and which of them every solution shares; the largest that is missing where there is no actuator.

    Parameters
    ----------
    J, tau, passive, null, sharpness
        As for :func:`fill_solutions`.
    multipliers : ndarray
        λ, shape (rows,).
    unit : ndarray
        Shape (nv,), which takes generalised forces to N.
    efforts, unique : ndarray
        Shape (nv,), filled.
    """
    nv, height, count = len(tau), len(multipliers), null.shape[1]
    for k in range(nv):
        efforts[k], unique[k] = tau[k], True
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
    return residual
