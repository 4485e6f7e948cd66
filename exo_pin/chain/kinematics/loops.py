"""The loops of a chain at a configuration: residual, Jacobian and drift, and poses of frames.

Velocities and accelerations projected onto those that keep the loops closed.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray
from ..structure.chain_state import ChainState
from .kernels.dependent_kernels import nearest_motion
from .rank import rank_tolerance


def placement(state: ChainState, q: ArrayLike, frame: str) -> pin.SE3:
    """Pose of a frame in the world.

    Parameters
    ----------
    q : array_like
        Shape (nq,).
    frame : str
        A link, a joint, or "universe".

    Returns
    -------
    pinocchio.SE3
        m and rotation, world frame.

    Raises
    ------
    UnknownName
        If there is no such frame.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> q = exo.chain.close(exo.chain.neutral())
    >>> exo.chain.placement(q, "arm").translation.round(6) + 0.0  # the shoulder centre
    array([0., 0., 0.])
    """
    found = state.model.frames[state.frame_index(frame)]
    data = state.buffers.data
    pin.forwardKinematics(state.model, data, state.configuration(q))
    return data.oMi[found.parentJoint] * found.placement


def placements(state: ChainState, q: ArrayLike) -> dict[str, pin.SE3]:
    """Poses of all frames (links, joints, "universe") in the world, by name.

    Parameters
    ----------
    q : array_like
        Shape (nq,), rad and m.

    Returns
    -------
    dict of str to pinocchio.SE3
        Takes coordinates in each frame to world coordinates; translations in m, world frame.

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators-worn").chain
    >>> poses = chain.placements(chain.close(chain.neutral()))
    >>> limb = poses["limb_1_platform_y"].translation - poses["root_joint"].translation
    >>> round(1e3 * float(np.linalg.norm(limb)))  # mm from the shoulder centre to joint B_1
    165
    """
    data, frames = state.buffers.data, state.model.frames
    pin.forwardKinematics(state.model, data, state.configuration(q))
    return {name: data.oMi[frames[index].parentJoint] * frames[index].placement for name, index in state.frames.items()}


def tree_frame_jacobian(state: ChainState, q: FloatArray, frame: str) -> FloatArray:
    """Jacobian of a frame on the open tree, shape (6, nv): its origin's velocity above its angular one, world axes."""
    index, axes = state.frame_index(frame), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    J = pin.computeFrameJacobian(state.model, state.buffers.data, q, index, axes)
    # With a single coordinate the bindings give a vector.
    return np.array(np.reshape(J, (6, state.model.nv)))


def residual(state: ChainState, q: ArrayLike) -> FloatArray:
    """Residual of the loops, shape (rows,), m and rad, in the rows that the class describes; zero if closed.

    Parameters
    ----------
    q : array_like
        Shape (nq,), rad and m; the loops may be open.

    Returns
    -------
    numpy.ndarray
        Shape (rows,), m and rad: of frame a against frame b, in the order of the closures.

    Examples
    --------
    >>> chain = ep.load("four-cables").chain
    >>> q = chain.close(chain.neutral())
    >>> moved = q.copy()
    >>> moved[chain.configuration_slice("limb_1_slide")] += 0.01  # 10 mm
    >>> round(float(np.linalg.norm(chain.residual(moved))), 4)  # m, open by as much
    0.01
    """
    work = state.buffers
    work.residual(state.configuration(q))
    return work.gap.copy()


def constraint_jacobian(state: ChainState, q: ArrayLike) -> FloatArray:
    """Jacobian of the closures, shape (rows, nv): J v is the twist of frames a against frames b.

    On closed loops it is the derivative of :func:`residual`. Off them the rows in metres still are; those in radians
    are the relative angular velocity, of which the rotation vector's rate is an invertible function.

    Parameters
    ----------
    q : array_like
        Shape (nq,).

    Returns
    -------
    ndarray
        Shape (rows, nv); rows in m and rad per unit of v.

    Examples
    --------
    >>> chain = ep.load("scenario-one").chain
    >>> J = chain.constraint_jacobian(chain.close(chain.neutral()))
    >>> J.shape, int(np.linalg.matrix_rank(J))
    ((18, 18), 15)
    """
    work = state.buffers
    work.linearise(state.configuration(q))
    return work.jacobian.copy()


