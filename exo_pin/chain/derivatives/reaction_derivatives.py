"""Derivatives of the wrenches of joints and closures; see :mod:`exo_pin.chain.derivatives.dynamics_derivatives`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ..kinematics.closure_wrench_kernels import closure_wrench_rates
from ..structure.chain_state import ChainState
from .state_changes import Change, OperatingPoint, open_change, rates_along

__all__ = ["closure_change", "joint_change", "own_axes"]


def own_axes(point: OperatingPoint, joint: str, closures: list[str]) -> FloatArray:
    """Own axes of a joint or closure, as rows."""
    if joint in closures:
        return point.equations.closure_frame(closures.index(joint))[1]
    return point.equations.poses[point.state.joint_index(joint), :3]


def _turning(point: OperatingPoint, body: int, directions: FloatArray) -> FloatArray:
    """Rotation of a body along each direction, world axes, shape (3, columns)."""
    if body == 0:
        return np.zeros((3, directions.shape[1]))
    state = point.state
    state.workspace.linearise(point.q)
    J = state.workspace.J.T
    moved = np.zeros(state.model.nv, dtype=bool)
    while body:
        moved[state.model.idx_vs[body] : state.model.idx_vs[body] + state.model.nvs[body]] = True
        body = state.model.parents[body]
    return np.asarray(J[3:] * moved @ directions)


def closure_change(
    point: OperatingPoint, index: int, change: Change, multipliers: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Change of a closure's wrench in the axes of frame a, and the turning of these axes."""
    state, top = point.state, point.state.topology
    work = state.workspace
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
    state = point.state
    if index == 0:
        raise InvalidInput("the world has no joint: expected the name of a joint of the tree or of a closure")
    freed, into = _freed(state, index)
    freed.model.gravity = point.gravity
    for body in range(1, state.model.njoints):
        freed.model.inertias[body] = state.model.inertias[body]
    pose = _local_pose(point, index)
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
    freed.workspace.linearise(q)
    found -= freed.workspace.jacobian.T @ multipliers
    own = freed.velocity_slice(state.model.names[index])
    return found[own], _turning(point, index, change.q)


def _local_pose(point: OperatingPoint, index: int) -> FloatArray:
    """Configuration of the free flight that replaces a joint, shape (7,)."""
    model, data = point.state.model, point.state.workspace.data
    pin.forwardKinematics(model, data, point.q)
    local = model.jointPlacements[index].actInv(data.liMi[index])
    return pin.SE3ToXYZQUAT(local)


def _freed(state: ChainState, index: int) -> tuple[ChainState, FloatArray]:
    """The chain with one joint replaced by a free flight, and the map of velocities to it, shape (nv', nv).

    Raises
    ------
    InvalidInput
        If the joint's axes move in its child link.
    """
    known = state.freed_chains
    if index not in known:
        known[index] = _set_free(state, index)
    return known[index]


def _set_free(state: ChainState, index: int) -> tuple[ChainState, FloatArray]:
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
    loops = tuple(closure for closure in state.closures if closure.type != "coupling")
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
