"""Forces of a motion without bounds, compiled, of one state and of many: equations of motion, solutions, the least."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.compiled import kernel
from ...structure.memory.packed_constants import unpacked_constants
from .equation_kernels import equations, split_terms, wrenches_of
from .solution_kernels import efforts_and_residual, least, solutions

#: Numbers of a state: what :func:`.equation_kernels.equations` returns, then the number of self-stresses, the share of
#: one that is rounding, the share of the forces that is missing, the bound of the least singular value, the residual.
NUMBERS = 11


@kernel
def forces_size(rows: int, nv: int, joints: int) -> int:
    """Size of the block that :func:`forces_of_motion` fills."""
    return rows * (nv + 8 + rows) + 18 * joints + nv


@kernel
def split_forces(flat: Any, shape: Any, free: int) -> Any:
    """Windows on the block of :func:`forces_of_motion` behind those of :func:`.equation_kernels.split_terms`.

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
def forces_of_motion(
    poses: Any, J: Any, dJ: Any, forces: Any, local: bool, v: Any, a: Any, moves: bool, tau: Any, q: Any, loops: Any,
    scales: Any, bodies: Any, passive: Any, tolerance: float, reactions: bool, rate: Any, flat: Any, unique: Any,
    numbers: Any,
) -> None:  # fmt: skip
    """Equations of motion, all their solutions, and the least: what a motion without bounds needs.

    Parameters
    ----------
    poses, J, dJ, forces, local, v, a, moves, q, loops, scales, rate
        As for :func:`.equation_kernels.equations`.
    tau, passive
        As for :func:`.solution_kernels.solutions`.
    bodies : tuple
        :attr:`exo_pin.chain.structure.topology.Topology.bodies`.
    tolerance : float
        Of the geometry, scaled; 0 for an exact one.
    reactions : bool
        Whether the metric is that of the wrenches of all joints and closures, or of the multipliers.
    flat, unique, numbers : ndarray
        Shapes (size,), (nv,), bool, and (:data:`NUMBERS`,), filled: the block of :func:`split_forces`, and which
        efforts every solution shares.
    """
    owners, carried, per_newton, length = bodies
    shape = (len(scales[0]), len(v), len(poses))
    worst, gap, speed, size, opening_v, opening_a = equations(
        poses, J, dJ, forces, local, v, a, moves, loops, q, scales, rate, flat
    )
    jacobian, unit, tree, _, _ = split_terms(flat, shape)
    found, stresses, sharpness, _, _, share, weakest = solutions(
        jacobian, tau, tree, owners, passive, scales, length, tolerance if tolerance > 0.0 else gap
    )
    efforts, multipliers, start, null = split_forces(flat, shape, stresses.shape[1])
    for r in range(len(found)):
        start[r] = multipliers[r] = found[r]
        for s in range(stresses.shape[1]):
            null[r, s] = stresses[r, s]
    if reactions and stresses.shape[1] > 0:
        multipliers[:] = least(found, stresses, poses, tree, unit, carried, loops, length)
    efforts[:], residual, unique[:] = efforts_and_residual(
        jacobian, tau, multipliers, stresses, passive, per_newton, sharpness
    )
    numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5] = (
        worst, gap, speed, size, opening_v, opening_a,
    )  # fmt: skip
    numbers[6], numbers[7], numbers[8], numbers[9], numbers[10] = (
        stresses.shape[1], sharpness, share, weakest, residual,
    )  # fmt: skip


@kernel
def forces_of_state(
    poses: Any, J: Any, dJ: Any, forces: Any, v: Any, a: Any, moves: bool, tau: Any, q: Any, constants: Any,
    passive: Any, tolerance: float, reactions: bool, rate: Any, flat: Any, unique: Any, numbers: Any,
) -> None:  # fmt: skip
    """:func:`forces_of_motion` with the constants as :func:`.packed_constants.packed_constants` packs them."""
    loops, scales, bodies, _ = unpacked_constants(constants[0], constants[1])
    forces_of_motion(
        poses, J, dJ, forces, True, v, a, moves, tau, q, loops, scales, bodies, passive, tolerance, reactions, rate,
        flat, unique, numbers,
    )  # fmt: skip


@kernel(stack=True)
def forces_of_stack(
    poses: Any, J: Any, dJ: Any, forces: Any, v: Any, a: Any, moves: bool, tau: Any, q: Any, loops: Any, scales: Any,
    bodies: Any, passive: Any, tolerance: float, reactions: bool, flat: Any, unique: Any, numbers: Any,
) -> None:  # fmt: skip
    """:func:`forces_of_motion` of every sample; arrays of a state have one row for each."""
    rate = np.empty((len(scales[0]), v.shape[1]))
    for s in range(len(poses)):
        forces_of_motion(
            poses[s], J[s], dJ[s], forces[s], True, v[s], a[s], moves, tau[s], q[s], loops, scales, bodies, passive,
            tolerance, reactions, rate, flat[s], unique[s], numbers[s],
        )  # fmt: skip


@kernel(stack=True)
def wrenches_of_stack(
    poses: Any, tree: Any, unit: Any, carried: Any, loops: Any, columns: Any, place: int, out: Any
) -> None:
    """Wrenches of one joint or closure, shape (samples, 6, sets); see :func:`.equation_kernels.wrenches_of`."""
    for s in range(len(poses)):
        wrenches_of(poses[s], tree[s], unit[s], carried, loops, columns[s], place, out[s])
