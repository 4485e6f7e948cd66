"""Velocities and accelerations projected onto those that keep the loops closed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.compiled import kernel
from ...core.errors import ExoPinError, SamplesFailed
from ...core.validation import FloatArray, as_finite, frozen
from ..structure.chain_state import ChainState
from .kernels.closure_kernels import jacobian_rate, residual_jacobian
from .kernels.dependent_kernels import nearest_motion
from .loops import closed_configuration

#: Samples of a stack that one call of a kernel takes.
BLOCK = 256


def project_velocity(state: ChainState, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """The velocity nearest to v that does not open the loops.

    Nearest in the sum of squares with metres divided by the characteristic length.

    Parameters
    ----------
    q, v : array_like
        Shapes (nq,), closed, and (nv,), or (n, nq) and (n, nv) for n samples.

    Returns
    -------
    ndarray
        As v.

    Raises
    ------
    LoopNotClosed
        If the loops are open.
    SamplesFailed
        If some samples of a stack have no answer; it has the error of each, and the answers of the others.

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators").chain
    >>> q = chain.close(chain.neutral())
    >>> v = chain.project_velocity(q, np.ones(chain.model.nv))
    >>> bool(np.abs(chain.constraint_jacobian(q) @ v).max() < 1e-12)  # the loops stay closed
    True
    """
    if np.ndim(q) == 2:
        return _projected(state, q, None, v)
    q, v = closed_configuration(state, q), state.tangent("v", v)
    state.buffers.linearise(q)
    return v - _least(state, state.buffers.jacobian @ v)


def project_acceleration(state: ChainState, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
    """The acceleration nearest to a that does not open the loops while they move with v.

    Nearest as for :meth:`ClosedChain.project_velocity`, also for stacks; v must not open them either.

    Parameters
    ----------
    q : array_like
        Shape (..., nq), closed.
    v : array_like
        Shape (..., nv), rad/s and m/s.
    a : array_like
        Shape (..., nv), rad/s² and m/s².

    Returns
    -------
    numpy.ndarray
        Shape (..., nv), rad/s² and m/s².

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain
    >>> q = chain.close(chain.neutral())
    >>> v = chain.project_velocity(q, np.full(chain.model.nv, 0.2))
    >>> a = chain.project_acceleration(q, v, np.zeros(chain.model.nv))
    >>> bool(np.abs(chain.constraint_jacobian(q) @ a + chain.constraint_drift(q, v)).max() < 1e-12)  # m/s²
    True
    """
    if np.ndim(q) == 2:
        return _projected(state, q, v, a)
    q, v, a = closed_configuration(state, q), state.tangent("v", v), state.tangent("a", a)
    drift = state.buffers.drift_of(q, v).copy()
    state.buffers.linearise(q)
    return a - _least(state, state.buffers.jacobian @ a + drift)


def _least(state: ChainState, right: FloatArray) -> FloatArray:
    """The least x with J x = right, J as last linearised."""
    work, top = state.buffers, state.topology
    gap = state.uncertainty(float(np.abs(work.gap * top.row_scale).max(initial=0.0)))
    found: FloatArray = nearest_motion(work.jacobian, right, top.scales, state.model.njoints, gap, False)[0]
    return found


def _projected(state: ChainState, q: ArrayLike, v: ArrayLike | None, x: ArrayLike) -> FloatArray:
    """Projections of a stack: of velocities x, or with velocities v of accelerations x."""
    rows = as_finite("q", q, (None, state.nq))
    given = as_finite("v" if v is None else "a", x, (len(rows), state.nv))
    moved = None if v is None else as_finite("v", v, given.shape)
    out, worst, forest = np.full(given.shape, np.nan), np.full(len(rows), np.nan), state.forest
    still = frozen(np.zeros(given.shape)) if moved is None else moved
    for first in range(0, len(rows), BLOCK):
        if forest is None:
            break
        own = slice(first, first + BLOCK)
        poses, J, dJ = forest.kinematics(rows[own], None if moved is None else moved[own])
        worst[own] = _project_all(
            poses, J, dJ, still[own], given[own], state.topology.loops, rows[own], state.topology.scales,
            state.tolerance, out[own],
        )  # fmt: skip
    failures: dict[int, ExoPinError] = {}
    for k in np.flatnonzero(~(worst <= state.closed) | [not state.has_unit_turns(row) for row in rows]):
        try:
            out[k] = (
                project_velocity(state, rows[k], given[k])
                if moved is None
                else project_acceleration(state, rows[k], moved[k], given[k])
            )
        except ExoPinError as error:
            failures[int(k)], out[k] = error, np.nan
    if failures:
        raise SamplesFailed(failures, len(rows), out)
    return out


@kernel(stack=True)
def _project_all(
    poses: Any, J: Any, dJ: Any, v: Any, x: Any, loops: Any, q: Any, scales: Any, tolerance: float, out: Any
) -> Any:
    """Nearest motions of a stack, as :func:`_projected` has them; the largest residual of each sample is returned."""
    height, nv = len(scales[0]), x.shape[1]
    gap, jacobian, rate, drift = np.empty(height), np.empty((height, nv)), np.empty((height, nv)), np.empty(height)
    worst = np.empty(len(x))
    for s in range(len(x)):
        worst[s] = residual_jacobian(poses[s], J[s], loops, q[s], gap, jacobian)
        jacobian_rate(poses[s], J[s], dJ[s], v[s], loops, q[s], rate, drift)
        largest = 0.0
        for i in range(height):
            largest = max(largest, abs(gap[i] * scales[0][i]))
            for k in range(nv):
                drift[i] += jacobian[i, k] * x[s, k]
        known = tolerance if tolerance > 0.0 else largest
        move, _, _ = nearest_motion(jacobian, drift, scales, len(poses[s]), known, False)
        for k in range(nv):
            out[s, k] = x[s, k] - move[k]
    return worst