def constraint_drift(state: ChainState, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """The part of the closures' acceleration that v makes, J̇ v, shape (rows,), m/s² and rad/s².

    A motion does not open the loops if J v = 0 and J a + J̇ v = 0.

    Parameters
    ----------
    q : array_like
        Shape (nq,).
    v : array_like
        Shape (nv,).

    Returns
    -------
    ndarray
        Shape (rows,), m/s² and rad/s².

    Examples
    --------
    >>> from exo_pin.chain import Closure
    >>> slides = '<joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>'
    >>> body = f'<body name="end">{slides}<geom size="0.01"/></body>'
    >>> point = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    >>> chain = point.with_closure(Closure("rod", "distance", "end", "universe", distance=0.5))
    >>> float(chain.constraint_drift([0.0, -0.5], [3.0, 0.0])[0])  # m/s²: v²/r
    18.0
    """
    return state.buffers.drift_of(state.configuration(q), state.tangent("v", v)).copy()


def closed_configuration(state: ChainState, q: ArrayLike) -> FloatArray:
    """q as an array of shape (nq,).

    Raises
    ------
    LoopNotClosed
        If the residual of the loops exceeds that of a closed one, 1e-8 for an exact geometry.
    """
    array = state.configuration(q)
    worst = state.buffers.residual(array)
    if not state.is_closed(worst, state.scaled_gap()):
        raise LoopNotClosed(array.copy(), worst, 0)
    return array


def scaled_jacobian(state: ChainState, q: FloatArray) -> tuple[FloatArray, float]:
    """Jacobian with metres divided by the characteristic length, and the tolerance of its singular values."""
    work, top = state.buffers, state.topology
    work.linearise(q)
    scaled = work.jacobian * top.row_scale[:, None] * top.column
    largest = float(np.linalg.norm(scaled, 2)) if scaled.size else 0.0
    gap = state.uncertainty(state.scaled_gap())
    return scaled, rank_tolerance(scaled.shape, largest, state.model.njoints, gap) if scaled.size else 0.0


def project_velocity(state: ChainState, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """The velocity nearest to v that does not open the loops.

    Nearest in the sum of squares with metres divided by the characteristic length.

    Parameters
    ----------
    q, v : array_like
        Shapes (nq,), closed, and (nv,).

    Returns
    -------
    ndarray
        Shape (nv,).

    Raises
    ------
    LoopNotClosed
        If the loops are open.

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators").chain
    >>> q = chain.close(chain.neutral())
    >>> v = chain.project_velocity(q, np.ones(chain.model.nv))
    >>> bool(np.abs(chain.constraint_jacobian(q) @ v).max() < 1e-12)  # the loops stay closed
    True
    """
    q, v = closed_configuration(state, q), state.tangent("v", v)
    state.buffers.linearise(q)
    return v - _least(state, state.buffers.jacobian @ v)


def refined(state: ChainState, q: FloatArray) -> FloatArray:
    """A closed configuration, shape (nq,), after one more step of Newton's method, if that closes it better.

    Next to a singular configuration, at a distance d of it, residuals e move velocities by e/d² and accelerations by
    e/d³.
    """
    before = state.buffers.residual(q)
    state.buffers.linearise(q)
    moved = np.asarray(pin.integrate(state.model, q, -_least(state, state.buffers.gap)))
    return moved if state.buffers.residual(moved) < before else q


def project_acceleration(state: ChainState, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
    """The acceleration nearest to a that does not open the loops while they move with v.

    Nearest as for :meth:`ClosedChain.project_velocity`; v must not open them either.

    Parameters
    ----------
    q : array_like
        Shape (nq,), closed.
    v : array_like
        Shape (nv,), rad/s and m/s.
    a : array_like
        Shape (nv,), rad/s² and m/s².

    Returns
    -------
    numpy.ndarray
        Shape (nv,), rad/s² and m/s².

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain
    >>> q = chain.close(chain.neutral())
    >>> v = chain.project_velocity(q, np.full(chain.model.nv, 0.2))
    >>> a = chain.project_acceleration(q, v, np.zeros(chain.model.nv))
    >>> bool(np.abs(chain.constraint_jacobian(q) @ a + chain.constraint_drift(q, v)).max() < 1e-12)  # m/s²
    True
    """
    q, v, a = closed_configuration(state, q), state.tangent("v", v), state.tangent("a", a)
    drift = state.buffers.drift_of(q, v).copy()
    state.buffers.linearise(q)
    return a - _least(state, state.buffers.jacobian @ a + drift)


def _least(state: ChainState, right: FloatArray) -> FloatArray:
    """The least x with J x = right, J as last linearised."""
    work, top = state.buffers, state.topology
    gap = state.uncertainty(state.scaled_gap())
    found: FloatArray = nearest_motion(work.jacobian, right, top.scales, state.model.njoints, gap, False)[0]
    return found
