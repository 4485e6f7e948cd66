"""When a singular value of a constraint Jacobian counts as zero, and how well the configuration itself is known.

Closed to a residual r, a configuration is known to about r/σ, with σ the smallest singular value of the constraint
Jacobian that is not zero. Singular values are known no better, so next to a singular configuration, where σ² is no
longer large against r, forces and accelerations depend on rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.validation import FloatArray

ROUNDING = float(np.finfo(float).eps)
#: Relative error of a singular value up to which forces and accelerations are computed.
RESOLVED = 1e-3
#: Share of the forces that digits leave uncertain, from which it is said.
_WORTH_SAYING = 0.01


@kernel
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
def least_motion(J: Any, right: Any, scales: Any, joints: int, residual: float, freedoms: bool) -> Any:
    """The least x with J x = right, nearly so where that has no solution, and the motions with J x = 0.

    Least in the sum of squares with metres divided by the characteristic length, block by block.

    Parameters
    ----------
    J : ndarray
        Shape (rows, nv), the constraint Jacobian, not scaled.
    right : ndarray
        Shape (rows,).
    scales : tuple
        :attr:`exo_pin.chain.structure.topology.Topology.scales`: arrays of shapes (rows,) and (nv,), which take metres
        to characteristic lengths, and the blocks, as in :mod:`exo_pin.chain.structure.topology`.
    joints : int
        Number of joints of the tree.
    residual : float
        Largest scaled residual of the loops.
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


def digits_caution(geometry: float, values: NDArray[Any], tolerance: float) -> tuple[str, ...]:
    """What the digits of a geometry leave uncertain of the forces, in words, from one percent on.

    Parameters
    ----------
    geometry : float
        How well it is known, characteristic lengths and rad; 0 for an exact one.
    values : ndarray
        Singular values of the scaled equations of the forces, descending.
    tolerance : float
        Those at or below it count as zero.
    """
    rank = int(np.count_nonzero(values > tolerance))
    # Each row and column adds an error of its own.
    share = geometry * np.sqrt(rank) * float(values[0] / values[rank - 1]) if rank else 0.0
    if share < _WORTH_SAYING:
        return ()
    return (f"the digits of the geometry leave forces uncertain by about {min(100.0 * share, 100.0):.0f} %",)


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
