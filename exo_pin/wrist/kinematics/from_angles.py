"""Forward kinematics over stacks from θ_yA, and residuals of modes found from angles, compiled.

Every kernel fills, for each of N rows, up to W modes: unit quaternions (x, y, z, w), residual, signed margin, and a
code in ``count`` (their number, or :data:`CONTINUUM`). Modes are ordered by their angle from a reference pose.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ..limbs import limb_vectors
from .assembly import CONTINUUM, MAX_MODES
from .from_lengths import unit_directions
from .solutions import rotation, solve, write_modes

__all__ = ["angle_residuals", "planes_stack", "wrapped"]


@kernel(stack=True, cost=20)
def planes_stack(
    theta_y: Any,
    base: Any,
    platform: Any,
    frames: Any,
    triples: Any,
    reference: Any,
    q: Any,
    residual: Any,
    margin: Any,
    count: Any,
) -> None:
    """All poses with given θ_yA.

    The angle fixes the half-plane, bounded by the line O A_i, in which B_i lies: X_i · R B_i = 0 with
    X_i = (cos θy, 0, -sin θy) in {A_i}, and B_i on the side of (sin θy, 0, cos θy). The first has at most eight
    solutions; the second selects among them. Arguments as :func:`.lengths_stack`; ``frames`` is {A_i}, shape
    (n, 3, 3); the residual is computed by the caller.
    """
    n = base.shape[0]
    u, v, size = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 2))
    unit_directions(base, platform, u, v, size)
    X, side, c = np.empty((n, 3)), np.empty((n, 3)), np.zeros(n)
    R, margins, errors = np.empty((MAX_MODES, 3, 3)), np.empty(MAX_MODES), np.empty(MAX_MODES)
    for k in range(theta_y.shape[0]):
        count[k] = 0
        finite = True
        for i in range(n):
            finite = finite and math.isfinite(theta_y[k, i])
            cosine, sine = math.cos(theta_y[k, i]), math.sin(theta_y[k, i])
            for j in range(3):
                X[i, j] = frames[i, j, 0] * cosine - frames[i, j, 2] * sine
                side[i, j] = frames[i, j, 0] * sine + frames[i, j, 2] * cosine
        if not finite:
            continue
        found = solve(X, v, c, triples, R, margins)
        if found == CONTINUUM:
            count[k] = CONTINUUM
            continue
        for m in range(found):
            errors[m] = 0.0
            for i in range(n):
                ahead = 0.0
                for j in range(3):
                    ahead += side[i, j] * (R[m, j, 0] * v[i, 0] + R[m, j, 1] * v[i, 1] + R[m, j, 2] * v[i, 2])
                if not ahead > 0.0:
                    errors[m] = math.nan
        count[k] = write_modes(R, margins, errors, found, reference, q[k], residual[k], margin[k], 0)


@kernel(stack=True)
def angle_residuals(
    theta: Any,
    about_x: bool,
    base: Any,
    platform: Any,
    frames: Any,
    tolerance: float,
    q: Any,
    residual: Any,
    margin: Any,
    count: Any,
) -> None:
    """Fill the residual of modes found from θ_xA or θ_yA alone, rad: the largest error of an angle.

    With more than three limbs, modes with a residual above ``tolerance`` are dropped.
    """
    n = base.shape[0]
    R, b, s, X = np.empty((3, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    length, reach = np.empty(n), np.empty(n)
    for k in range(theta.shape[0]):
        selected = 0
        for m in range(count[k]):
            rotation(q[k, m], R)
            limb_vectors(R, base, platform, b, s, X, length, reach)
            worst = 0.0
            for i in range(n):
                x = frames[i, 0, 0] * s[i, 0] + frames[i, 1, 0] * s[i, 1] + frames[i, 2, 0] * s[i, 2]
                y = frames[i, 0, 1] * s[i, 0] + frames[i, 1, 1] * s[i, 1] + frames[i, 2, 1] * s[i, 2]
                z = frames[i, 0, 2] * s[i, 0] + frames[i, 1, 2] * s[i, 1] + frames[i, 2, 2] * s[i, 2]
                angle = math.atan2(-y, math.hypot(x, z)) if about_x else math.atan2(x, z)
                worst = max(worst, abs(wrapped(theta[k, i] - angle)))
            if n > 3 and worst > tolerance:
                continue
            q[k, selected], residual[k, selected], margin[k, selected] = q[k, m], worst, margin[k, m]
            selected += 1
        for m in range(selected, count[k]):
            q[k, m], residual[k, m], margin[k, m] = np.nan, np.nan, np.nan
        if count[k] > selected:
            count[k] = selected


@kernel
def wrapped(angle: float) -> float:
    """The angle within ±π."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
