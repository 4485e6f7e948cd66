"""Closed-loop kinematics: independent and dependent coordinates, reduced Jacobian, projections."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, LoopNotClosed, UndeterminedMotion
from ...core.validation import FloatArray, as_finite, frozen
from ..structure.chain_state import ChainState
from .kernels.dependent_kernels import fill_dependent, reduced_loops
from .loops import closed_configuration, scaled_jacobian, tree_frame_jacobian

IntArray = NDArray[np.int64]
#: No independent coordinates that were given.
NONE_GIVEN = frozen(np.array([], dtype=np.int64))


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

    Examples
    --------
    >>> chain = ep.load("six-cables").chain
    >>> split = chain.split(chain.close(chain.neutral()), chain.roles.actuated[:3])
    >>> split.independent.tolist(), len(split.dependent)  # three cables' speeds determine the other 18 velocities
    ([5, 8, 11], 18)
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

    Returns
    -------
    CoordinateSplit
        Indices in v of both kinds, and the condition of the choice, which has no unit.

    Raises
    ------
    UndeterminedMotion
        If the given joints do not determine the others.
    InvalidInput
        If they are not independent of each other.

    Examples
    --------
    >>> chain = ep.load("four-cables").chain
    >>> split = chain.split(chain.close(chain.neutral()))
    >>> len(split.independent), round(float(split.condition), 1)
    (3, 7.3)
    """
    chosen, dependent, _ = reduced(state, q, independent)
    columns = scaled_jacobian(state, state.configuration(q))[0][:, dependent]
    return CoordinateSplit(chosen, np.sort(dependent), float(np.linalg.cond(columns)) if len(dependent) else 1.0)


def reduced_jacobian(state: ChainState, q: ArrayLike, independent: Iterable[str] | None = None) -> FloatArray:
    """All velocities from the independent ones: v = G v_i, shape (nv, dof), with J G = 0.

    Parameters
    ----------
    q, independent
        As for :meth:`ClosedChain.split`; the columns are in the order of ``independent``.

    Returns
    -------
    ndarray
        Shape (nv, dof).

    Examples
    --------
    >>> chain = ep.load("prototype").chain
    >>> q = chain.close(chain.neutral())
    >>> chain.reduced_jacobian(q).shape  # all velocities, of the three that are free
    (18, 3)
    """
    return reduced(state, q, independent)[2]


def reduced(
    state: ChainState, q: ArrayLike, independent: Iterable[str] | None
) -> tuple[IntArray, IntArray, FloatArray]:
    """Independent and dependent coordinates, and the reduced Jacobian.

    The buffers are linearised at q afterwards. See :func:`split` for what is raised.
    """
    work, top, q = state.buffers, state.topology, state.configuration(q)
    given = NONE_GIVEN if independent is None else frozen(state.velocity_indices(independent))
    pin.computeJointJacobians(state.model, work.data, q)
    np.copyto(work.q, q)
    worst, own, dependent, G, choice = reduced_loops.run(
        work.poses, work.J, top.loops, work.q, given, top.scales, state.tolerance, work.gap, work.jacobian
    )
    if not state.is_closed(worst, state.scaled_gap()):
        raise LoopNotClosed(q.copy(), worst, 0)
    if independent is not None:
        refuse_choice(state, q, given, *choice)
    return own, dependent, G


def refuse_choice(
    state: ChainState, q: FloatArray, given: IntArray, dependent: int, error: float, tolerance: float
) -> None:
    """Raise if given coordinates (indices in v) do not determine the others, or are not independent of each other.

    ``error`` is the largest scaled one that the reduced Jacobian leaves in the rows, ``tolerance`` what is rounding.
    """
    left = state.nv - len(set(given.tolist())) - dependent
    if left > 0:
        raise UndeterminedMotion(q.copy(), left, still_moving(state, q, np.setdiff1d(np.arange(state.nv), given)))
    if len(given) > state.nv - dependent or error > tolerance:
        free = state.nv - np.linalg.matrix_rank(scaled_jacobian(state, q)[0], tol=tolerance)
        raise InvalidInput(f"expected {free} independent coordinates, got {len(given)}: give fewer joints")


def still_moving(state: ChainState, q: FloatArray, others: IntArray) -> list[str]:
    """Names of the joints that move in some motion of the loops of these coordinates (indices in v) alone."""
    scaled, tolerance = scaled_jacobian(state, q)
    _, values, rows = np.linalg.svd(scaled[:, others])
    free = np.linalg.norm(rows[int(np.sum(values > tolerance)) :], axis=0) > 1e-9
    return [str(state.model.names[int(i)]) for i in np.unique(state.topology.owners[others[free]])]


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

    Examples
    --------
    >>> chain = ep.load("four-cables").chain
    >>> chain.frame_jacobian(chain.close(chain.neutral()), "arm").shape
    (6, 3)
    """
    return tree_frame_jacobian(state, state.configuration(q), frame) @ reduced_jacobian(state, q, independent)


def dependent_motion(
    state: ChainState, q: ArrayLike, joints: Iterable[str], velocity: ArrayLike, acceleration: ArrayLike | None = None
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

    Examples
    --------
    >>> exo = ep.load("three-linear-actuators")
    >>> chain = exo.chain
    >>> q = chain.close(chain.neutral())
    >>> v, a = chain.dependent_motion(q, ["root_joint"], [0.0, -1.0, 0.0])  # 1 rad/s of flexion
    >>> bool(np.allclose(v[chain.velocity_indices(chain.roles.actuated)], exo.jacobian(exo.pose()) @ [0.0, -1.0, 0.0]))
    True
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
    work = state.buffers
    work.linearise(q)
    _follow(state, q, v, others, np.zeros(state.row_count), 0.0)
    drift = work.drift_of(q, v).copy()
    work.linearise(q)
    _follow(state, q, a, others, drift, float(np.square(v / state.topology.column).max(initial=0.0)))
    return v, a


def _follow(
    state: ChainState, q: FloatArray, x: FloatArray, others: IntArray, drift: FloatArray, drifting: float
) -> None:
    """Fill the other coordinates of x for J x + drift = 0, whose equations may be redundant.

    ``drifting`` is the scaled size of the terms of the drift, which may cancel down to rounding, as in a parallelogram.
    """
    top, jacobian, nv, rows = state.topology, state.buffers.jacobian, state.nv, state.row_count
    allowed, order, error = np.zeros(nv, dtype=np.bool_), np.empty(nv, dtype=np.int64), np.empty(nv + 1)
    allowed[others] = True
    factors, gap = (np.empty((nv + 1, rows)), np.empty(nv), np.empty(nv)), state.uncertainty(state.scaled_gap())
    right = (-jacobian @ x - drift)[:, None]
    rank, _ = fill_dependent.run(jacobian, right, allowed, top.scales, state.model.njoints, gap, factors, order, error)
    if rank < len(others):
        raise UndeterminedMotion(q.copy(), len(others) - rank, still_moving(state, q, others))
    x[order[:rank]] = factors[0][nv, :rank]
    # The error of consistent equations is rounding and the loops' residual (at most 1e-8) times the condition; that
    # of contradictory ones is of the size of the given motion.
    size = float(np.abs(x / top.column).max(initial=0.0)) + drifting
    if not error[nv - rank] <= max(1e-6, state.contradiction) * size:
        raise InvalidInput("the given motion opens the loops: give the motion of fewer joints, of independent ones")
