"""Derivatives of the wrenches of joints and closures; see :mod:`exo_pin.chain.derivatives.dynamics_derivatives`.

Derivatives of the equations of motion along the closed loops; see :mod:`.dynamics_derivatives`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ..dynamics.equations.equations_of_motion import EquationsOfMotion
from ..kinematics.kernels.closure_kernels import closure_wrench_rates
from ..structure.chain_state import ChainState
from ..structure.motion_axes import moving_coordinates, symmetric


class Change(NamedTuple):
    """Changes of an operating point, column by column: with q_i, then v_i, then a_i of the d independent coordinates.

    Attributes
    ----------
    q, v, a : ndarray
        Shape (nv, 3 d): per rad or m, rad/s or m/s, rad/s² or m/s² of the column's coordinate.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray


class OperatingPoint(NamedTuple):
    """State of motion of a chain with its forces, at which derivatives are taken.

    Attributes
    ----------
    state : ChainState
        The chain.
    q, v, a : ndarray
        Shapes (nq,), (nv,), (nv,), a motion that does not open the loops.
    multipliers : ndarray
        λ, shape (rows,), N and N m, the least in the metric "closures".
    equations : EquationsOfMotion
        Equations of motion there.
    external : mapping of str to ndarray
        Frame name to wrench, shape (6,), about the frame's origin, world axes, N and N m.
    gravity : ndarray
        Shape (6,), at that time, linear part first, m/s².
    """

    state: ChainState
    q: FloatArray
    v: FloatArray
    a: FloatArray
    multipliers: FloatArray
    equations: EquationsOfMotion
    external: Mapping[str, FloatArray]
    gravity: FloatArray


def rates_along(state: ChainState, q: FloatArray, directions: FloatArray) -> FloatArray:
    """∂J along each direction, shape (columns, rows, nv)."""
    work = state.buffers
    found = np.zeros((directions.shape[1], state.row_count, state.model.nv))
    for k, direction in enumerate(directions.T):
        if direction.any():
            work.drift_of(q, np.ascontiguousarray(direction))
            found[k] = work.jacobian_rate
    return found


