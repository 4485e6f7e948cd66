"""The least of all multipliers that make a motion, and the efforts that go with multipliers, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....numerics.small_linear import solve_cholesky
from .equation_kernels import wrenches_of


@kernel
def least(start: Any, null: Any, poses: Any, tree: Any, unit: Any, carried: Any, loops: Any, length: float) -> Any:
    """The λ = start + null z whose wrenches of all joints and closures have the least sum of squares.

    Moments count divided by the length. The normal equations do no harm: the closures' own wrenches alone make
    their matrix at least the identity.

    Parameters
    ----------
    start, null : ndarray
        What :func:`.solution_kernels.solutions` returns.
    poses, tree, unit, carried, loops
        As for :func:`exo_pin.chain.dynamics.equations.equation_kernels.wrenches_of`.
    length : float
        Characteristic length, m.
    """
    count = null.shape[1]
    columns = np.empty((len(start), 1 + count))
    columns[:, 0] = start
    columns[:, 1:] = null
    wrenches = np.empty((6 * (len(poses) - 1 + len(loops[0])), 1 + count))
    wrenches_of(poses, tree, unit, carried, loops, columns, 0, wrenches)
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

    Parameters are those of :func:`fill_efforts`.
    """
    efforts, unique = np.empty(len(tau)), np.empty(len(tau), dtype=np.bool_)
    residual = fill_efforts(J, tau, multipliers, null, passive, unit, sharpness, efforts, unique)
    return efforts, residual, unique


@kernel(inline=True)
def fill_efforts(
    J: Any, tau: Any, multipliers: Any, null: Any, passive: Any, unit: Any, sharpness: float, efforts: Any, unique: Any
) -> float:
    """Fill the efforts and which of them every solution shares; the largest that is missing where there is no actuator.

    Parameters
    ----------
    J, tau, passive, null, sharpness
        As for :func:`.solution_kernels.solutions`.
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
