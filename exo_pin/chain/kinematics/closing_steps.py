"""Damped Gauss-Newton on the configuration manifold: least steps from one start towards closed loops."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.progress import track
from ...core.validation import FloatArray
from ...numerics.small_linear import copy_numbers
from ..structure.chain_state import ChainState
from ..structure.memory.chain_buffers import forest_of
from ..structure.motion_axes import Limits
from .kernels.closure_kernels import least_step, residual_jacobian, scaled_norm

#: Damping relative to the scaled gap. It has to vanish with the gap, so that the last steps are Newton's, but no
#: faster: redundant closures contradict each other in proportion to the square of the gap, and without damping the
#: steps would move coordinates that should not move by the order of the gap.
_DAMPING = 1e-2
#: Least damping, so that the matrix of redundant closures stays positive definite in rounded arithmetic.
_LEAST_DAMPING = 1e-13
#: Most damping: larger damping makes no step that helps.
_MOST_DAMPING = 1e6
#: The steps are stuck if this many of them do not reduce the gap to this fraction. Even next to a singularity every
#: step halves the gap; at a minimum above zero it does not fall any further.
_PATIENCE, _PROGRESS = 8, 0.8
#: Samples of a stack that one call of a kernel takes.
BLOCK = 256
#: What becomes of a start.
GOING, CLOSED_THERE, STUCK = 0, 1, 2


@dataclass(slots=True)
class Attempt:
    """Result of one start.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the last configuration.
    residual : float
        Largest residual of the loops there, m and rad.
    steps : int
        Linearisations used.
    closed : bool
        Whether the loops are closed there.
    stuck : bool
        Whether the steps stopped making progress; otherwise they ran out.
    """

    q: FloatArray
    residual: float
    steps: int
    closed: bool
    stuck: bool


def attempt(
    state: ChainState, q: FloatArray, weight: FloatArray, tolerance: float, iterations: int, limits: Limits | None
) -> Attempt:
    """Gauss-Newton from one start.

    Parameters
    ----------
    state : ChainState
        The chain.
    q : ndarray
        Shape (nq,), where to start.
    weight : ndarray
        Shape (nv,), mobility of each coordinate: 0 for fixed ones, the squared characteristic length for metres.
    tolerance : float
        Largest residual of a closed loop, m and rad.
    iterations : int
        At most so many linearisations.
    limits : Limits or None
        Limits of joints that the steps must respect.
    """
    work, top = state.buffers, state.topology
    if limits is not None:
        q = limits.clipped(q, weight)
    q, trial = q.copy(), q.copy()
    memory, there = np.empty(4), (np.empty_like(work.gap), np.empty_like(work.jacobian))
    for count in range(iterations + 1):
        pin.computeJointJacobians(state.model, work.data, trial)
        within = limits is None or limits.holds(trial)
        status = advance.run(
            work.poses, work.J, top.loops, trial, count, within, weight, tolerance, top.scales,
            q, memory, (work.gap, work.jacobian), there, work.move,
        )  # fmt: skip
        if status != GOING:
            return Attempt(q, float(memory[3]), count, status == CLOSED_THERE, status != CLOSED_THERE)
        if limits is not None:
            _limit_step(state, limits, q, weight, _damping(memory))
        trial = pin.integrate(state.model, q, work.move)
    return Attempt(q, float(memory[3]), iterations, False, False)


def closed_stack(
    state: ChainState, starts: FloatArray, weight: FloatArray, tolerance: float, iterations: int, progress: bool
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """:func:`attempt` without limits from every row of a stack.

    Returns
    -------
    q : ndarray
        Shape (n, nq), the last configurations.
    closed : ndarray of bool
        Shape (n,), which are closed. Rows whose quaternions are not of length 1 are not.
    """
    top, q, closed = state.topology, starts.copy(), np.zeros(len(starts), dtype=np.bool_)
    forest = forest_of(state)
    for first in track(range(0, len(starts), BLOCK), "closing", progress):
        best = q[first : first + BLOCK]
        count = len(best)
        status, memory, move = np.zeros(count, dtype=np.int64), np.zeros((count, 4)), np.zeros((count, state.nv))
        gaps, jacobians = np.zeros((count, state.row_count)), np.zeros((count, state.row_count, state.nv))
        status[[not state.has_unit_turns(row) for row in best]] = STUCK
        for step in range(iterations + 1):
            going = np.flatnonzero(status == GOING)
            if not going.size:
                break
            trial = forest.integrate(best[going], move[going]) if step else best[going]
            poses, J, _ = forest.kinematics(trial)
            advance_all(
                poses, J, going, top.loops, trial, step, weight, tolerance, top.scales,
                best, memory, gaps, jacobians, status, move,
            )  # fmt: skip
        closed[first : first + BLOCK] = status == CLOSED_THERE
    return q, closed


def _limit_step(state: ChainState, limits: Limits, q: FloatArray, weight: FloatArray, damping: float) -> None:
    """Change a step to respect the limits: coordinates stop at theirs, and the others are solved again."""
    work, top = state.buffers, state.topology
    weight, move = weight.copy(), work.move
    stopped = np.zeros_like(move)
    for _ in range(len(limits.v_index)):
        here = q[limits.q_index] + stopped[limits.v_index]
        there = here + move[limits.v_index]
        over = ((there < limits.lower) | (there > limits.upper)) & (weight[limits.v_index] > 0.0)
        if not over.any():
            break
        index = limits.v_index[over]
        stopped[index] = np.clip(there[over], limits.lower[over], limits.upper[over]) - q[limits.q_index[over]]
        weight[index] = 0.0
        gap = work.gap + work.jacobian @ stopped
        least_step(work.jacobian, gap, top.row_scale, weight, damping, top.blocks, move)
    move += stopped


@kernel
def _damping(memory: Any) -> float:
    """Of the next step."""
    return max(_DAMPING * memory[2] * memory[0], _LEAST_DAMPING)


@kernel
def advance(
    poses: Any, J: Any, loops: Any, trial: Any, count: int, within: bool, weight: Any, tolerance: float, scales: Any,
    q: Any, memory: Any, here: Any, there: Any, move: Any,
) -> int:  # fmt: skip
    """Judge a trial configuration, and fill the next step.

    Parameters
    ----------
    poses, J, loops, trial
        At the trial configuration, as for :func:`exo_pin.chain.kinematics.kernels.closure_kernels.residual_jacobian`.
    count : int
        Steps so far; with none the trial is the start.
    within : bool
        Whether the trial is within the limits that count.
    weight, tolerance
        As for :func:`attempt`.
    scales : tuple
        As for :func:`exo_pin.chain.kinematics.rank.least_motion`.
    q : ndarray
        Shape (nq,), the best configuration so far, overwritten by a better trial.
    memory : ndarray
        Shape (4,), for the calls of one start: the length of the scaled gap, that some steps ago, the factor of the
        damping, and the largest residual.
    here, there : tuple of ndarray
        Gap and Jacobian, shapes (rows,) and (rows, nv), at q and room for those of the trial.
    move : ndarray
        Shape (nv,), filled.

    Returns
    -------
    int
        Whether to go on, or the trial is closed, or the steps are stuck.
    """
    row_scale, _, blocks = scales
    worst = residual_jacobian(poses, J, loops, trial, there[0], there[1])
    size = scaled_norm(there[0], row_scale)
    closed = worst <= tolerance and within
    better = count == 0 or size < memory[0]
    if better and count > 0:
        # Less damping after a good step, more after a poor one.
        memory[2] *= 0.3 if size < 0.25 * memory[0] else 3.0 if size > 0.75 * memory[0] else 1.0
    if count == 0:
        memory[1], memory[2] = size, 1.0
    if better or closed:
        copy_numbers(trial, q)
        copy_numbers(there[0], here[0])
        for r in range(len(there[1])):
            copy_numbers(there[1][r], here[1][r])
        memory[0], memory[3] = size, worst
    if closed:
        return CLOSED_THERE
    if not better:
        memory[2] *= 10.0
        if memory[2] * memory[0] * _DAMPING > _MOST_DAMPING or not math.isfinite(memory[0]):
            return STUCK
    if count > 0 and count % _PATIENCE == 0:
        if memory[0] > _PROGRESS * memory[1]:
            return STUCK
        memory[1] = memory[0]
    least_step(here[1], here[0], row_scale, weight, _damping(memory), blocks, move)
    return GOING


@kernel(stack=True)
def advance_all(
    poses: Any, J: Any, going: Any, loops: Any, trial: Any, count: int, weight: Any, tolerance: float, scales: Any,
    q: Any, memory: Any, gaps: Any, jacobians: Any, status: Any, move: Any,
) -> None:  # fmt: skip
    """:func:`advance` of the samples ``going`` of a stack, to which poses, J and trials belong, by their ``status``.

    From ``q`` on all arrays have one row for every sample of the stack.
    """
    there = np.empty(gaps.shape[1]), np.empty(jacobians.shape[1:])
    for i, s in enumerate(going):
        here = gaps[s], jacobians[s]
        status[s] = advance(
            poses[i], J[i], loops, trial[i], count, True, weight, tolerance, scales,
            q[s], memory[s], here, there, move[s],
        )  # fmt: skip
