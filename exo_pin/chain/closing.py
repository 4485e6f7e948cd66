"""Closing the loops: damped Gauss-Newton on the configuration manifold, the least movement at every step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numba import njit

from ..errors import LoopNotClosed
from ..validation import FloatArray

if TYPE_CHECKING:
    from .model import ClosedChain

__all__ = ["close"]

#: Damping relative to the scaled gap. It has to vanish with the gap, so that the last steps are Newton's, but no
#: faster: redundant closures contradict each other in proportion to the square of the gap, and undamped they would
#: be obeyed by moves of the order of the gap along what should stay put.
_DAMPING = 1e-2
#: Least damping, so that the matrix of redundant closures stays positive definite in rounded arithmetic.
_LEAST_DAMPING = 1e-13
#: Damping at which no step helps any more.
_MOST_DAMPING = 1e6


def close(
    chain: ClosedChain, q: FloatArray, weight: FloatArray, tolerance: float, iterations: int
) -> tuple[FloatArray, int]:
    """Move q to a closed configuration; see :meth:`ClosedChain.close`.

    Parameters
    ----------
    chain : ClosedChain
        The chain.
    q : ndarray
        Shape (nq,), where to start.
    weight : ndarray
        Shape (nv,), mobility of each coordinate: 0 for held ones, the squared characteristic length for metres.
    tolerance : float
        Largest residual of a closed loop, m and rad.
    iterations : int
        At most so many linearisations.

    Returns
    -------
    tuple of ndarray and int
        The closed configuration and how many steps it took.
    """
    work, top = chain._workspace, chain._topology
    scale = top.row_scale
    worst = work.linearise(q)
    if worst <= tolerance:
        return q, 0
    gap, jacobian, move = work.gap, work.jacobian, work.move
    size = float(np.linalg.norm(scale * gap))
    factor, count = 1.0, 0
    for count in range(1, iterations + 1):
        _step(jacobian, gap, scale, weight, max(_DAMPING * factor * size, _LEAST_DAMPING), move)
        trial = pin.integrate(chain.model, q, move)
        worst_there = work.linearise(trial)
        size_there = float(np.linalg.norm(scale * gap))
        if worst_there <= tolerance:
            return trial, count
        if size_there < size:
            # A good step earns less damping, a poor one more.
            factor *= 0.3 if size_there < 0.25 * size else 3.0 if size_there > 0.75 * size else 1.0
            q, size, worst = trial, size_there, worst_there
            continue
        factor *= 10.0
        if factor * size * _DAMPING > _MOST_DAMPING or not math.isfinite(size):
            break
        work.linearise(q)
    raise LoopNotClosed(q.copy(), worst, count)


@njit(cache=True, error_model="numpy")
def _step(jacobian: Any, gap: Any, row_scale: Any, weight: Any, damping: float, out: Any) -> None:
    """Fill the damped least step towards a closed configuration.

    Minimises |D (J x + r)|² + damping |x|²_{W⁻¹} with D = diag(row_scale), W = diag(weight): x = W Jᵀ D y with
    (D J W Jᵀ D + damping I) y = -D r, solved by Cholesky. A coordinate of weight 0 is held.

    Parameters
    ----------
    jacobian, gap : ndarray
        Shape (rows, nv) and (rows,).
    row_scale, weight : ndarray
        Shape (rows,) and (nv,).
    damping : float
        Above zero, relative to the mean of the matrix's diagonal.
    out : ndarray
        Shape (nv,), filled.
    """
    n, nv = jacobian.shape
    A, y = np.empty((n, n)), np.empty(n)
    trace = 0.0
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for k in range(nv):
                total += jacobian[i, k] * jacobian[j, k] * weight[k]
            A[i, j] = total * row_scale[i] * row_scale[j]
        trace += A[i, i]
        y[i] = -row_scale[i] * gap[i]
    shift = damping * trace / n
    for i in range(n):
        A[i, i] += shift
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = math.sqrt(total) if i == j else total / A[j, j]
        total = y[i]
        for k in range(i):
            total -= A[i, k] * y[k]
        y[i] = total / A[i, i]
    for i in range(n - 1, -1, -1):
        total = y[i]
        for k in range(i + 1, n):
            total -= A[k, i] * y[k]
        y[i] = total / A[i, i]
    for k in range(nv):
        total = 0.0
        for i in range(n):
            total += jacobian[i, k] * row_scale[i] * y[i]
        out[k] = weight[k] * total