def tree_derivatives(
    state: ChainState, q: FloatArray, v: FloatArray, a: FloatArray, external: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of the open tree's generalised forces with respect to q, v and a, of the last the lower half.

    Windows of the buffers, shapes (nv, nv). The poses, Jacobians and ``tree`` of the buffers are filled, too, unless
    joints have axes that move.
    """
    constant, work = state.axes, state.buffers
    data, (by_q, by_v, _) = work.rate_data, work.trees
    pushed = _pushed(state, q, external) if external else None
    constant.rnea_derivatives(data, q, v, a)
    if state.passive.act:
        unit, none = np.eye(state.nv), np.zeros((state.nv, state.nv))
        by_q -= state.passive.change(q, unit, none)
        by_v -= state.passive.change(q, none, unit)
    if pushed is not None:
        by_q -= pushed
    return work.trees


def _pushed(state: ChainState, q: FloatArray, external: Mapping[str, FloatArray]) -> FloatArray:
    """Derivatives of the generalised forces of wrenches on frames with respect to q, shape (nv, nv)."""
    constant, data, axes = state.axes, state.buffers.rate_data, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    found = np.zeros((state.nv, state.nv))
    for name, wrench in external.items():
        for k, direction in enumerate(np.eye(state.nv)):
            constant.jacobian_rate(data, q, direction)
            pin.updateFramePlacements(constant.model, data)
            rate = pin.getFrameJacobianTimeVariation(constant.model, data, state.frames[name], axes)
            found[:, k] += np.reshape(rate, (6, state.nv)).T @ wrench
    return found


def open_change(point: OperatingPoint, change: Change) -> FloatArray:
    """Change of the open tree's generalised forces, shape (nv, columns)."""
    by_q, by_v, lower = tree_derivatives(point.state, point.q, point.v, point.a, point.external)
    return np.asarray(by_q @ change.q + by_v @ change.v + symmetric(lower) @ change.a)


def _turning(point: OperatingPoint, body: int, directions: FloatArray) -> FloatArray:
    """Rotation of a body along each direction, world axes, shape (3, columns)."""
    work = point.state.buffers
    work.linearise(point.q)
    return np.asarray(work.J.T[3:] * moving_coordinates(point.state.model)[body] @ directions)


def closure_change(
    point: OperatingPoint, index: int, change: Change, multipliers: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Change of a closure's wrench in the axes of frame a, and the turning of these axes."""
    state, top = point.state, point.state.topology
    work = state.buffers
    work.linearise(point.q)
    out = np.zeros((6, change.q.shape[1]))
    closure_wrench_rates(
        work.poses, work.J, np.ascontiguousarray(change.q.T), top.loops, index, point.multipliers,
        np.ascontiguousarray(multipliers.T), out,
    )  # fmt: skip
    return out, _turning(point, int(top.joints[index, 0]), change.q)


def joint_change(
    point: OperatingPoint, index: int, change: Change, multipliers: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Change of a tree joint's wrench in its child link's axes, and the turning of these axes."""
    state, known = point.state, point.state.freed_chains
    if index not in known:
        known[index] = _freed(state, index)
    freed, into = known[index]
    freed.model.gravity = pin.Motion(point.gravity)
    for body in range(1, state.model.njoints):
        freed.model.inertias[body] = state.model.inertias[body]
    data = state.buffers.data
    pin.forwardKinematics(state.model, data, point.q)
    pose = pin.SE3ToXYZQUAT(state.model.jointPlacements[index].actInv(data.liMi[index]))
    q = freed.neutral()
    for joint, name in enumerate(state.model.names):
        if joint:
            here = point.q[state.configuration_slice(name)]
            q[freed.configuration_slice(name)] = pose if joint == index else here
    moved = Change(into @ change.q, into @ change.v, into @ change.a)
    # A joint's wrench contains what couplings do in it, as it contains its actuator's effort.
    loops = np.setdiff1d(np.arange(state.row_count), state.topology.coupled[:, 0])
    multipliers = multipliers[loops]
    beyond = point._replace(state=freed, q=q, v=into @ point.v, a=into @ point.a, multipliers=point.multipliers[loops])
    found = open_change(beyond, moved) - np.einsum("kij,i->jk", rates_along(freed, q, moved.q), beyond.multipliers)
    freed.buffers.linearise(q)
    found -= freed.buffers.jacobian.T @ multipliers
    own = freed.velocity_slice(state.model.names[index])
    return found[own], _turning(point, index, change.q)


def _freed(state: ChainState, index: int) -> tuple[ChainState, FloatArray]:
    """The chain with one joint replaced by a free flight, and the map of velocities to it, shape (nv', nv).

    Raises
    ------
    InvalidInput
        If the joint's axes move in its child link.
    """
    model = state.model
    still = pin.neutral(model)
    moved = pin.integrate(model, still, np.linspace(0.3, 0.9, model.nv))
    axes = [_subspace(model, index, q) for q in (still, moved)]
    if np.abs(axes[0] - axes[1]).max(initial=0.0) > 1e-9:
        raise InvalidInput(
            f"the axes of joint {model.names[index]!r} move in its child link: expected constant axes, replace it by "
            "several simpler joints"
        )
    other = pin.Model()
    for joint in range(1, model.njoints):
        kind = pin.JointModelFreeFlyer() if joint == index else model.joints[joint]
        added = other.addJoint(model.parents[joint], kind, model.jointPlacements[joint], model.names[joint])
        other.appendBodyToJoint(added, model.inertias[joint], pin.SE3.Identity())
    for frame in list(model.frames)[1:]:
        other.addFrame(frame, False)
    # Without springs and couplings: a free flight transmits the whole wrench.
    loops = tuple(closure for closure in state.closures if not closure.kind.is_coupling)
    freed = ChainState(other, replace(state.description, joints=(), closures=loops))
    into = np.zeros((other.nv, model.nv))
    for name in list(model.names)[1:]:
        here, there = state.velocity_slice(name), freed.velocity_slice(name)
        into[there, here] = axes[0] if name == model.names[index] else np.eye(here.stop - here.start)
    return freed, into


def _subspace(model: pin.Model, index: int, q: FloatArray) -> FloatArray:
    """Motion subspace of a joint in its child link's axes, shape (6, nv of the joint)."""
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    J = pin.getJointJacobian(model, data, index, pin.ReferenceFrame.LOCAL)
    # With a single coordinate the bindings give a vector.
    return np.array(np.reshape(J, (6, model.nv))[:, model.idx_vs[index] : model.idx_vs[index] + model.nvs[index]])
