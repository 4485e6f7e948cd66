"""A device along turns of the arm, step by step, compiled: no step is taken that is not verified.

A step predicts the joints by their rates, closes the loops by Newton's method, which must contract, and is accepted if
two half steps arrive at the same configuration and the volume of the loops' rows changes by :data:`_CHANGE` at most on
the way. The volume is zero where the configuration is singular, so that steps towards such a place become shorter in
proportion and none leaps over it to another assembly mode. Where steps of :data:`SHORTEST` fail, the turn ends.

Joints that no loop corrects, where the device has freedoms that leave the arm at rest, are integrated by the
Runge-Kutta method 8(5,3) by Dormand and Prince (Hairer, Norsett, Wanner, Solving ODE I, II.10). In place of half steps
the error that its embedded methods of fifth and third order show, all joints together, is at most :data:`SETTLED` in
each step, and the volume is compared from stage to stage.
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

#: First step of the arm, rad, without and with idle freedoms; the largest; the shortest.
_FIRST, _LARGEST = (0.35, 0.75), (0.6, 0.8)
SHORTEST = 1e-6
#: Two ways to one configuration agree to this, m and rad; the largest error of idle freedoms, as the embedded methods
#: show it, rad and characteristic lengths: ten times the real one or more.
_ALIKE, SETTLED = 1e-7, 1e-5
#: The next step over a verified one, at most, and a shorter one over one that fails, at least; the part of the step
#: that the error allows which is taken.
_LONGER, _SHORTER, _SAFE = 2.0, 0.2, 0.9
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
_SHARES, _FIFTH, _THIRD = np.array(DOP853.C[:12]), np.array(DOP853.E5[:12]), np.array(DOP853.E3[:12])


@kernel(fills=True)
def _slope(device: Any, q: Any, motion: Any, u: Any, room: Any, along: Any) -> float:
    """Rate of a motion from a configuration, whose end q is, along a turn; the log volume at q.

    Turns of balls do not add up: their rates are taken back to the axes at the start.
    """
    least = room[6][0]
    _, volume = rates(device, q, u, room, least, along, False)
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
def _summed(size: float, weights: Any, stages: Any, count: int, out: Any) -> float:
    """Fill a multiple of a weighted sum of the first rows of some stages; the square of its length."""
    square = 0.0
    for k in range(len(out)):
        out[k] = 0.0
    for i in range(count):
        weight = size * weights[i]
        if weight != 0.0:
            for k in range(len(out)):
                out[k] += weight * stages[i, k]
    for k in range(len(out)):
        square += out[k] * out[k]
    return square


@kernel(fills=True)
def _step(
    device: Any, idle: bool, node: Any, before: float, base: Any, u: Any, at: float, to: float, passing: bool,
    room: Any, stages: Any, out: Any,
) -> Any:  # fmt: skip
    """One step along a turn; how much longer a step could be, and the log volume there.

    Less than :data:`_SAFE` means that this one does not arrive, with a leap of the volume or too large an error.

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
    nv, size, largest, longer = len(along), to - at, 0.0, _LONGER
    if idle:
        for k in range(nv):
            stages[0, k] = along[k]
        for s in range(1, 12):
            _summed(size, _STAGES[s], stages, s, motion)
            moved(device, q, motion, base, u, at + size * _SHARES[s], room, there)
            volume = _slope(device, there, motion, u, room, stages[s])
            if not abs(volume - before) <= _CHANGE:
                return 0.5, volume
            before = volume
        fifth, third = _summed(size, _FIFTH, stages, 12, motion), _summed(size, _THIRD, stages, 12, motion)
        if fifth > 0.0:
            longer = min(longer, _SAFE * (SETTLED * math.sqrt(fifth + 0.01 * third) / fifth) ** 0.125)
        if not longer >= _SAFE:
            return max(_SHORTER, longer), before
        _summed(size, _WEIGHTS, stages, 12, motion)
    else:
        for k in range(nv):
            motion[k] = size * (along[k] + 0.5 * size * bend[k])
    for k in range(nv):
        largest = max(largest, abs(motion[k]))
    moved(device, q, motion, base, u, to, room, there)
    good, volume = closed_near(device, there, u, room, _JUMP * largest + _SMALL, passing, after)
    for k in range(nv):
        bent[k] = (after[k] - along[k]) / size
    return longer if good and abs(volume - before) <= _CHANGE else 0.5, volume


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
        rates(device, q, unit, room, room[6][0], along, False)
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
    arm, nv = device[5][0], len(node[1])
    angle, room_left = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), math.inf
    for k in range(4):
        base[k] = q[arm + k]
    if angle == 0.0:
        return 1.0, room_left
    for k in range(len(q)):
        node[0][k] = q[k]
    _, volume = rates(device, q, u, room, room[6][0], node[1], False)
    if not math.isfinite(volume):
        return 0.0, 0.0
    node[2][:] = 0.0
    at, step, largest = 0.0, _FIRST[1 if idle else 0] / angle, _LARGEST[1 if idle else 0] / angle
    while at < 1.0:
        # As many equal steps as it takes to the end. Math has no ceiling where it runs uncompiled.
        count = -math.floor((at - 1.0) / (_WHOLE * step))
        size = (1.0 - at) / count
        to, middle = at + size if count > 1 else 1.0, at + 0.5 * size
        longer, there = _step(device, idle, node, volume, base, u, at, to, idle, room, stages, full)
        if checked and not idle and longer >= _SAFE:
            longer, between = _step(device, False, node, volume, base, u, at, middle, False, room, stages, half)
            if longer >= _SAFE:
                longer, _ = _step(device, False, half, between, base, u, middle, to, True, room, stages, end)
            for k in range(len(q)):
                if not abs(end[0][k] - full[0][k]) <= _ALIKE:
                    longer = 0.5
        step = min(longer * size, largest)
        if longer >= _SAFE:
            for k in range(len(q)):
                node[0][k] = full[0][k]
            for k in range(nv):
                node[1][k] = full[1][k]
                node[2][k] = (full[1][k] - half[1][k]) / (0.5 * size) if checked else full[2][k]
            volume, at = there, to
            if clear:
                room_left = min(room_left, _clearance(device, node, volume, room, spare) / at)
        elif not checked:
            return 0.0, 0.0
        elif step * angle < SHORTEST:
            break
    for k in range(len(q)):
        q[k] = node[0][k]
    return at, room_left
