"""Changes of efforts and multipliers along the closed loops, compiled; see :mod:`.dynamics_derivatives`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.pivoted_qr import pivoted_qr, reflect, solve_factored, solve_triangle
from ...numerics.small_linear import orthonormalise
from ..kinematics.rank import rank_tolerance
from .change_kernels import motion_changes


@kernel
def force_changes(
    by_q: Any, by_v: Any, M: Any, dq: Any, dv: Any, da: Any, along: Any, multipliers: Any, scales: Any, jacobian: Any,
    passive: Any, joints: int, gap: float, tau: Any, change: Any,
) -> None:  # fmt: skip
    """Changes of efforts and multipliers.

    They solve the equations of motion with the least sum of squares of what is missing in the coordinates without
    actuator, forces multiplied by the characteristic length; there the changes are those of what is missing. At the
    point itself nothing is. The pseudo-inverse of a matrix A of constant rank changes by itself and by how its null
    space turns: λ' = A⁺ (b' - A' λ) + (1 - A⁺ A) A'ᵀ A⁺ᵀ λ.

    Parameters
    ----------
    by_q, by_v, M : ndarray
        Shape (nv, nv), derivatives of the open tree's generalised forces with respect to q, v and a.
    dq, dv, da, along, jacobian, scales
        As for :func:`.change_kernels.motion_changes`.
    multipliers : ndarray
        λ, shape (rows,), the least in the metric "closures".
    passive : ndarray of int
        Coordinates without actuator.
    joints, gap
        As for :func:`exo_pin.chain.kinematics.rank.rank_tolerance`.
    tau, change : ndarray
        Shapes (nv, 3 d) and (rows, 3 d), filled.
    """
    row_scale, column, _ = scales
    (height, nv), d, m = jacobian.shape, len(along), len(passive)
    tau[:] = by_q @ dq + by_v @ dv + M @ da
    for k in range(d):
        for i in range(nv):
            for r in range(height):
                tau[i, k] -= along[k, r, i] * multipliers[r]
    change[:] = 0.0
    A, longest = np.empty((height, m)), 0.0
    for r in range(height):
        total = 0.0
        for i in range(m):
            A[r, i] = jacobian[r, passive[i]] * row_scale[r] * column[passive[i]]
            total += A[r, i] * A[r, i]
        longest = max(longest, total)
    W, order = A.copy(), np.empty(height, dtype=np.int64)
    diagonal, half = np.empty(min(height, m)), np.empty(min(height, m))
    tolerance = rank_tolerance((m, height), np.sqrt(longest), joints, gap)
    rank = pivoted_qr(W, np.ones(height, dtype=np.bool_), order, tolerance, diagonal, half)
    free = height - rank
    N, upper = np.zeros((height, free)), np.empty((free, free))
    for s in range(free):
        solve_triangle(W, diagonal, rank, W[rank + s])
        for i in range(rank):
            N[order[i], s] = -W[rank + s, i]
        N[order[rank + s], s] = 1.0
    orthonormalise(N, upper, free)
    # A⁺ᵀ λ = Q R⁻ᵀ λ of the columns that were taken.
    tall, b, x, turned = np.zeros(max(m, height)), np.empty(m), np.empty(height), np.empty(height)
    for i in range(rank):
        tall[i] = multipliers[order[i]] / row_scale[order[i]]
        for k in range(i):
            tall[i] -= W[i, k] * tall[k]
        tall[i] /= diagonal[i]
    for k in range(rank - 1, -1, -1):
        reflect(W, half, k, tall)
    for k in range(tau.shape[1]):
        for i in range(m):
            b[i] = column[passive[i]] * tau[passive[i], k]
        solve_factored(W, diagonal, half, rank, b)
        x[:] = 0.0
        for i in range(rank):
            x[order[i]] = b[i]
        turned[:] = x
        if k < d:
            for r in range(height):
                for i in range(m):
                    turned[r] -= along[k, r, passive[i]] * row_scale[r] * column[passive[i]] * tall[i]
        for s in range(free):
            out = 0.0
            for r in range(height):
                out += N[r, s] * turned[r]
            for r in range(height):
                x[r] -= out * N[r, s]
        for r in range(height):
            change[r, k] = row_scale[r] * x[r]
    for k in range(tau.shape[1]):
        for r in range(height):
            for i in range(nv):
                tau[i, k] -= jacobian[r, i] * change[r, k]
        if rank == m:
            # The loops carry whatever is needed in these coordinates, so that what is left is rounding.
            for i in passive:
                tau[i, k] = 0.0


@kernel
def changes(
    poses: Any, J: Any, v: Any, a: Any, q: Any, axes: Any, loops: Any, scales: Any, jacobian: Any, dependent: Any,
    G: Any, by_q: Any, by_v: Any, M: Any, multipliers: Any, passive: Any, joints: int, gap: float,
) -> Any:  # fmt: skip
    """Changes of motion, efforts and multipliers: :func:`.change_kernels.motion_changes` and :func:`force_changes`.

    Returns
    -------
    tuple
        Changes of q, v, a and efforts, shape (nv, 3 d); of multipliers, shape (rows, 3 d).
    """
    (height, nv), d = jacobian.shape, G.shape[1]
    moved, along, change = np.empty((4, nv, 3 * d)), np.empty((d, height, nv)), np.empty((height, 3 * d))
    dq, dv, da, tau = moved[0], moved[1], moved[2], moved[3]
    motion_changes(poses, J, v, a, q, axes, loops, scales, jacobian, dependent, G, dq, dv, da, along)
    force_changes(by_q, by_v, M, dq, dv, da, along, multipliers, scales, jacobian, passive, joints, gap, tau, change)
    return moved, change
