"""Damped Gauss-Newton on the configuration manifold: least steps from one start towards closed loops."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ...core.compiled import kernel
from ...core.validation import FloatArray
from ...numerics.small_linear import solve_cholesky
from ..structure.chain_state import ChainState
from ..structure.joint_limits import Limits

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
    work, scale, blocks = state.buffers, state.topology.row_scale, state.topology.blocks
    if limits is not None:
        q = limits.clipped(q, weight)
    worst = work.linearise(q)
    if worst <= tolerance and (limits is None or limits.holds(q)):
        return Attempt(q.copy(), worst, 0, True, False)
    gap, jacobian, move = work.gap, work.jacobian, work.move
    size = mark = _scaled_norm(gap, scale)
    factor, count = 1.0, 0
    for count in range(1, iterations + 1):
        damping = max(_DAMPING * factor * size, _LEAST_DAMPING)
        _step(jacobian, gap, scale, weight, damping, blocks, move)
        if limits is not None:
            _limit_step(state, limits, q, weight, damping)
        trial = pin.integrate(state.model, q, move)
        worst_there = work.linearise(trial)
        size_there = _scaled_norm(gap, scale)
        if worst_there <= tolerance and (limits is None or limits.holds(trial)):
            return Attempt(trial, worst_there, count, True, False)
        if size_there < size:
            # Less damping after a good step, more after a poor one.
            factor *= 0.3 if size_there < 0.25 * size else 3.0 if size_there > 0.75 * size else 1.0
            q, size, worst = trial, size_there, worst_there
        else:
            factor *= 10.0
            if factor * size * _DAMPING > _MOST_DAMPING or not math.isfinite(size):
                return Attempt(q.copy(), worst, count, False, True)
            work.linearise(q)
        if count % _PATIENCE == 0:
            if size > _PROGRESS * mark:
                return Attempt(q.copy(), worst, count, False, True)
            mark = size
    return Attempt(q.copy(), worst, count, False, False)


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
        _step(work.jacobian, gap, top.row_scale, weight, damping, top.blocks, move)
    move += stopped


@kernel
def _scaled_norm(gap: Any, scale: Any) -> float:
    """Length of the gap, metres divided by the characteristic length."""
    total = 0.0
    for i in range(len(gap)):
        total += (gap[i] * scale[i]) ** 2
    return math.sqrt(total)


@kernel
def _step(jacobian: Any, gap: Any, row_scale: Any, weight: Any, damping: float, blocks: Any, out: Any) -> None:
    """Fill the damped least step towards a closed configuration.

    Minimises |D (J x + r)|² + damping |x|²_{W⁻¹} with D = diag(row_scale), W = diag(weight): x = W Jᵀ D y with
    (D J W Jᵀ D + damping I) y = -D r, solved by Cholesky, block by block. A coordinate of weight 0 does not move.

    Parameters
    ----------
    jacobian, gap : ndarray
        Shape (rows, nv) and (rows,).
    row_scale, weight : ndarray
        Shape (rows,) and (nv,).
    damping : float
        Above zero, relative to the mean of the matrix's diagonal.
    blocks : tuple of ndarray
        As in :mod:`exo_pin.chain.structure.blocks`.
    out : ndarray
        Shape (nv,), filled.
    """
    rows, columns, row_starts, column_starts = blocks
    trace = 0.0
    for i in range(jacobian.shape[0]):
        total = 0.0
        for k in range(jacobian.shape[1]):
            total += jacobian[i, k] * jacobian[i, k] * weight[k]
        trace += total * row_scale[i] * row_scale[i]
    shift = damping * trace / jacobian.shape[0]
    out[:] = 0.0
    for b in range(len(row_starts) - 1):
        own, moved = rows[row_starts[b] : row_starts[b + 1]], columns[column_starts[b] : column_starts[b + 1]]
        A, y = np.zeros((len(own), len(own))), np.empty(len(own))
        for i in range(len(own)):
            for j in range(i + 1):
                total = 0.0
                for k in moved:
                    total += jacobian[own[i], k] * jacobian[own[j], k] * weight[k]
                A[i, j] = total * row_scale[own[i]] * row_scale[own[j]]
            A[i, i] += shift
            y[i] = -row_scale[own[i]] * gap[own[i]]
        solve_cholesky(A, y)
        for k in moved:
            total = 0.0
            for i in range(len(own)):
                total += jacobian[own[i], k] * row_scale[own[i]] * y[i]
            out[k] = weight[k] * total
