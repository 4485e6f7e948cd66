"""Equations of motion of a closed chain at many states at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....core.compiled import kernel
from ....core.validation import FloatArray
from ...kinematics.kernels.closure_kernels import new_scratch
from ...structure.chain_state import CLOSED, ChainState
from ...structure.memory.chain_buffers import forest_of
from .equation_kernels import fill_equations
from .equations_of_motion import OPENING, REST


class EquationsStack(NamedTuple):
    """As :class:`.EquationsOfMotion`, of n states.

    Attributes
    ----------
    poses : ndarray
        Shape (n, njoints, 4, 3): rows 0 to 2 are the columns of R, row 3 is p.
    J : ndarray
        Shape (n, nv, 6), world Jacobians, transposed.
    tau : ndarray
        Shape (n, nv), generalised forces minus those of springs and dampers, N and N m.
    jacobian, unit, tree : ndarray
        Shapes (n, rows, nv), (n, rows, 6) and (n, njoints, 6).
    closed : ndarray of bool
        Shape (n,): whether the loops are closed, and the motion keeps them so.
    """

    poses: FloatArray
    J: FloatArray
    tau: FloatArray
    jacobian: FloatArray
    unit: FloatArray
    tree: FloatArray
    closed: NDArray[np.bool_]


def equations_of_stack(
    state: ChainState, q: FloatArray, v: FloatArray | None = None, a: FloatArray | None = None
) -> EquationsStack:
    """Equations of motion at n states.

    Parameters
    ----------
    state : ChainState
        The chain.
    q, v, a : ndarray
        Shapes (n, nq), (n, nv) and (n, nv); None counts as zero.
    """
    forest, (count, rows, joints) = forest_of(state), (len(q), state.row_count, state.model.njoints)
    moves = v is not None or a is not None
    speed, rate = (np.zeros((count, state.nv)) if part is None else part for part in (v, a))
    poses, J, dJ = forest.kinematics(q, v)
    tau, forces = forest.rnea(q, speed, rate)
    if state.passive.has_springs or state.passive.damping.any():
        tau -= state.passive.force(q, v)
    jacobian, unit = np.empty((count, rows, state.nv)), np.empty((count, rows, 6))
    wrenches, numbers = np.empty((count, joints, 6)), np.empty((count, 6))
    fill_stack(
        poses, J, dJ, forces, speed, rate, moves, q, state.topology.loops, state.topology.scales, jacobian, unit,
        wrenches, numbers,
    )  # fmt: skip
    most = max(OPENING, state.contradiction)
    closed = (numbers[:, 0] <= CLOSED) | (numbers[:, 1] <= state.contradiction)
    for opening, size in ((numbers[:, 4], numbers[:, 2]), (numbers[:, 5], numbers[:, 3])):
        closed &= opening <= most * np.maximum(size, REST)
    return EquationsStack(poses, J, tau, jacobian, unit, wrenches, closed)


@kernel(stack=True)
def fill_stack(
    poses: Any, J: Any, dJ: Any, forces: Any, v: Any, a: Any, moves: bool, q: Any, loops: Any, scales: Any,
    jacobian: Any, unit: Any, tree: Any, numbers: Any,
) -> None:  # fmt: skip
    """:func:`.equation_kernels.fill_equations` of every state; what that returns is filled in, shape (n, 6)."""
    height, scratch = len(scales[0]), new_scratch()
    rate, openings, own = np.empty((height, v.shape[1])), np.empty((2, height)), np.empty(poses.shape[1:])
    for s in range(len(poses)):
        found = fill_equations(
            poses[s], J[s], dJ[s], forces[s], True, v[s], a[s], moves, loops, q[s], scales, rate,
            (jacobian[s], unit[s], tree[s], own, 0), scratch, openings,
        )  # fmt: skip
        for k in range(6):
            numbers[s, k] = found[k]
