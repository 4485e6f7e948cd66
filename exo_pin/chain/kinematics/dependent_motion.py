"""Motions that do not open the loops: velocity and acceleration of dependent joints from independent ones."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dgelsy, dgelsy_lwork

from ...core.errors import InvalidInput, UndeterminedMotion
from ...core.validation import FloatArray, as_finite
from ..structure.chain_state import ChainState
from .loops import closed_configuration
from .rank import rank_tolerance


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
    work, top, model = state.buffers, state.topology, state.model
    chosen = state.velocity_indices(joints)
    moved = as_finite("velocity", velocity, (len(chosen),))
    v, a = np.zeros(model.nv), np.zeros(model.nv)
    v[chosen] = moved
    if acceleration is not None:
        a[chosen] = as_finite("acceleration", acceleration, moved.shape)
    q = closed_configuration(state, q)
    if len(set(chosen.tolist())) != len(chosen):
        raise InvalidInput("a joint is given twice: expected every joint once")
    given = np.zeros(model.nv, dtype=bool)
    given[chosen] = True
    others = np.flatnonzero(~given)
    if not top.row_count:
        if others.size:
            raise UndeterminedMotion(q.copy(), others.size)
        return v, a
    work.linearise(q)
    # Metres are divided by the characteristic length in rows and columns; the drift's units follow the rows.
    column_scale = top.column
    scaled = work.jacobian * top.row_scale[:, None]
    dependent = scaled[:, others] * column_scale[others]
    gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
    # Size of the terms: the right sides may cancel down to rounding, as in a parallelogram.
    moving = float(np.abs(v / column_scale).max(initial=0.0))
    v[others] = column_scale[others] * _solve(state, q, dependent, -scaled @ v, gap, moving)
    drift = work.drift_of(q, v)
    moving = float(np.abs(a / column_scale).max(initial=0.0)) + float(np.square(v / column_scale).max(initial=0.0))
    a[others] = column_scale[others] * _solve(state, q, dependent, -scaled @ a - top.row_scale * drift, gap, moving)
    return v, a


def _solve(
    state: ChainState, q: FloatArray, matrix: FloatArray, right: FloatArray, gap: float, moving: float
) -> FloatArray:
    """Solve the redundant but consistent equations for all columns."""
    rows, columns = matrix.shape
    if columns == 0:
        solution = np.zeros(0)
    else:
        # Relative to the largest singular value; 1 bounds it from below for links as long as the scale.
        condition = rank_tolerance(matrix.shape, 1.0, state.model.njoints, gap)
        padded = np.zeros(max(rows, columns))
        padded[:rows] = right
        pivots = np.zeros(columns, dtype=np.int32)
        lwork = int(dgelsy_lwork(rows, columns, 1, condition)[0])
        _, answer, _, rank, _ = dgelsy(matrix, padded, pivots, condition, lwork)
        if rank < columns:
            raise UndeterminedMotion(q.copy(), columns - rank)
        solution = answer[:columns].reshape(-1)
    # The error of consistent equations is rounding and the loops' residual (at most 1e-8) times the condition; that
    # of contradictory ones is of the size of the given motion.
    left = matrix @ solution - right
    size = float(np.abs(right).max(initial=0.0)) + float(np.abs(solution).max(initial=0.0))
    if not np.abs(left).max(initial=0.0) <= 1e-6 * size + 1e-9 * moving:
        raise InvalidInput("the given motion opens the loops: give the motion of fewer joints, of independent ones")
    return solution
