"""When a singular value of a constraint Jacobian counts as zero."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

__all__ = ["rank_tolerance"]

_ROUNDING = float(np.finfo(float).eps)


@njit(cache=True, error_model="numpy")
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
