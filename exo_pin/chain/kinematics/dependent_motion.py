"""Motions that do not open the loops: velocity and acceleration of dependent joints from independent ones."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, UndeterminedMotion
from ...core.validation import FloatArray, as_finite
from ..structure.chain_state import ChainState
from .loops import closed_configuration
from .reduced_kinematics import IntArray, solve_dependent


def dependent_motion(
    state: ChainState,
    q: ArrayLike,
    joints: Iterable[str],
    velocity: ArrayLike,
    acceleration: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Velocity and acceleration of all joints from those of some.

    Parameters
    ----------
    q : array_like
        Shape (nq,), closed.
    joints : iterable of str
        Joints whose motion is given; it has to determine those of all others.
    velocity, acceleration : array_like
        Shape (k,), the coordinates of ``joints`` in v and a, in the order of ``joints``; the acceleration is
        zero if left out. Those of a root joint are in its body's axes.

    Returns
    -------
    v, a : ndarray
        Shape (nv,), with J v = 0 and J a + J̇ v = 0.

    Raises
    ------
    LoopNotClosed
        If the residual of the loops exceeds 1e-8.
    UndeterminedMotion
        If the given joints do not determine the others, as at a singularity.
    InvalidInput
        If the given motion would open the loops.
    """
    chosen = state.velocity_indices(joints)
    moved = as_finite("velocity", velocity, (len(chosen),))
    v, a = np.zeros(state.nv), np.zeros(state.nv)
    v[chosen] = moved
    if acceleration is not None:
        a[chosen] = as_finite("acceleration", acceleration, moved.shape)
    q = closed_configuration(state, q)
    if len(set(chosen.tolist())) != len(chosen):
        raise InvalidInput("a joint is given twice: expected every joint once")
    others = np.setdiff1d(np.arange(state.nv), chosen)
    work, column = state.buffers, state.topology.column
    work.linearise(q)
    # Size of the terms: the right sides may cancel down to rounding, as in a parallelogram.
    moving = float(np.abs(v / column).max(initial=0.0))
    _follow(state, q, v, others, np.zeros(state.row_count), moving)
    drift = work.drift_of(q, v).copy()
    work.linearise(q)
    moving = float(np.abs(a / column).max(initial=0.0)) + float(np.square(v / column).max(initial=0.0))
    _follow(state, q, a, others, drift, moving)
    return v, a


def _follow(
    state: ChainState, q: FloatArray, x: FloatArray, others: IntArray, drift: FloatArray, moving: float
) -> None:
    """Fill the other coordinates of x for J x + drift = 0, whose equations may be redundant; ``moving`` is scaled."""
    top = state.topology
    right = -state.buffers.jacobian @ x - drift
    order, rank, found, error, *_ = solve_dependent(state, q, right[:, None], others)
    if rank < len(others):
        raise UndeterminedMotion(q.copy(), len(others) - rank)
    x[order[:rank]] = found[:, -1]
    # The error of consistent equations is rounding and the loops' residual (at most 1e-8) times the condition; that
    # of contradictory ones is of the size of the given motion.
    size = float(np.abs(top.row_scale * right).max(initial=0.0)) + float(
        np.abs(x / top.column)[others].max(initial=0.0)
    )
    if not error[-1] <= max(1e-6, state.contradiction) * size + max(1e-9, state.contradiction) * moving:
        raise InvalidInput("the given motion opens the loops: give the motion of fewer joints, of independent ones")
