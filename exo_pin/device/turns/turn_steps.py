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

from ...chain.structure.tree_arrays import BALL
from ...core.compiled import PLAIN_WORK, kernel
from .turn_rates import closed_near, moved, new_room, rates

__all__ = ["follow_turns"]

#: First, largest and shortest step of the arm, rad; without and with idle freedoms.
_FIRST, _LARGEST = (0.35, 0.6), (0.6, 0.6)
SHORTEST = 1e-6
#: Two ways to one configuration agree to this, m and rad; of idle freedoms to this.
_ALIKE, SETTLED = 1e-7, 1e-7
#: Largest change of the logarithm of the volume in a step.
_CHANGE = math.log(2.0)
#: Part of the largest predicted motion by which closed joints may differ from predicted ones, and an absolute part.
_JUMP, _SMALL = 0.35, 1e-6
#: Of the Runge-Kutta method.
_STAGES, _WEIGHTS = np.ascontiguousarray(DOP853.A[:12, :12]), np.array(DOP853.B)
_SHARES = np.array(DOP853.C[:12])


@kernel
def _slope(device: Any, q: Any, motion: Any, u: Any, room: Any, along: Any) -> float:
    """Rate of a motion from a configuration, whose end q is, along a turn; the log volume at q.

    Turns of balls do not add up: their rates are taken back to the axes at the start.
    """
    least = room[4][0]
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


@kernel
def _step(
    device: Any, idle: bool, q: Any, along: Any, base: Any, u: Any, at: float, to: float, room: Any, stages: Any,
    out: Any, after: Any,
) -> Any:  # fmt: skip
    """One step along a turn, not verified; whether it arrives, and the log volume there.

    Parameters
    ----------
    q, along : ndarray
        Configuration at the share ``at`` of the turn, and its rates, shape (nv,).
    out, after : ndarray
        The same at the share ``to``, filled.
    """
    motion, nv = stages[12], len(along)
    if idle:
        stages[0] = along
        for s in range(1, 12):
            for k in range(nv):
                total = 0.0
                for i in range(s):
                    total += _STAGES[s, i] * stages[i, k]
                motion[k] = (to - at) * total
            moved(device, q, motion, base, u, at + (to - at) * _SHARES[s], room, out)
            if not math.isfinite(_slope(device, out, motion, u, room, stages[s])):
                return False, -math.inf
        for k in range(nv):
            total = 0.0
            for i in range(12):
                total += _WEIGHTS[i] * stages[i, k]
            motion[k] = (to - at) * total
    else:
        for k in range(nv):
            motion[k] = (to - at) * along[k]
    largest = 0.0
    for k in range(nv):
        largest = max(largest, abs(motion[k]))
    moved(device, q, motion, base, u, to, room, out)
    return closed_near(device, out, u, room, _JUMP * largest + _SMALL, after)


@kernel
def _followed(device: Any, idle: bool, q: Any, u: Any, checked: bool, room: Any, memory: Any) -> float:
    """Follow a turn from a closed configuration, in place; the share of it that was followed."""
    stages, nodes, slopes, base = memory
    arm = device[5][0]
    angle = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    for k in range(4):
        base[k] = q[arm + k]
    if angle == 0.0:
        return 1.0
    _, volume = rates(device, q, u, room, room[4][0], slopes[0])
    if not math.isfinite(volume):
        return 0.0
    nodes[0] = q
    at, step = 0.0, (_FIRST[1] if idle else _FIRST[0]) / angle
    largest, close = (_LARGEST[1] if idle else _LARGEST[0]) / angle, SETTLED if idle else _ALIKE
    while at < 1.0:
        size = min(step, 1.0 - at)
        to = 1.0 if size == 1.0 - at else at + size
        good, there = _step(device, idle, nodes[0], slopes[0], base, u, at, to, room, stages, nodes[1], slopes[1])
        good = good and abs(there - volume) <= _CHANGE
        if good and checked:
            half = at + 0.5 * size
            good, first = _step(device, idle, nodes[0], slopes[0], base, u, at, half, room, stages, nodes[2], slopes[2])
            if good and abs(first - volume) <= _CHANGE:
                good, second = _step(
                    device, idle, nodes[2], slopes[2], base, u, half, to, room, stages, nodes[3], slopes[3]
                )
                good = good and abs(second - first) <= _CHANGE
            else:
                good = False
            if good:
                for k in range(len(q)):
                    if not abs(nodes[3, k] - nodes[1, k]) <= close:
                        good = False
        if good:
            nodes[0], slopes[0], volume, at = nodes[1], slopes[1], there, to
            step = min(2.0 * size, largest)
        elif not checked:
            return 0.0
        else:
            step = 0.5 * size
            if step * angle < SHORTEST:
                break
    q[:] = nodes[0]
    return at


@kernel(stack=True, cost=PLAIN_WORK + 1)
def follow_turns(q: Any, device: Any, idle: bool, turns: Any, checked: bool, share: Any) -> None:
    """Follow one turn from each configuration.

    Parameters
    ----------
    q : ndarray
        Shape (N, nq), closed; on return the last configuration that was reached.
    device : tuple
        What :func:`exo_pin.device.turns.turn_arrays.turn_arrays` returns.
    idle : bool
        Whether freedoms of the device leave the arm at rest.
    turns : ndarray
        Shape (N, 3), rotation vectors in the arm's axes.
    checked : bool
        Whether half steps verify each step; else a turn is followed in one step or not at all.
    share : ndarray
        Shape (N,), filled: the share of each turn that was followed.
    """
    tree, loops, (_, column), _, _, _, _ = device
    room, nv = new_room(tree, column, loops), len(column)
    memory = np.zeros((13, nv)), np.zeros((4, q.shape[1])), np.zeros((4, nv)), np.zeros(4)
    for k in range(len(q)):
        share[k] = _followed(device, idle, q[k], turns[k], checked, room, memory)
