"""Closed-loop kinematics: independent and dependent coordinates, reduced Jacobian, forward and inverse kinematics."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr

from ...core.errors import InvalidInput, UndeterminedMotion
from ...core.validation import FloatArray
from ..structure.chain_state import ChainState
from .loops import closed_configuration, constraint_jacobian, tree_frame_jacobian
from .rank import least_motion, rank_tolerance


@dataclass(frozen=True, eq=False)
class CoordinateSplit:
    """Independent coordinates of v, and the dependent ones that follow from them.

    Attributes
    ----------
    independent : ndarray of int
        Shape (dof,), indices in v.
    dependent : ndarray of int
        Shape (nv - dof,), indices in v.
    condition : float
        Ratio of the largest to the smallest singular value of the Jacobian's dependent columns, metres divided by
        the characteristic length. It has no unit; large means close to a singularity of this split.
    """

    independent: NDArray[np.int64]
    dependent: NDArray[np.int64]
    condition: float


def split(state: ChainState, q: ArrayLike, independent: Iterable[str] | None = None) -> CoordinateSplit:
    """Split the coordinates into independent and dependent ones.

    Parameters
    ----------
    q : array_like
        Shape (nq,), closed.
    independent : iterable of str, optional
        Joints whose coordinates are independent. By default the dependent ones are chosen for their conditioning,
        by pivoted QR of the scaled Jacobian: each is the column farthest from the span of those chosen before.

    Raises
    ------
    UndeterminedMotion
        If the given joints do not determine the others.
    InvalidInput
        If they are not independent of each other.
    """
    J, tolerance = scaled_jacobian(state, closed_configuration(state, q))
    nv, rank = J.shape[1], _rank(J, tolerance)
    if independent is not None:
        chosen = state.velocity_indices(independent)
        dependent = np.setdiff1d(np.arange(nv), chosen)
        if missing := len(dependent) - _rank(J[:, dependent], tolerance):
            raise UndeterminedMotion(np.array(q), missing)
        if len(chosen) > nv - rank:
            raise InvalidInput(f"expected {nv - rank} independent coordinates, got {len(chosen)}: give fewer joints")
    else:
        pivots = np.asarray(qr(J, mode="r", pivoting=True)[1]) if J.size else np.arange(nv)
        dependent, chosen = np.sort(pivots[:rank]), np.sort(pivots[rank:])
    values = np.linalg.svd(J[:, dependent], compute_uv=False) if len(dependent) else np.ones(1)
    return CoordinateSplit(
        np.asarray(chosen, dtype=np.int64), np.asarray(dependent, dtype=np.int64), float(values[0] / values[-1])
    )


def reduced_jacobian(state: ChainState, q: ArrayLike, independent: Iterable[str] | None = None) -> FloatArray:
    """All velocities from the independent ones: v = G v_i, shape (nv, dof), with J G = 0.

    Parameters
    ----------
    q, independent
        As for :meth:`ClosedChain.split`; the columns are in the order of ``independent``.
    """
    return reduced_jacobian_of(state, q, split(state, q, independent))


def reduced_jacobian_rate(
    state: ChainState, q: ArrayLike, v: ArrayLike, independent: Iterable[str] | None = None
) -> tuple[FloatArray, FloatArray]:
    """The reduced Jacobian and its time derivative: a = G a_i + Ġ v_i.

    Parameters
    ----------
    q, independent
        As for :meth:`ClosedChain.split`.
    v : array_like
        Shape (nv,), a velocity that does not open the loops.

    Returns
    -------
    G, G_rate : ndarray
        Shape (nv, dof).
    """
    parts = split(state, q, independent)
    G = reduced_jacobian_of(state, q, parts)
    work = state.buffers
    work.drift_of(state.configuration(q), state.tangent("v", v))
    rate = np.zeros_like(G)
    # J G = 0 at all times, so J Ġ = -J̇ G, and the independent rows of G are constant.
    rate[parts.dependent] = dependent_rates(state, q, parts, -work.jacobian_rate @ G)
    return G, rate


def reduced_jacobian_of(state: ChainState, q: ArrayLike, parts: CoordinateSplit) -> FloatArray:
    """The reduced Jacobian G of a split, shape (nv, dof)."""
    J = constraint_jacobian(state, q)
    G = np.zeros((state.model.nv, len(parts.independent)))
    G[parts.independent, np.arange(len(parts.independent))] = 1.0
    G[parts.dependent] = dependent_rates(state, q, parts, -J[:, parts.independent])
    return G


def dependent_rates(state: ChainState, q: ArrayLike, parts: CoordinateSplit, right: FloatArray) -> FloatArray:
    """Solve J_d x = right, metres weighed against radians by the characteristic length."""
    top = state.topology
    columns = top.column[parts.dependent]
    if not len(columns):
        return np.zeros((0, right.shape[1]))
    J = constraint_jacobian(state, q)[:, parts.dependent] * top.row_scale[:, None] * columns
    return columns[:, None] * np.linalg.lstsq(J, top.row_scale[:, None] * right, rcond=None)[0]


def scaled_jacobian(state: ChainState, q: FloatArray) -> tuple[FloatArray, float]:
    """Jacobian with metres divided by the characteristic length, and the tolerance of its singular values."""
    work, top = state.buffers, state.topology
    work.linearise(q)
    scaled = work.jacobian * top.row_scale[:, None] * top.column
    largest = float(np.linalg.norm(scaled, 2)) if scaled.size else 0.0
    gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
    return scaled, rank_tolerance(scaled.shape, largest, state.model.njoints, gap) if scaled.size else 0.0


def frame_jacobian(state: ChainState, q: ArrayLike, frame: str, independent: Iterable[str] | None = None) -> FloatArray:
    """Twist of a frame from the independent velocities, shape (6, dof).

    Parameters
    ----------
    q, independent
        As for :meth:`ClosedChain.split`.
    frame : str
        A frame of the model.

    Returns
    -------
    ndarray
        Velocity of the frame's origin (m/s) above its angular velocity (rad/s), world axes.
    """
    return tree_frame_jacobian(state, state.configuration(q), frame) @ reduced_jacobian(state, q, independent)


def project_velocity(state: ChainState, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """The velocity nearest to v that does not open the loops, shape (nv,).

    Nearest in the sum of squares with metres divided by the characteristic length.
    """
    q, v = closed_configuration(state, q), state.tangent("v", v)
    state.buffers.linearise(q)
    return v - _least(state, state.buffers.jacobian @ v)


def project_acceleration(state: ChainState, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
    """The acceleration nearest to a that does not open the loops while they move with v, shape (nv,).

    Nearest as for :meth:`ClosedChain.project_velocity`; v must not open them either.
    """
    q, v, a = closed_configuration(state, q), state.tangent("v", v), state.tangent("a", a)
    drift = state.buffers.drift_of(q, v).copy()
    state.buffers.linearise(q)
    return a - _least(state, state.buffers.jacobian @ a + drift)


def _least(state: ChainState, right: FloatArray) -> FloatArray:
    """The least x with J x = right, J as last linearised."""
    work, top = state.buffers, state.topology
    gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
    found: FloatArray = least_motion(work.jacobian, right, top.scales, state.model.njoints, gap, False)[0]
    return found


def _rank(matrix: FloatArray, tolerance: float) -> int:
    values = np.linalg.svd(matrix, compute_uv=False) if matrix.size else np.zeros(0)
    return int(np.count_nonzero(values > tolerance))
