"""Scenario One over stacks, compiled: the pose from both angles of every base joint, by least squares."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ..limbs import limb_vectors
from ..velocity.joint_rates import joint_rows
from .from_angles import wrapped
from .from_lengths import twist_roots, unit_directions
from .rotation_polish import turn
from .solutions import quaternion

__all__ = ["directions_stack"]


@kernel
def _angle_errors(
    R: Any,
    base: Any,
    platform: Any,
    frames: Any,
    theta_x: Any,
    theta_y: Any,
    b: Any,
    s: Any,
    X: Any,
    length: Any,
    reach: Any,
    rows: Any,
    J: Any,
    error: Any,
) -> float:
    """Fill the 2n angle errors and their Jacobian's rows; return the sum of squares (inf for a folded limb)."""
    n = base.shape[0]
    if limb_vectors(R, base, platform, b, s, X, length, reach) > 0:
        return np.inf
    total = 0.0
    for i in range(n):
        joint_rows(base[i], b[i], s[i], X[i], length[i], reach[i], rows)
        x = frames[i, 0, 0] * s[i, 0] + frames[i, 1, 0] * s[i, 1] + frames[i, 2, 0] * s[i, 2]
        y = frames[i, 0, 1] * s[i, 0] + frames[i, 1, 1] * s[i, 1] + frames[i, 2, 1] * s[i, 2]
        z = frames[i, 0, 2] * s[i, 0] + frames[i, 1, 2] * s[i, 1] + frames[i, 2, 2] * s[i, 2]
        error[2 * i] = theta_x[i] - math.atan2(-y, math.hypot(x, z))
        error[2 * i + 1] = wrapped(theta_y[i] - math.atan2(x, z))
        J[2 * i], J[2 * i + 1] = rows[1], rows[2]
        total += error[2 * i] ** 2 + error[2 * i + 1] ** 2
    return total


@kernel(stack=True, cost=20)
def directions_stack(
    theta_x: Any,
    theta_y: Any,
    base: Any,
    platform: Any,
    frames: Any,
    keep: float,
    q: Any,
    residual: Any,
    margin: Any,
    count: Any,
) -> None:
    """Poses from both angles of every base joint (Scenario One), least squares over the 2n angles.

    The angles give each limb's direction s, (4-25); with l² + 2 l (a·s) + |a|² - |b|² = 0 they give its end point, two
    points where both roots are positive (where none is real: the point of the line closest to the platform's
    sphere). Each combination of points is fitted by a rotation (Kabsch), which starts Levenberg's method on the
    angles themselves.

    Parameters
    ----------
    theta_x, theta_y : ndarray
        Shape (N, n), rad.
    base, platform, frames : ndarray
        Shapes (n, 3), (n, 3) and (n, 3, 3).
    keep : float
        Modes with more than this multiple of the least residual (plus 1e-9 rad) are dropped.
    q, residual, margin, count : ndarray
        Shapes (N, 8, 4), (N, 8), (N, 8), (N,), written, best residual first. The residual is the largest error of an
        angle, rad; the margin the smallest singular value of the angles' Jacobian.

    Notes
    -----
    Source: thesis (4-17), (4-21).
    """
    n = base.shape[0]
    u, v, size = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 2))
    unit_directions(base, platform, u, v, size)
    b, s, X = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    length, reach, rows = np.empty(n), np.empty(n), np.empty((5, 3))
    J, error = np.empty((2 * n, 3)), np.empty(2 * n)
    roots, number, lines = np.empty((n, 2)), np.empty(n, dtype=np.int64), np.empty((n, 3))
    R, trial = np.empty((3, 3)), np.empty((3, 3))
    fresh = np.empty(4)
    for k in range(theta_x.shape[0]):
        count[k] = 0
        combinations = 1
        for i in range(n):
            number[i] = 0
            sine, cosine = math.sin(theta_x[k, i]), math.cos(theta_x[k, i])
            for j in range(3):
                lines[i, j] = (
                    frames[i, j, 0] * cosine * math.sin(theta_y[k, i])
                    - frames[i, j, 1] * sine
                    + frames[i, j, 2] * cosine * math.cos(theta_y[k, i])
                )
            if math.isfinite(theta_x[k, i]) and math.isfinite(theta_y[k, i]):
                number[i], _ = twist_roots(sine, size[i, 0], size[i, 1], roots[i])
                if number[i] == 0 and size[i, 0] * sine < 0.0:
                    roots[i, 0], number[i] = -size[i, 0] * sine, 1
            combinations *= number[i]
        for m in range(combinations):
            H = np.zeros((3, 3))
            rest = m
            for i in range(n):
                l = roots[i, rest % number[i]]  # noqa: E741
                rest //= number[i]
                for j in range(3):
                    for e in range(3):
                        H[j, e] += (base[i, j] + l * lines[i, j]) * platform[i, e]
            U, _, Vt = np.linalg.svd(H)
            flip = np.linalg.det(U) * np.linalg.det(Vt)
            for j in range(3):
                for e in range(3):
                    R[j, e] = U[j, 0] * Vt[0, e] + U[j, 1] * Vt[1, e] + (1.0 if flip > 0 else -1.0) * U[j, 2] * Vt[2, e]
            best = _angle_errors(
                R, base, platform, frames, theta_x[k], theta_y[k], b, s, X, length, reach, rows, J, error
            )
            damping = 0.0
            for _ in range(60):
                if not best < np.inf or best < 1e-31:
                    break
                G = J.T @ J
                for j in range(3):
                    G[j, j] += damping * (1.0 + G[j, j]) + 1e-15
                step = np.linalg.solve(G, J.T @ error)
                trial[:, :] = R
                turn(trial, step[0], step[1], step[2])
                total = _angle_errors(
                    trial, base, platform, frames, theta_x[k], theta_y[k], b, s, X, length, reach, rows, J, error
                )
                if total < best:
                    R[:, :] = trial
                    done = best - total <= 1e-15 * best
                    best = total
                    damping *= 0.1
                    if done:
                        break
                else:
                    best = _angle_errors(
                        R, base, platform, frames, theta_x[k], theta_y[k], b, s, X, length, reach, rows, J, error
                    )
                    if damping > 1e3 or step[0] ** 2 + step[1] ** 2 + step[2] ** 2 < 1e-28:
                        break
                    damping = max(10.0 * damping, 1e-6)
            if not best < np.inf:
                continue
            quaternion(R, fresh)
            known = False
            for e in range(count[k]):
                dot = abs(fresh[0] * q[k, e, 0] + fresh[1] * q[k, e, 1] + fresh[2] * q[k, e, 2] + fresh[3] * q[k, e, 3])
                # 1 - cos(angle/2) of two poses closer than about 1e-6 rad.
                known = known or dot > 1.0 - 1e-13
            if known or count[k] == q.shape[1]:
                continue
            largest = np.abs(error).max()
            smallest = math.sqrt(max(0.0, np.linalg.eigvalsh(J.T @ J)[0]))
            place = count[k]
            while place > 0 and residual[k, place - 1] > largest:
                q[k, place] = q[k, place - 1]
                residual[k, place], margin[k, place] = residual[k, place - 1], margin[k, place - 1]
                place -= 1
            q[k, place] = fresh
            residual[k, place], margin[k, place] = largest, smallest
            count[k] += 1
        while count[k] > 0 and residual[k, count[k] - 1] > keep * residual[k, 0] + 1e-9:
            count[k] -= 1
            q[k, count[k]] = np.nan
            residual[k, count[k]] = np.nan
            margin[k, count[k]] = np.nan
