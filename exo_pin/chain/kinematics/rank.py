"""When a singular value of a constraint Jacobian counts as zero, and how well the configuration itself is known.

Closed to a residual r, a configuration is known to about r/σ, with σ the smallest singular value of the constraint
Jacobian that is not zero. Singular values are known no better, so next to a singular configuration, where σ² is no
longer large against r, forces and accelerations depend on rounding.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...core.validation import FloatArray

ROUNDING = float(np.finfo(float).eps)
#: Relative error of a singular value up to which forces and accelerations are computed.
RESOLVED = 1e-3


@kernel(fills=True)
def rank_tolerance(shape: Any, largest: float, joints: int, residual: float) -> float:
    """Singular values of a scaled constraint Jacobian that may be zero.

    A perturbation E of a matrix moves its singular values by at most |E|₂ <= max(shape) max|E_ij|. Entries of the
    scaled Jacobian are of order one times ``largest``. They carry one rounding per joint on their path, and the
    configuration itself is off by the loops' residual, which they follow to first order.

    Parameters
    ----------
    shape : tuple of int
        Of the matrix.
    largest : float
        Its largest singular value.
    joints : int
        Number of joints of the tree.
    residual : float
        Largest scaled residual of the loops.
    """
    return max(shape[0], shape[1]) * largest * (joints * ROUNDING + residual)


@kernel
def is_clearly_regular(J: Any, scales: Any, joints: int, residual: float) -> bool:
    """Whether forces and accelerations at a configuration are certain not to depend on rounding.

    True means that :func:`configuration_error` times the largest singular value is at most :data:`RESOLVED` of the
    smallest one that is not zero. False means nothing: then the singular values decide. Each block is factored by
    Gram-Schmidt on its rows with pivoting. The rows that were chosen bound the block's smallest singular value that is
    not zero from below, by the norm of the inverse of their triangle; those left over bound the ones that are zero from
    above; the Frobenius norm bounds the largest.

    Parameters
    ----------
    J : ndarray
        Shape (rows, nv), the constraint Jacobian, not scaled.
    scales : tuple
        :attr:`exo_pin.chain.structure.topology.Topology.scales`: arrays of shapes (rows,) and (nv,), which take metres
        to characteristic lengths, and the blocks, as in :mod:`exo_pin.chain.structure.topology`.
    joints : int
        Number of joints of the tree.
    residual : float
        Largest scaled residual of the loops.
    """
    row_scale, column, (rows, columns, row_starts, column_starts) = scales
    longest, largest, weakest, height, width = 0.0, 0.0, math.inf, 0, 0
    for b in range(len(row_starts) - 1):
        height = max(height, row_starts[b + 1] - row_starts[b])
        width = max(width, column_starts[b + 1] - column_starts[b])
    W, R, norms, inverse = np.empty((height, width)), np.empty((height, height)), np.empty(height), np.empty(height)
    # Of every row the span that is not zero: rows of distant loops do not meet.
    first, last = np.empty(height, dtype=np.int64), np.empty(height, dtype=np.int64)
    for b in range(len(row_starts) - 1):
        m, n = row_starts[b + 1] - row_starts[b], column_starts[b + 1] - column_starts[b]
        whole = 0.0
        R[:m, :m] = 0.0
        for i in range(m):
            r = rows[row_starts[b] + i]
            first[i], last[i], norms[i] = n, 0, 0.0
            for k in range(n):
                c = columns[column_starts[b] + k]
                W[i, k] = J[r, c] * row_scale[r] * column[c]
                if W[i, k] != 0.0:
                    first[i], last[i] = min(first[i], k), k + 1
                    norms[i] += W[i, k] * W[i, k]
            whole += norms[i]
            longest = max(longest, norms[i])
        if not math.isfinite(whole):
            return False
        largest = max(largest, whole)
        zero = (0.5 * rank_tolerance(J.shape, math.sqrt(longest), joints, residual)) ** 2
        rank = 0
        while rank < m:
            rest, p = 0.0, rank
            for i in range(rank, m):
                rest += norms[i]
                if norms[i] > norms[p]:
                    p = i
            if not rest > zero:
                break
            for k in range(n):
                W[rank, k], W[p, k] = W[p, k], W[rank, k]
            for s in range(rank):
                R[s, rank], R[s, p] = R[s, p], R[s, rank]
            first[rank], first[p] = first[p], first[rank]
            last[rank], last[p] = last[p], last[rank]
            size = math.sqrt(norms[p])
            norms[p] = norms[rank]
            R[rank, rank] = size
            for i in range(rank + 1, m):
                if first[i] >= last[rank] or first[rank] >= last[i]:
                    continue
                along = 0.0
                for k in range(first[rank], last[rank]):
                    along += W[rank, k] * W[i, k]
                along /= size
                R[rank, i] = along
                first[i], last[i] = min(first[i], first[rank]), max(last[i], last[rank])
                norms[i] = 0.0
                for k in range(first[rank], last[rank]):
                    W[i, k] -= along / size * W[rank, k]
                for k in range(first[i], last[i]):
                    norms[i] += W[i, k] * W[i, k]
            rank += 1
        total = 0.0
        for j in range(rank):
            # The inverse of the triangle, column by column.
            inverse[j] = 1.0 / R[j, j]
            total += inverse[j] * inverse[j]
            for i in range(j - 1, -1, -1):
                part = 0.0
                for k in range(i + 1, j + 1):
                    part -= R[i, k] * inverse[k]
                inverse[i] = part / R[i, i]
                total += inverse[i] * inverse[i]
        if rank:
            weakest = min(weakest, 1.0 / math.sqrt(total))
    most = math.sqrt(largest)
    error = max(residual, joints * ROUNDING) * most
    return error <= RESOLVED * weakest * weakest and 2.0 * rank_tolerance(J.shape, most, joints, residual) < weakest


@kernel
def least_motion(J: Any, right: Any, scales: Any, joints: int, residual: float, freedoms: bool) -> Any:
    """The least x with J x = right, nearly so where that has no solution, and the motions with J x = 0.

    Least in the sum of squares with metres divided by the characteristic length, block by block.

    Parameters
    ----------
    J, scales, joints, residual
        As for :func:`is_clearly_regular`.
    right : ndarray
        Shape (rows,).
    freedoms : bool
        Whether the motions are wanted.

    Returns
    -------
    x : ndarray
        Shape (nv,).
    motions : ndarray
        Shape (nv, k), orthonormal after metres are divided by the characteristic length, as they are; k = 0 if not
        wanted.
    """
    row_scale, column, (rows, columns, row_starts, column_starts) = scales
    nv, parts, largest = len(column), [], 0.0
    moved = np.zeros(nv, dtype=np.bool_)
    for b in range(len(row_starts) - 1):
        own, mine = rows[row_starts[b] : row_starts[b + 1]], columns[column_starts[b] : column_starts[b + 1]]
        if not len(mine):
            continue
        A = np.empty((len(own), len(mine)))
        for i in range(len(own)):
            for k in range(len(mine)):
                A[i, k] = J[own[i], mine[k]] * row_scale[own[i]] * column[mine[k]]
        # V is needed whole, for the motions; U is not.
        U, values, Vt = np.linalg.svd(A, freedoms and len(own) < len(mine))
        largest = max(largest, values[0])
        moved[mine] = True
        parts.append((own, mine, U, values, Vt))
    tolerance = rank_tolerance(J.shape, largest, joints, residual)
    x, motions, filled = np.zeros(nv), np.zeros((nv, nv if freedoms else 0)), 0
    for own, mine, U, values, Vt in parts:
        rank = 0
        for value in values:
            rank += value > tolerance
        for s in range(rank):
            part = 0.0
            for i in range(len(own)):
                part += U[i, s] * row_scale[own[i]] * right[own[i]]
            for k in range(len(mine)):
                x[mine[k]] += column[mine[k]] * Vt[s, k] * part / values[s]
        if freedoms:
            for s in range(rank, len(mine)):
                for k in range(len(mine)):
                    motions[mine[k], filled] = Vt[s, k]
                filled += 1
    if freedoms:
        for k in range(nv):
            if not moved[k]:
                motions[k, filled] = 1.0
                filled += 1
    return x, motions[:, :filled].copy()


def configuration_error(values: FloatArray, tolerance: float, joints: int, residual: float) -> float:
    """Error of a closed configuration, characteristic lengths and rad.

    Parameters
    ----------
    values : ndarray
        Singular values of the scaled constraint Jacobian, descending.
    tolerance : float
        Those at or below it count as zero.
    joints : int
        Number of joints of the tree.
    residual : float
        Largest scaled residual of the loops.
    """
    count = int(np.count_nonzero(values > tolerance))
    return max(residual, joints * ROUNDING) / float(values[count - 1]) if count else 0.0


def self_consistent_error(J: FloatArray, joints: int, residual: float) -> float:
    """Error of a closed configuration if singular values no larger than their own error count as zero.

    Parameters
    ----------
    J : ndarray
        Shape (rows, nv), the scaled constraint Jacobian.
    joints, residual
        As for :func:`configuration_error`.
    """
    # Rows may hold nothing, as of two hinges about one line.
    if not J.any():
        return 0.0
    values = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
    largest = float(values[0])
    tolerance = rank_tolerance(J.shape, largest, joints, residual)
    while error := configuration_error(values, tolerance, joints, residual):
        least = float(values[np.count_nonzero(values > tolerance) - 1])
        if least > error * largest:
            break
        tolerance = least
    return max(error, tolerance / largest)
