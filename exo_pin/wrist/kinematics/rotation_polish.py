"""Newton's method on the rotation group for three equations u_i · R v_i = c_i, compiled."""

from __future__ import annotations

import math
from typing import Any

from ...core.compiled import kernel
from ...numerics.small_linear import solve_cholesky
from ...numerics.vectors import cross, dot, matrix, triple, turn, vector


@kernel
def rotate(R: Any, x: float, y: float, z: float) -> None:
    """Replace R by exp([x y z]) R, Rodrigues."""
    square = x * x + y * y + z * z
    if square == 0.0:
        return
    angle = math.sqrt(square)
    if angle > 1e-4:
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    else:
        s, c = 1.0 - square / 6.0, 0.5 - square / 24.0
    axis = (x, y, z)
    for j in range(3):
        column = (R[0, j], R[1, j], R[2, j])
        first = cross(axis, column)
        second = cross(axis, first)
        R[0, j] = column[0] + s * first[0] + c * second[0]
        R[1, j] = column[1] + s * first[1] + c * second[1]
        R[2, j] = column[2] + s * first[2] + c * second[2]


@kernel
def fill_rows(R: Any, u: Any, v: Any, c: Any, rows: Any, error: Any) -> float:
    """Fill error_i = c_i - u_i·Rv_i and its gradient's rows Rv_i × u_i; return the largest error."""
    worst = 0.0
    pose = matrix(R)
    for i in range(rows.shape[0]):
        axis, turned = vector(u, i), turn(pose, vector(v, i))
        error[i] = c[i] - dot(axis, turned)
        worst = max(worst, abs(error[i]))
        rows[i, 0], rows[i, 1], rows[i, 2] = cross(turned, axis)
    return worst


@kernel
def margin_of(rows: Any) -> float:
    """Smallest singular value of three rows within a factor √3, signed: det / √(second Gram invariant)."""
    second = 0.0
    for i in range(3):
        x, y, z = cross(rows[i], rows[(i + 1) % 3])
        second += x * x + y * y + z * z
    return triple(rows[0], rows[1], rows[2]) / math.sqrt(second) if second > 0.0 else 0.0


@kernel
def _step(rows: Any, error: Any, damping: float) -> tuple[float, float, float]:
    """Newton's step, or with damping Levenberg's."""
    if damping == 0.0:
        determinant = triple(rows[0], rows[1], rows[2])
        if determinant == 0.0:
            return math.nan, math.nan, math.nan
        x = y = z = 0.0
        for i in range(3):
            across = cross(rows[(i + 1) % 3], rows[(i + 2) % 3])
            x, y, z = x + error[i] * across[0], y + error[i] * across[1], z + error[i] * across[2]
        return x / determinant, y / determinant, z / determinant
    G, h = rows.T @ rows, rows.T @ error
    for j in range(3):
        G[j, j] += damping
    solve_cholesky(G, h)
    return h[0], h[1], h[2]


@kernel
def polish(R: Any, u: Any, v: Any, c: Any, rows: Any, error: Any, trial: Any) -> float:
    """Solve from a close start, in place; return the largest error reached."""
    best = fill_rows(R, u, v, c, rows, error)
    damping = 0.0
    for _ in range(60):
        if best <= 2e-16:
            break
        x, y, z = _step(rows, error, damping)
        size = math.sqrt(x * x + y * y + z * z)
        # A step this long leads to another solution than the one at the start (NaN fails the test, too).
        accepted = False
        if size <= 0.2:
            trial[:, :] = R
            rotate(trial, x, y, z)
            worst = fill_rows(trial, u, v, c, rows, error)
            if worst < best:
                accepted = True
                R[:, :] = trial
                stalled = worst > 0.7 * best and worst < 1e-14
                best = worst
                damping *= 0.1
                if damping < 1e-20:
                    damping = 0.0
                if stalled:
                    break
        if not accepted:
            if best < 4e-15 or damping > 1.0:
                break
            fill_rows(R, u, v, c, rows, error)
            damping = 1e-16 if damping == 0.0 else damping * 100.0
    # A step of Newton's iteration for the polar factor takes out the drift of the products.
    for j in range(3):
        for k in range(3):
            total = 0.0
            for m in range(3):
                dot = R[0, m] * R[0, k] + R[1, m] * R[1, k] + R[2, m] * R[2, k]
                total += R[j, m] * dot
            trial[j, k] = 1.5 * R[j, k] - 0.5 * total
    R[:, :] = trial
    return fill_rows(R, u, v, c, rows, error)
