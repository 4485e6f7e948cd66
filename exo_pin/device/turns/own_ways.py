"""Ways of devices that turn the arm about fewer than three axes: such a device seldom can follow a straight turn.

From rest it goes where its own motions bring the arm nearest to the pose, with the loops closed, in steps so short that
no singular configuration is on them (:data:`_STEADY`), until the arm is there or no motion brings it nearer. Of the
motions that do so it makes the least one.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ...chain.kinematics.closing import nearest_closed
from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray
from ..device_model import DeviceModel
from .idle_joints import CLOSED, CORRECTIONS, JUMP

__all__ = ["lacks_turns", "nearest_beside", "own_way", "turns_of"]

#: Longest step and shortest, rad and characteristic lengths, and most steps.
_LONGEST, _SHORTEST, _STEPS = 0.2, 1e-5, 200
#: Change of the smallest singular value of the loops per rad of motion, of rows and coordinates that are scaled.
_STEADY = 2.0
#: Step to a configuration beside another one, in each motion, rad and characteristic lengths.
_BESIDE = 0.02
#: Turn that is rounding, rad; part of the turn that is left which the device must be able to make.
_THERE, _NEARER = 1e-9, 0.02
#: Most steps to what is nearest.
_BESIDES = 20


def lacks_turns(model: DeviceModel, start: FloatArray) -> bool:
    """Whether a device turns the arm about fewer than three axes, at a configuration and beside it.

    One that does so there alone is singular, and has no assembly mode to follow.
    """
    if turns_of(model, start).shape[1] == 3:
        return False
    motions = _motions(model, start)
    beside = _stepped(model, start, _BESIDE * model.held.topology.column * motions.sum(axis=1))
    return beside is not None and turns_of(model, beside).shape[1] < 3


def turns_of(model: DeviceModel, q: FloatArray) -> FloatArray:
    """Turns of the arm that its loops allow, shape (3, k), orthonormal, arm frame."""
    U, s, _ = np.linalg.svd(_motions(model, q)[model.arm_v], full_matrices=False)
    return np.asarray(U[:, s > model.none])


def own_way(model: DeviceModel, start: FloatArray, pose: FloatArray) -> tuple[FloatArray, bool]:
    """The end of the device's own way to a pose, shape (nq,), nearest to it, and whether that is the pose.

    Parameters
    ----------
    model : DeviceModel
        The device.
    start : ndarray
        Closed configuration of the held tree with the arm hanging, shape (nq,).
    pose : ndarray
        Quaternion of the arm, shape (4,).
    """
    state, q, step = model.held, start, _LONGEST
    s = np.linalg.svd(model.scaled_rows(start)[:, model.moving], compute_uv=False)
    last = int((s > model.none * s.max(initial=0.0)).sum()) - 1
    for _ in range(_STEPS):
        left = _left(model, q, pose)
        size = float(np.linalg.norm(left))
        if size <= _THERE:
            return _placed(model, q, pose)
        motions = _motions(model, q)
        move = state.topology.column * (motions @ np.linalg.lstsq(motions[model.arm_v], left, rcond=model.none)[0])
        s = np.linalg.svd(model.scaled_rows(q)[:, model.moving], compute_uv=False)
        step = min(step, _LONGEST, float(s[last]) / _STEADY if last >= 0 else _LONGEST)
        length = float(np.abs(move / state.topology.column).max(initial=0.0))
        if step < min(_SHORTEST, length) or np.linalg.norm(move[model.arm_v]) < _NEARER * size:
            break
        there = _stepped(model, q, min(1.0, step / length) * move)
        if there is not None and np.linalg.norm(_left(model, there, pose)) < size:
            q, step = there, 2.0 * step
        else:
            step *= 0.5
    return nearest_beside(model, q, pose), False


def nearest_beside(model: DeviceModel, q: FloatArray, pose: FloatArray) -> FloatArray:
    """The closed configuration, shape (nq,), beside another one with the arm nearest to a pose, a quaternion.

    No motion of the device then turns the arm towards the pose: to the turn that is left all of them are at right
    angles.
    """
    for _ in range(_BESIDES):
        motions = _motions(model, q)
        step = motions @ np.linalg.lstsq(motions[model.arm_v], _left(model, q, pose), rcond=model.none)[0]
        there = _stepped(model, q, model.held.topology.column * step)
        if there is None:
            break
        q = there
        if np.abs(step).max() < _THERE:
            break
    return q


def _motions(model: DeviceModel, q: FloatArray) -> FloatArray:
    """Motions of all joints that keep the loops closed, shape (nv, k), orthonormal, characteristic lengths and rad."""
    own = np.union1d(model.moving, np.arange(model.arm_v.start, model.arm_v.stop))
    _, s, Vt = np.linalg.svd(model.scaled_rows(q)[:, own])
    free = Vt[int((s > model.none * s.max(initial=0.0)).sum()) :]
    out = np.zeros((model.held.nv, len(free)))
    out[own] = free.T
    return out


def _left(model: DeviceModel, q: FloatArray, pose: FloatArray) -> FloatArray:
    """The turn that is left, rotation vector in the arm's axes, rad."""
    return np.asarray((Rotation.from_quat(q[model.arm_q]).inv() * Rotation.from_quat(pose)).as_rotvec())


def _stepped(model: DeviceModel, q: FloatArray, move: FloatArray) -> FloatArray | None:
    """The closed configuration near where a motion leads, or None."""
    state = model.held
    there = pin.integrate(state.model, q, move)
    fixed = np.setdiff1d(model.fixed, np.arange(model.arm_v.start, model.arm_v.stop))
    try:
        closed = nearest_closed(state, there, fixed, CLOSED, CORRECTIONS)[0]
    except LoopNotClosed:
        return None
    off = pin.difference(state.model, there, closed)
    size, apart = (np.abs(part / state.topology.column).max() for part in (move, off))
    return closed if apart <= JUMP * size + CLOSED else None


def _placed(model: DeviceModel, q: FloatArray, pose: FloatArray) -> tuple[FloatArray, bool]:
    """The closed configuration with the arm exactly in the pose, if there is one."""
    there = q.copy()
    there[model.arm_q] = pose
    try:
        closed = nearest_closed(model.held, there, model.fixed, CLOSED, CORRECTIONS)[0]
    except LoopNotClosed:
        return q, False
    closed[model.arm_q] = pose
    return closed, True
