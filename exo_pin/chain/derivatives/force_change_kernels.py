"""Changes of efforts and multipliers along the closed loops, compiled; see :mod:`.dynamics_derivatives`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.small_linear import copy_numbers, solve_factored, solve_transposed
from ..dynamics.equations.equation_kernels import split_terms
from ..dynamics.equations.motion_kernels import NUMBERS, ORDINARY, fill_forces, forces_size, is_certain, new_room
from ..dynamics.equations.solution_kernels import fill_factored
from ..kinematics.kernels.dependent_kernels import reduced_motion
from ..kinematics.rank import rank_tolerance
from ..structure.memory.chain_buffers import unpacked_constants
from .change_kernels import motion_changes, new_change_memory


@kernel
def force_changes(
    moved: Any, along: Any, multipliers: Any, scales: Any, jacobian: Any, passive: Any, joints: int, gap: float,
    change: Any,
) -> None:  # fmt: skip
    """Changes of the multipliers, and of the efforts with them.

    They solve the equations of motion with the least sum of squares of what is missing in the coordinates without
    actuator, forces multiplied by the characteristic length; there the changes are those of what is missing. At the
    point itself nothing is. The pseudo-inverse of a matrix A of constant rank changes by itself and by how its null
    space turns: λ' = A⁺ (b' - A' λ) + (1 - A⁺ A) A'ᵀ A⁺ᵀ λ.

    Parameters
    ----------
    moved : ndarray
        Shape (4, 3, nv, d), what :func:`.change_kernels.motion_changes` fills, and the changes of the efforts with
        constant multipliers, filled.
    along, scales
        As for :func:`.change_kernels.motion_changes`.
    multipliers : ndarray
        λ, shape (rows,), the least in the metric "closures".
    jacobian : ndarray
        Shape (rows, nv).
    passive : ndarray of int
        Coordinates without actuator.
    joints, gap
        As for :func:`exo_pin.chain.kinematics.rank.rank_tolerance`.
    change : ndarray
        Shape (3, rows, d), zeros, of the multipliers, filled.
    """
    row_scale, column, _ = scales
    (height, nv), d, m, tau = jacobian.shape, len(along), len(passive), moved[3]
    A, longest = np.empty((height, m)), 0.0
    for r in range(height):
        total = 0.0
        for i in range(m):
            A[r, i] = jacobian[r, passive[i]] * row_scale[r] * column[passive[i]]
            total += A[r, i] * A[r, i]
        longest = max(longest, total)
    tolerance = rank_tolerance((m, height), np.sqrt(longest), joints, gap)
    W, N, U = np.empty((height, m)), np.empty((height, height)), np.empty((height, height))
    order, diagonal, half = np.empty(height, dtype=np.int64), np.empty(height), np.empty(height)
    rank = fill_factored(A, tolerance, np.ones(height, dtype=np.bool_), W, order, diagonal, half, N, U)
    free = height - rank
    # A⁺ᵀ λ = Q R⁻ᵀ λ of the columns that were taken.
    tall, b, x, turned = np.zeros(max(m, height)), np.empty(m), np.empty(height), np.empty(height)
    for i in range(rank):
        tall[i] = multipliers[order[i]] / row_scale[order[i]]
    solve_transposed(W, diagonal, half, rank, tall)
    for n in range(3 * d if rank > 0 else 0):
        kind, k = n // d, n % d
        for i in range(m):
            b[i] = column[passive[i]] * tau[kind, passive[i], k]
        solve_factored(W, diagonal, half, rank, b)
        x[:] = 0.0
        for i in range(rank):
            x[order[i]] = b[i]
        copy_numbers(x, turned)
        if kind == 0:
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
            change[kind, r, k] = row_scale[r] * x[r]
            for i in range(nv):
                tau[kind, i, k] -= jacobian[r, i] * change[kind, r, k]
        if rank == m:
            # The loops carry whatever is needed in these coordinates, so that what is left is rounding.
            for i in passive:
                tau[kind, i, k] = 0.0


@kernel
def open_changes(trees: Any, along: Any, multipliers: Any, moved: Any) -> None:
    """Fill the changes of the efforts with constant multipliers; those of q with v and a, and of v with a, are zero."""
    by_q, by_v, lower = trees
    (d, height, nv), dq, dv, da, tau = along.shape, moved[0, 0], moved[1], moved[2], moved[3]
    for i in range(nv):
        for j in range(nv):
            first, second, third = by_q[i, j], by_v[i, j], lower[max(i, j), min(i, j)]
            for k in range(d):
                tau[0, i, k] += first * dq[j, k] + second * dv[0, j, k] + third * da[0, j, k]
                tau[1, i, k] += second * dq[j, k] + third * da[1, j, k]
                tau[2, i, k] += third * dq[j, k]
    for k in range(d):
        for r in range(height):
            for i in range(nv):
                tau[0, i, k] -= along[k, r, i] * multipliers[r]


@kernel
def derivatives_of_motion(
    poses: Any, J: Any, dJ: Any, motion: Any, trees: Any, constants: Any, rate: Any, forces: Any, local: bool,
    tau: Any, passive: Any, given: Any, tolerance: float,
) -> Any:  # fmt: skip
    """Forces of a motion without bounds, and their derivatives along the closed loops.

    Parameters
    ----------
    poses, J, dJ, rate, forces, local, tau, passive, tolerance
        As for :func:`~..dynamics.equations.motion_kernels.forces_of_state`.
    motion : ndarray
        q, v and a, one behind the other.
    trees : tuple of ndarray
        Shape (nv, nv), derivatives of the open tree's generalised forces with respect to q, v and a, of the last the
        lower half.
    constants : tuple of ndarray
        As :func:`exo_pin.chain.structure.memory.chain_buffers.packed_constants` packs them.
    given : ndarray of int
        Independent coordinates; chosen if there are none.

    Returns
    -------
    flat, unique, numbers : ndarray
        What :func:`~..dynamics.equations.motion_kernels.forces_of_state` fills.
    moved, change : ndarray
        As for :func:`force_changes`.
    own, choice
        As of :func:`exo_pin.chain.kinematics.kernels.dependent_kernels.reduced_motion`.
    certain : bool
        Whether nothing has to be refused, see :func:`~..dynamics.equations.motion_kernels.is_certain`.
    """
    loops, scales, bodies, axes = unpacked_constants(constants[0], constants[1])
    (height, nv), joints, count, nq = rate.shape, len(poses), len(passive), len(motion) - 2 * len(tau)
    q, v, a = motion[:nq], motion[nq : nq + nv], motion[nq + nv :]
    flat, unique, numbers = np.zeros(forces_size(height, nv, joints)), np.empty(nv, dtype=np.bool_), np.empty(NUMBERS)
    terms, room, extent = split_terms(flat, (height, nv, joints)), new_room(height, nv, count), 0.0
    fill_forces(
        poses, J, dJ, forces, local, v, a, True, tau, q, loops, scales, bodies, passive, tolerance, rate, flat, terms,
        unique, numbers, room,
    )  # fmt: skip
    gap, (jacobian, _, _, _, _), multipliers = tolerance if tolerance > 0.0 else numbers[1], terms, room[1][2]
    own, Z, order, factors, choice = reduced_motion(jacobian, given, scales, joints, gap)
    moved, change, along = (
        np.zeros((4, 3, nv, len(own))), np.zeros((3, height, len(own))), np.empty((len(own), height, nv)),
    )  # fmt: skip
    moved[0, 0] = Z
    motion_changes(
        poses, J, v, a, q, rate, axes, loops, scales, order, choice[0], factors, moved, along, room[0],
        new_change_memory(len(axes[0]), nv, height),
    )  # fmt: skip
    open_changes(trees, along, multipliers, moved)
    if count > 0:
        force_changes(moved, along, multipliers, scales, jacobian, passive, joints, gap, change)
    for number in q:
        extent += abs(number)
    return flat, unique, numbers, moved, change, own, choice, is_certain(numbers, tolerance) and extent < ORDINARY
