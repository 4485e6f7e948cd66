"""The approach to twins for limbs between two joint centres, compiled: the steps of :mod:`.twins` for one start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...load_case.case import BACKWARD, IN_FRONT, INTO_BODY, INWARD, OUTWARD
from ...numerics.vectors import cross, dot, matrix, root, triple, turn, vector
from ...wrist.kinematics.assembly import rotate

#: Steps of least squares, the longest of them, rad, and what is too little to go on.
STEPS, LONGEST, LITTLE = 12, 0.35, 1e-4


@kernel(inline=True)
def _is_beyond(R: Any, outward: float) -> bool:
    """:func:`.beyond_motion` of one pose; ``outward``: 1 for a left shoulder, -1 for a right one."""
    forward, out = -R[0, 2], -outward * R[1, 2]
    turned = outward * math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
    through = out < -INTO_BODY and forward < IN_FRONT
    return forward < -BACKWARD or through or turned < INWARD or turned > OUTWARD


@kernel
def _differences(R: Any, base: Any, platform: Any, tolerance: Any, own: Any, rest: Any, rows: Any) -> float:
    """Fill the differences of the lengths over their tolerances and their rates; return the sum of squares."""
    total = 0.0
    for i in range(base.shape[0]):
        a, b = vector(base, i), turn(matrix(R), vector(platform, i))
        span = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
        length = root(dot(span, span))
        rest[i] = length / tolerance[i] - own[i]
        scale = 1.0 / max(length * tolerance[i], 1e-300)
        # b × s = -b × a over the length.
        row = cross(a, b)
        rows[i, 0], rows[i, 1], rows[i, 2] = row[0] * scale, row[1] * scale, row[2] * scale
        total += rest[i] * rest[i]
    return total


@kernel(inline=True)
def _step(rows: Any, rest: Any, damping: float) -> Any:
    """The damped step of least squares, no longer than the longest, rad."""
    xx = xy = xz = yy = yz = zz = gx = gy = gz = 0.0
    for i in range(rows.shape[0]):
        x, y, z = vector(rows, i)
        xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
        gx, gy, gz = gx + x * rest[i], gy + y * rest[i], gz + z * rest[i]
    more = (damping + 1e-12) * (xx + yy + zz) + 1e-300
    first, second, third = (xx + more, xy, xz), (xy, yy + more, yz), (xz, yz, zz + more)
    g, volume = (-gx, -gy, -gz), triple(first, second, third)
    x, y, z = triple(g, second, third) / volume, triple(first, g, third) / volume, triple(first, second, g) / volume
    size = root(x * x + y * y + z * z)
    cut = min(1.0, LONGEST / size) if size > 0.0 else 1.0
    return x * cut, y * cut, z * cut


@kernel
def _keep_away(R: Any, centre: Any, least: float) -> None:
    """Push a pose that is nearer to another than ``least`` out to that angle, along the same turn."""
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += R[i, j] * centre[i, j]
    cosine = min(1.0, max(-1.0, 0.5 * (trace - 1.0)))
    if cosine <= math.cos(least):
        return
    angle = math.acos(cosine)
    # Twice the sine times the axis, from R centreᵀ.
    x = dot(R[2], centre[1]) - dot(R[1], centre[2])
    y = dot(R[0], centre[2]) - dot(R[2], centre[0])
    z = dot(R[1], centre[0]) - dot(R[0], centre[1])
    size = root(x * x + y * y + z * z)
    if size > 0.0:
        more = (least - angle) / size
        rotate(R, x * more, y * more, z * more)


@kernel(stack=True, cost=8)
def approach_limbs(
    starts: Any, row: Any, matrices: Any, own: Any, base: Any, platform: Any, base_offset: Any, cuff_offset: Any,
    tolerance: Any, least: float, outward: float, difference: Any, place: Any,
) -> None:  # fmt: skip
    """Approach twins from S starts, each of the pose ``row`` of N.

    Parameters
    ----------
    starts : ndarray
        Shape (S, 3, 3).
    row : ndarray of int
        Shape (S,).
    matrices, own : ndarray
        Shape (N, 3, 3); lengths over tolerances, shape (N, n).
    base, platform, base_offset, cuff_offset : ndarray
        As of :func:`exo_pin.workspace.kernels.kinematic_stack`.
    tolerance : ndarray
        Shape (n,), m.
    least, outward : float
        Angle of a twin, rad; 1 for a left shoulder, -1 for a right one.
    difference, place : ndarray
        Written: least root of the sum of squares on the way within the range of motion, shape (S,), infinite if there
        was none; where, shape (S, 3, 3).
    """
    n, same = base.shape[0], base_offset.shape[0] == 1
    a, p = np.empty((n, 3)), np.empty((n, 3))
    rest, rows, new_rest, new_rows = np.empty(n), np.empty((n, 3)), np.empty(n), np.empty((n, 3))
    R, trial = np.empty((3, 3)), np.empty((3, 3))
    for k in range(starts.shape[0]):
        at = row[k]
        shift = 0 if same else at
        a[:, :], p[:, :] = base + base_offset[shift], platform + cuff_offset[shift]
        R[:, :] = starts[k]
        cost, damping = math.sqrt(_differences(R, a, p, tolerance, own[at], rest, rows)), 1e-3
        difference[k] = np.inf
        if not _is_beyond(R, outward):
            difference[k], place[k] = cost, R
        for _ in range(STEPS):
            step = _step(rows, rest, damping)
            trial[:, :] = R
            rotate(trial, step[0], step[1], step[2])
            _keep_away(trial, matrices[at], least)
            value = math.sqrt(_differences(trial, a, p, tolerance, own[at], new_rest, new_rows))
            if value < cost:
                gain, cost = cost - value, value
                R[:, :], rest[:], rows[:, :] = trial, new_rest, new_rows
                damping *= 0.2
                if cost < difference[k] and not _is_beyond(R, outward):
                    difference[k], place[k] = cost, R
                if gain <= LITTLE * max(cost, 1.0):
                    break
            else:
                damping *= 10.0
                if not damping < 1e3:
                    break
