"""When a singular value of a constraint Jacobian counts as zero, and how well the configuration itself is known.

Closed to a residual r, a configuration is known to about r/σ, with σ the smallest singular value of the constraint
Jacobian that is not zero. Singular values are known no better, so next to a singular configuration, where σ² is no
longer large against r, forces and accelerations depend on rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...core.validation import FloatArray

__all__ = ["RESOLVED", "configuration_error", "rank_tolerance", "self_consistent_error"]

_ROUNDING = float(np.finfo(float).eps)
#: Relative error of a singular value up to which forces and accelerations are computed.
RESOLVED = 1e-3


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
    return max(shape[0], shape[1]) * largest * (joints * _ROUNDING + residual)


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
    return max(residual, joints * _ROUNDING) / float(values[count - 1]) if count else 0.0


def self_consistent_error(J: FloatArray, joints: int, residual: float) -> float:
    """Error of a closed configuration if singular values no larger than their own error count as zero.

    Parameters
    ----------
    J : ndarray
        Shape (rows, nv), the scaled constraint Jacobian.
    joints, residual
        As for :func:`configuration_error`.
    """
    if not J.size:
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
