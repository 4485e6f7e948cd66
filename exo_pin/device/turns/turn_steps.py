"""A device along turns of the arm, step by step, compiled: no step is taken that is not verified.

A step predicts the joints by their rates, closes the loops by Newton's method, which must contract, and is accepted if
two half steps arrive at the same configuration and the volume of the loops' rows changes by :data:`_CHANGE` at most on
the way. The volume is zero where the configuration is singular, so that steps towards such a place become shorter in
proportion and none leaps over it to another assembly mode. Where steps of :data:`SHORTEST` fail, the turn ends.

Joints that no loop corrects, where the device has freedoms that leave the arm at rest, are integrated by the
Runge-Kutta method of eighth order by Dormand and Prince; of them half steps agree to :data:`SETTLED`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import DOP853

from ...chain.kinematics.kernels.tree_kernels import BALL
from ...core.compiled import kernel
from .turn_rates import closed_near, moved, rates

__all__ = ["followed"]

#: First step of the arm, rad; the largest without and with idle freedoms, where it is the first, too; the shortest.
_FIRST, _LARGEST = 0.35, (0.6, 0.6)
SHORTEST = 1e-6
#: Two ways to one configuration agree to this, m and rad; of idle freedoms to this.
_ALIKE, SETTLED = 1e-7, 1e-6
#: A step that leaves less than this part of itself goes to the end.
_WHOLE = 1.0 + 1e-9
#: Largest change of the logarithm of the volume in a step, or from one stage of it to the next.
_CHANGE = math.log(2.0)
#: Step of the arm, rad, for the slope of that logarithm, and the change of it that is clear of a singular place.
_PROBE, _CLEAR = 1e-4, 0.25
#: Part of the largest predicted motion by which closed joints may differ from predicted ones, and an absolute part.
_JUMP, _SMALL = 0.35, 1e-6
#: Of the Runge-Kutta method.
_STAGES, _WEIGHTS = np.ascontiguousarray(DOP853.A[:12, :12]), np.array(DOP853.B)
_SHARES = np.array(DOP853.C[:12])


@kernel(fills=True)
def _slope(device: Any, q: Any, motion: Any, u: Any, room: Any, along: Any) -> float:
    """Rate of a motion from a configuration, whose end q is, along a turn; the log volume at q.

    Turns of balls do not add up: their rates are taken back to the axes at the start.
    """
    least = room[6][0]
    _, volume = rates(device, q, u, room, least, along)
    links = device[0][0]
    for j in range(1, len(links)):
        if links[j, 1] != BALL:
            continue
        b = links[j, 3]
        x, y, z = motion[b], motion[b + 1], motion[b + 2]
        square = x * x + y * y + z * z
        if square == 0.0:
            continue
        angle = math.sqrt(square)
        factor = 1.0 / 12.0 + square / 720.0
        if angle > 1e-2:
            factor = (1.0 - 0.5 * angle / math.tan(0.5 * angle)) / square
        u0, u1, u2 = along[b], along[b + 1], along[b + 2]
        a0, a1, a2 = y * u2 - z * u1, z * u0 - x * u2, x * u1 - y * u0
        along[b] = u0 + 0.5 * a0 + factor * (y * a2 - z * a1)
        along[b + 1] = u1 + 0.5 * a1 + factor * (z * a0 - x * a2)
        along[b + 2] = u2 + 0.5 * a2 + factor * (x * a1 - y * a0)
    return volume


@kernel(fills=True)
def _step(
    device: Any, idle: bool, node: Any, before: float, base: Any, u: Any, at: float, to: float, passing: bool,
    room: Any, stages: Any, out: Any,
) -> Any:  # fmt: skip
    """One step along a turn, not verified; whether it arrives, without a leap of the volume, and its logarithm there.

    Parameters
    ----------
    node : tuple of ndarray
        Configuration at the share ``at`` of the turn, and first and second rates of the joints, shape (nv,).
    before : float
        The log volume there.
    base : ndarray
        The arm's quaternion where the turn u begins.
    passing : bool
        Whether the end is only compared or passed.
    out : tuple of ndarray
        The same at the share ``to``, filled.
    """
    (q, along, bend), (there, after, bent), motion = node, out, stages[12]
    nv, size, largest = len(along), to - at, 0.0
    if idle:
        for k in range(nv):
            stages[0, k] = along[k]
        for s in range(1, 12):
            for k in range(nv):
                total = 0.0
                for i in range(s):
                    total += _STAGES[s, i] * stages[i, k]
                motion[k] = size * total
            moved(device, q, motion, base, u, at + size * _SHARES[s], room, there)
            volume = _slope(device, there, motion, u, room, stages[s])
            if not abs(volume - before) <= _CHANGE:
                return False, volume
            before = volume
        for k in range(nv):
            total = 0.0
            for i in range(12):
                total += _WEIGHTS[i] * stages[i, k]
            motion[k] = size * total
    else:
        for k in range(nv):
            motion[k] = size * (along[k] + 0.5 * size * bend[k])
    for k in range(nv):
        largest = max(largest, abs(motion[k]))
    moved(device, q, motion, base, u, to, room, there)
    good, volume = closed_near(device, there, u, room, _JUMP * largest + _SMALL, passing, after)
    for k in range(nv):
        bent[k] = (after[k] - along[k]) / size
    return good and abs(volume - before) <= _CHANGE, volume


@kernel(fills=True)
def _clearance(device: Any, node: Any, volume: float, room: Any, spare: Any) -> float:
    """How far the arm may turn about any axis before the volume changes by :data:`_CLEAR` of itself, rad, about.

    Towards a singular configuration the volume falls as the distance or as its root, so that the distance is several
    times this.
    """
    q, _, _ = node
    there, along, unit = spare[0], spare[1], spare[2]
    arm, steepest = device[5][0], 0.0
    for k in range(3):
        unit[0], unit[1], unit[2] = 0.0, 0.0, 0.0
        unit[k] = _PROBE
        rates(device, q, unit, room, room[6][0], along)
        moved(device, q, along, q[arm : arm + 4], unit, 1.0, room, there)
        good, other = closed_near(device, there, unit, room, math.inf, True, along)
        if not good:
            return 0.0
        steepest += ((other - volume) / _PROBE) ** 2
    return _CLEAR / math.sqrt(steepest) if steepest > 0.0 else math.inf


@kernel(fills=True)
def followed(device: Any, idle: bool, q: Any, u: Any, checked: bool, clear: bool, room: Any, memory: Any) -> Any:
    """Follow a turn from a closed configuration, in place; the share of it that was followed, and its clearance."""
    stages, base, node, full, half, end, spare = memory
    arm, close, nv = device[5][0], SETTLED if idle else _ALIKE, len(node[1])
    angle, room_left = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), math.inf
    for k in range(4):
        base[k] = q[arm + k]
    if angle == 0.0:
        return 1.0, room_left
    for k in range(len(q)):
        node[0][k] = q[k]
    _, volume = rates(device, q, u, room, room[6][0], node[1])
    if not math.isfinite(volume):
        return 0.0, 0.0
    node[2][:] = 0.0
    at, step, largest = 0.0, _FIRST / angle, _LARGEST[1 if idle else 0] / angle
    if idle:
        # Math has no ceiling where it runs uncompiled.
        step = largest = -1.0 / math.floor(-1.0 / largest)
    while at < 1.0:
        size = step if 1.0 - at > _WHOLE * step else 1.0 - at
        to, middle = 1.0 if size == 1.0 - at else at + size, at + 0.5 * size
        passing = idle and to < 1.0
        good, there = _step(device, idle, node, volume, base, u, at, to, passing, room, stages, full)
        if good and checked:
            good, between = _step(device, idle, node, volume, base, u, at, middle, idle, room, stages, half)
            if good:
                good, _ = _step(device, idle, half, between, base, u, middle, to, True, room, stages, end)
            for k in range(len(q)):
                apart = abs(end[0][k] - full[0][k])
                good = good and apart <= close
                if idle and not apart <= 0.5 * close:
                    room_left = 0.0
        if good:
            for k in range(len(q)):
                node[0][k] = full[0][k]
            for k in range(nv):
                node[1][k] = full[1][k]
                node[2][k] = (full[1][k] - half[1][k]) / (0.5 * size) if checked else full[2][k]
            volume, at = there, to
            step = min(2.0 * size, largest)
            if clear:
                room_left = min(room_left, _clearance(device, node, volume, room, spare) / at)
        elif not checked:
            return 0.0, 0.0
        else:
            step = 0.5 * size
            if idle:
                room_left = 0.0
            if step * angle < SHORTEST:
                break
    for k in range(len(q)):
        q[k] = node[0][k]
    return at, room_left
