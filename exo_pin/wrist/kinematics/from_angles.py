"""Forward kinematics over stacks from θ_yA, and residuals of modes found from angles, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.vectors import dot, matrix, rotation_matrix, turn, turn_back, vector
from ..limbs import fill_limbs
from .assembly import MAX_MODES
from .solutions import Joints, Modes, Solutions, solve, write_modes


@kernel(stack=True, cost=20)
def planes_stack(theta_y: Any, joints: Joints, modes: Modes) -> None:
    """All poses with given θ_yA.

    The angle fixes the half-plane, bounded by the line O A_i, in which B_i lies: X_i · R B_i = 0 with
    X_i = (cos θy, 0, -sin θy) in {A_i}, and B_i on the side of (sin θy, 0, cos θy). The first has at most eight
    solutions; the second selects among them. Arguments as :func:`.lengths_stack`; the residual is computed by the
    caller.
    """
    n = joints.base.shape[0]
    X, side, c = np.empty((n, 3)), np.empty((n, 3)), np.zeros(n)
    found = Solutions(np.empty((MAX_MODES, 3, 3)), np.empty(MAX_MODES), np.empty(MAX_MODES))
    for k in range(theta_y.shape[0]):
        modes.number[k] = 0
        if not np.isfinite(theta_y[k]).all():
            continue
        for i in range(n):
            cosine, sine, frame = math.cos(theta_y[k, i]), math.sin(theta_y[k, i]), matrix(joints.frames[i])
            X[i, 0], X[i, 1], X[i, 2] = turn(frame, (cosine, 0.0, -sine))
            side[i, 0], side[i, 1], side[i, 2] = turn(frame, (sine, 0.0, cosine))
        number = solve(X, joints.v, c, joints.triples, found)
        for m in range(number):
            found.residuals[m] = 0.0
            for i in range(n):
                if not dot(vector(side, i), turn(matrix(found.R[m]), vector(joints.v, i))) > 0.0:
                    found.residuals[m] = math.nan
        modes.number[k] = write_modes(found, number, joints.reference, modes, k, 0)


@kernel(stack=True)
def angle_residuals(theta: Any, about_x: bool, joints: Joints, tolerance: float, modes: Modes) -> None:
    """Fill the residual of modes found from θ_xA or θ_yA alone, rad: the largest error of an angle.

    With more than three limbs, modes with a residual above ``tolerance`` are dropped.
    """
    n = joints.base.shape[0]
    b, s, X, length, reach = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty(n), np.empty(n)
    for k in range(theta.shape[0]):
        selected = 0
        for m in range(modes.number[k]):
            q = modes.q[k, m]
            fill_limbs(rotation_matrix(q[0], q[1], q[2], q[3]), joints.base, joints.platform, b, s, X, length, reach)
            worst = 0.0
            for i in range(n):
                x, y, z = turn_back(matrix(joints.frames[i]), vector(s, i))
                angle = math.atan2(-y, math.hypot(x, z)) if about_x else math.atan2(x, z)
                worst = max(worst, abs(wrapped(theta[k, i] - angle)))
            if n > 3 and worst > tolerance:
                continue
            modes.q[k, selected], modes.residual[k, selected], modes.margin[k, selected] = q, worst, modes.margin[k, m]
            selected += 1
        modes.number[k] = min(modes.number[k], selected)


@kernel
def wrapped(angle: float) -> float:
    """The angle within ±π."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
