"""Acceleration in the null space of the closures, compiled, where no singular value is in doubt."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....core.compiled import kernel
from ...kinematics.kernels.dependent_kernels import nearest_motion
from .equation_kernels import missed, moving_loops

#: What :func:`clear_motion` knows: nothing for certain; the acceleration; that all motions of the tree have inertia.
DOUBTFUL, CLEAR, HEAVY = 0, 1, 2


@kernel
def _factor(A: Any) -> Any:
    """Replace the lower triangle of a symmetric matrix by its Cholesky factor.

    Returns
    -------
    tuple of float
        The least pivot, and the sum of squares of the factor's inverse, infinite if a pivot is not above zero. No pivot
        is smaller than the smallest eigenvalue, which is not smaller than one over that sum.
    """
    n, total, least = len(A), 0.0, math.inf
    for i in range(n):
        for j in range(i + 1):
            part = A[i, j]
            for k in range(j):
                part -= A[i, k] * A[j, k]
            if i == j:
                least = min(least, part)
                if not part > 0.0:
                    return least, math.inf
                A[i, i] = math.sqrt(part)
            else:
                A[i, j] = part / A[j, j]
    inverse = np.empty(n)
    for j in range(n):
        inverse[j] = 1.0 / A[j, j]
        total += inverse[j] * inverse[j]
        for i in range(j + 1, n):
            part = 0.0
            for k in range(j, i):
                part -= A[i, k] * inverse[k]
            inverse[i] = part / A[i, i]
            total += inverse[i] * inverse[i]
    return least, total


@kernel
def clear_motion(
    poses: Any, J: Any, dJ: Any, v: Any, loops: Any, q: Any, scales: Any, gap: Any, jacobian: Any, rate: Any,
    drift: Any, lower: Any, forces: Any, bounds: Any, projected: bool,
) -> Any:  # fmt: skip
    """Loops of a moving chain, and its acceleration a = a_0 + Z z with J Z = 0.

    Parameters
    ----------
    poses, J, dJ, v, loops, q, scales, gap, jacobian, rate, drift
        As for :func:`.equation_kernels.moving_loops`.
    lower : ndarray
        Shape (nv, nv), the lower half of the open tree's mass matrix.
    forces : ndarray
        Shape (nv,), what accelerates the open tree, N and N m.
    bounds : tuple of float
        Tolerance of the geometry, scaled, 0 for an exact one; the largest scaled residual of closed loops; the share of
        the largest inertia below which a motion has none.
    projected : bool
        Whether the acceleration is wanted also where every motion of the open tree has inertia.

    Returns
    -------
    tuple
        What :func:`.equation_kernels.moving_loops` returns, regular only where it is known from the projection;
        :data:`DOUBTFUL`, :data:`CLEAR` or :data:`HEAVY`; the
        acceleration, shape (nv,); what :func:`.equation_kernels.missed` returns for it.
    """
    worst, scaled, opening, speed, regular, finite = moving_loops(
        poses, J, dJ, v, loops, q, scales, gap, jacobian, rate, drift, False
    )
    found = worst, scaled, opening, speed, regular, finite
    row_scale, column, _ = scales
    tolerance, closed, massless = bounds
    nv, status, a = len(v), DOUBTFUL, np.zeros(len(v))
    M, trace, heaviest = np.empty((nv, nv)), 0.0, 0.0
    for i in range(nv):
        for k in range(i + 1):
            M[i, k] = M[k, i] = lower[i, k] * column[i] * column[k]
        trace, heaviest = trace + abs(M[i, i]), max(heaviest, abs(M[i, i]))
    if not projected:
        # The largest eigenvalue is between the largest entry of the diagonal and the trace.
        least, total = _factor(M.copy())
        if massless * trace * total < 1.0:
            return found, HEAVY, a, (0.0, 0.0, 0.0, True)
        if least > massless * heaviest:
            return found, DOUBTFUL, a, (0.0, 0.0, 0.0, True)
    if scaled <= closed or tolerance > 0.0:
        known = tolerance if tolerance > 0.0 else scaled
        start, basis, regular = nearest_motion(jacobian, -drift, scales, len(poses), known, True)
        count = basis.shape[1]
        A, z, push = np.zeros((count, count)), np.zeros(count), np.empty(nv)
        for i in range(nv):
            push[i] = column[i] * forces[i]
            for k in range(nv):
                push[i] -= M[i, k] * start[k] / column[k]
        trace = 0.0
        for s in range(count):
            for i in range(nv):
                z[s] += basis[i, s] * push[i]
                if basis[i, s] != 0.0:
                    for k in range(nv):
                        part = basis[i, s] * M[i, k]
                        for t in range(s + 1):
                            A[s, t] += part * basis[k, t]
            trace += A[s, s]
        _, total = _factor(A)
        if massless * max(trace, heaviest) * total < 1.0:
            status = CLEAR
            for i in range(count):
                for k in range(i):
                    z[i] -= A[i, k] * z[k]
                z[i] /= A[i, i]
            for i in range(count - 1, -1, -1):
                for k in range(i + 1, count):
                    z[i] -= A[k, i] * z[k]
                z[i] /= A[i, i]
            for i in range(nv):
                a[i] = start[i]
                for s in range(count):
                    a[i] += column[i] * basis[i, s] * z[s]
    found = worst, scaled, opening, speed, regular, finite
    return found, status, a, missed(jacobian, drift, a, row_scale, column)
