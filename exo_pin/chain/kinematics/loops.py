"""The loops of a chain at a configuration: residual, Jacobian and drift, and poses of frames."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray
from ..structure.chain_state import ChainState


def placement(state: ChainState, q: ArrayLike, frame: str) -> pin.SE3:
    """Pose of a frame in the world.

    Raises
    ------
    UnknownName
        If there is no such frame.
    """
    found = state.model.frames[state.frame_index(frame)]
    data = state.buffers.data
    pin.forwardKinematics(state.model, data, state.configuration(q))
    return data.oMi[found.parentJoint] * found.placement


def placements(state: ChainState, q: ArrayLike) -> dict[str, pin.SE3]:
    """Poses of all frames (links, joints, "universe") in the world, by name."""
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
    """Residual of the loops, shape (rows,), m and rad, in the rows that the class describes; zero if closed."""
    work = state.buffers
    work.residual(state.configuration(q))
    return work.gap.copy()


def constraint_jacobian(state: ChainState, q: ArrayLike) -> FloatArray:
    """Jacobian of the closures, shape (rows, nv): J v is the twist of frames a against frames b.

    On closed loops it is the derivative of :func:`residual`. Off them the rows in metres still are; those in radians
    are the relative angular velocity, of which the rotation vector's rate is an invertible function.
    """
    work = state.buffers
    work.linearise(state.configuration(q))
    return work.jacobian.copy()


def constraint_drift(state: ChainState, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """The part of the closures' acceleration that v makes, J̇ v, shape (rows,), m/s² and rad/s².

    A motion does not open the loops if J v = 0 and J a + J̇ v = 0.
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
    if not worst <= state.closed:
        raise LoopNotClosed(array.copy(), worst, 0)
    return array
