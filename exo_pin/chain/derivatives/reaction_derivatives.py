"""Derivatives of the wrenches of joints and closures; see :mod:`exo_pin.chain.derivatives.dynamics_derivatives`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ..kinematics.kernels.closure_wrench_kernels import closure_wrench_rates
from ..structure.chain_state import ChainState
from ..structure.motion_axes import moving_coordinates
from .state_changes import Change, OperatingPoint, open_change, rates_along


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
