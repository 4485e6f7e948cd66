"""Forces of a motion without bounds, compiled: equations of motion, solutions, the least."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....numerics.small_linear import copy_numbers
from ...kinematics.kernels.closure_kernels import new_scratch
from ...structure.chain_state import CLOSED
from ...structure.memory.chain_buffers import unpacked_constants
from .equation_kernels import fill_equations, split_terms
from .equations_of_motion import CERTAIN, EXACT, STILL
from .solution_kernels import fill_efforts, fill_solutions, least, new_memory

#: Numbers of a state: what :func:`.equation_kernels.fill_equations` returns, then the number of self-stresses, the
#: share of one that is rounding, the share of the forces that is missing, the bound of the least singular value, the
#: residual.
NUMBERS = 11
#: A motion below this, characteristic lengths and rad a second squared, is finite and no larger than an input may be.
ORDINARY = 1e6


@kernel
def forces_size(rows: int, nv: int, joints: int) -> int:
    """Size of the block that :func:`forces_of_state` fills."""
    return rows * (nv + 8 + rows) + 18 * joints + nv


@kernel(inline=True)
def split_forces(flat: Any, shape: Any, free: int) -> Any:
    """Windows on the block of :func:`forces_of_state` behind those of :func:`.equation_kernels.split_terms`.

    Parameters
    ----------
    flat, shape
        As for :func:`.equation_kernels.split_terms`.
    free : int
        Number of self-stresses.

    Returns
    -------
    tuple
        Efforts, shape (nv,); multipliers; λ of the least sum of squares, shapes (rows,); self-stresses, shape
        (rows, free).
    """
    rows, nv, count = shape
    first = rows * (nv + 6) + 18 * count
    second, third, last = first + nv, first + nv + rows, first + nv + 2 * rows
    null = flat[last : last + rows * free].reshape((rows, free))
    return flat[first:second], flat[second:third], flat[third:last], null


@kernel
def new_room(height: int, nv: int, count: int) -> Any:
    """Arrays for :func:`fill_forces`, which makes none: rows, nv, passive coordinates."""
    return (
        new_scratch(), np.empty((3, height)), new_memory(height, nv, count), np.empty(count), np.empty(nv),
        np.empty((height, height)),
    )  # fmt: skip


@kernel(inline=True)
def fill_forces(
    poses: Any, J: Any, dJ: Any, forces: Any, local: bool, v: Any, a: Any, moves: bool, tau: Any, q: Any, loops: Any,
    scales: Any, bodies: Any, passive: Any, tolerance: float, rate: Any, flat: Any, terms: Any, unique: Any,
    numbers: Any, room: Any,
) -> int:  # fmt: skip
    """The forces with the least multipliers, in what :func:`new_room` makes; how many self-stresses.

    The terms are the windows on the block by :func:`.equation_kernels.split_terms`. In the room's second part the
    multipliers are the third row on return.
    """
    owners, _, per_newton, length = bodies
    shape, (scratch, openings, memory, left, sizes, square) = (len(scales[0]), len(v), len(poses)), room
    worst, gap, speed, size, opening_v, opening_a = fill_equations(
        poses, J, dJ, forces, local, v, a, moves, loops, q, scales, rate, terms, scratch, openings
    )
    (jacobian, _, tree, _, _), found = terms, openings[2]
    free, sharpness, share, weakest = fill_solutions(
        jacobian, tau, tree, owners, passive, scales, length, tolerance if tolerance > 0.0 else gap, memory, found,
        left, sizes, square,
    )  # fmt: skip
    efforts, multipliers, start, null = split_forces(flat, shape, free)
    for r in range(len(found)):
        multipliers[r] = start[r] = found[r]
        for s in range(free):
            null[r, s] = square[r, s]
    residual = fill_efforts(jacobian, tau, multipliers, null, passive, per_newton, sharpness, efforts, unique)
    numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5] = (
        worst, gap, speed, size, opening_v, opening_a,
    )  # fmt: skip
    numbers[6], numbers[7], numbers[8], numbers[9], numbers[10] = free, sharpness, share, weakest, residual
    return free


@kernel(inline=True)
def is_certain(numbers: Any, tolerance: float) -> bool:
    """Whether :func:`~.inverse_dynamics.refuse_motion` raises nothing for certain; most motions need no more than this.

    Parameters
    ----------
    numbers : ndarray
        Shape (at least :data:`NUMBERS`,), what :func:`forces_of_state` fills.
    tolerance : float
        Of the geometry, scaled; 0 for an exact one.
    """
    moves = numbers[0] <= CLOSED and numbers[4] <= STILL and numbers[5] <= STILL and numbers[3] < ORDINARY
    return moves and numbers[8] <= EXACT and numbers[9] > CERTAIN and tolerance == 0.0


@kernel
def forces_of_state(
    poses: Any, J: Any, dJ: Any, forces: Any, v: Any, a: Any, moves: bool, tau: Any, q: Any, constants: Any,
    passive: Any, tolerance: float, reactions: bool, rate: Any, flat: Any, unique: Any, numbers: Any,
) -> bool:  # fmt: skip
    """Equations of motion, all their solutions, and the least: what a motion without bounds needs.

    Parameters
    ----------
    poses, J, dJ, forces, v, a, moves, q, rate
        As for :func:`.equation_kernels.fill_equations`.
    tau, passive
        As for :func:`.solution_kernels.fill_solutions`.
    constants : tuple
        What :func:`packed_constants` packs.
    tolerance : float
        Of the geometry, scaled; 0 for an exact one.
    reactions : bool
        Whether the metric is that of the wrenches of all joints and closures, or of the multipliers.
    flat, unique, numbers : ndarray
        Shapes (size,), (nv,), bool, and (:data:`NUMBERS`,), filled: the block of :func:`split_forces`, and which
        efforts every solution shares.

    Returns
    -------
    bool
        Whether :func:`is_certain`.
    """
    loops, scales, bodies, _ = unpacked_constants(constants[0], constants[1])
    shape, (_, carried, per_newton, length) = (len(scales[0]), len(v), len(poses)), bodies
    terms = split_terms(flat, shape)
    free = fill_forces(
        poses, J, dJ, forces, True, v, a, moves, tau, q, loops, scales, bodies, passive, tolerance, rate, flat, terms,
        unique, numbers, new_room(shape[0], shape[1], len(passive)),
    )  # fmt: skip
    if reactions and free > 0:
        jacobian, unit, tree, _, _ = terms
        efforts, multipliers, start, null = split_forces(flat, shape, free)
        copy_numbers(least(start, null, poses, tree, unit, carried, loops, length), multipliers)
        numbers[10] = fill_efforts(jacobian, tau, multipliers, null, passive, per_newton, numbers[7], efforts, unique)
    return is_certain(numbers, tolerance)
