"""All configurations of a device in one pose of the arm, as far as its idle freedoms lead within the joints' limits.

A net of configurations is laid from a given one: each is a step along the idle motions from one before, its loops
closed with the arm held near where the step leads, and away from all others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from ...chain.kinematics.closing import nearest_closed
from ...chain.structure.motion_axes import has_ends, limits_of
from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray
from ..device_model import DeviceModel
from .settled_joints import idle_motions, undriven_motions

__all__ = ["beside", "idle_net", "undriven_joints"]

#: Width of the net by the number of idle freedoms, rad and characteristic lengths; of more than these the last one.
_WIDTH = (0.1, 0.3, 0.6)
#: Most configurations of a net.
MOST = 1500
#: Longest step, part of it by which closing may correct it, and part of the width within which two are one.
_STEP, _JUMP, _SAME = 0.1, 0.35, 0.6
_CLOSED, _CORRECTIONS = 1e-12, 20
#: Size of a joint's part of a motion below which it does not move.
_STILL = 1e-7


def idle_net(model: DeviceModel, q: FloatArray) -> tuple[FloatArray, bool, float]:
    """Configurations from a given one on, shape (k, nq), whether these are all, and the width of the net."""
    free = idle_motions(model, q).shape[1]
    found, places = [q], [_place(model, q)]
    if not free:
        return np.array(found), True, 0.0
    width, at = _WIDTH[min(free, len(_WIDTH)) - 1], 0
    while at < len(found):
        for there in beside(model, found[at], width):
            place = _place(model, there)
            if np.linalg.norm(np.array(places) - place, axis=1).min() < _SAME * width:
                continue
            if len(found) == MOST:
                return np.array(found), False, width
            found.append(there)
            places.append(place)
        at += 1
    return np.array(found), True, width


def beside(model: DeviceModel, q: FloatArray, width: float) -> list[FloatArray]:
    """The configurations a step along and against each idle motion away, those that are within the limits."""
    motions, out = idle_motions(model, q), []
    steps = max(1, int(np.ceil(width / _STEP)))
    for motion in (*motions.T, *-motions.T):
        there, along = q, motion
        for _ in range(steps):
            there, along = _stepped(model, there, along, width / steps, motions.shape[1])
            if there is None:
                break
        else:
            out.append(there)
    return out


def _stepped(model: DeviceModel, q: FloatArray, along: FloatArray, size: float, free: int) -> tuple[Any, FloatArray]:
    """One step in a direction, and the direction there; None where it leads nowhere."""
    state = model.held
    motions = idle_motions(model, q)
    own = motions @ (motions.T @ along)
    length = float(np.linalg.norm(own))
    if motions.shape[1] != free or length < 0.5:
        return None, along
    own /= length
    ahead = pin.integrate(state.model, q, size * own * state.topology.column)
    try:
        closed = nearest_closed(state, ahead, model.fixed, _CLOSED, _CORRECTIONS)[0]
    except LoopNotClosed:
        return None, along
    moved = pin.difference(state.model, ahead, closed) / state.topology.column
    if np.abs(moved).max() > _JUMP * size or not _within(model, closed):
        return None, along
    return closed, own


def _within(model: DeviceModel, q: FloatArray) -> bool:
    limits = limits_of(model.held.model)
    own, ends = q[limits.q_index], has_ends(limits)
    return bool(((own >= limits.lower) & (own <= limits.upper) | ~ends).all())


def _place(model: DeviceModel, q: FloatArray) -> FloatArray:
    """Coordinates of all joints, in which small distances are those of motions, and whole turns are none."""
    own, parts = model.held.model, list[FloatArray]()
    for k in range(1, own.njoints):
        x, nv = q[own.idx_qs[k] : own.idx_qs[k] + own.nqs[k]], own.nvs[k]
        if own.nqs[k] == 4 and nv == 3:
            parts.append(2.0 * x * np.sign(x[np.abs(x).argmax()]))
        elif nv == 1 and own.nqs[k] == 1 and not model.held.topology.metres[own.idx_vs[k]]:
            parts.append(np.array([np.cos(x[0]), np.sin(x[0])]))
        else:
            parts.append(x / (model.held.topology.length if nv == own.nqs[k] else 1.0))
    return np.concatenate(parts)


def undriven_joints(model: DeviceModel, q: FloatArray) -> list[str]:
    """Joints of one coordinate that, held, leave as few undriven freedoms as they can."""
    left, held, own = undriven_motions(model, q), list[str](), model.held.model
    single = [k for k in range(1, own.njoints) if own.nvs[k] == 1 and k != model.arm]
    while left.shape[1]:
        sizes = [float(np.linalg.norm(left[own.idx_vs[k]])) for k in single]
        best = int(np.argmax(sizes)) if sizes else -1
        if best < 0 or sizes[best] <= _STILL:
            break
        held.append(str(own.names[single[best]]))
        left = left @ np.linalg.svd(left[own.idx_vs[single[best]]][None])[2][1:].T
    return held
