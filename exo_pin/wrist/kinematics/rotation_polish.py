"""Newton's method on the rotation group for three equations u_i · R v_i = c_i, compiled."""

from __future__ import annotations

import math
from typing import Any

from ...core.compiled import kernel
from ...numerics.vectors import cross, triple

__all__ = ["margin_of", "polish", "turn"]


@kernel
def turn(R: Any, x: float, y: float, z: float) -> None:
    """Replace R by exp([x y z]) R, Rodrigues."""
    square = x * x + y * y + z * z
    if square == 0.0:
        return
    angle = math.sqrt(square)
    if angle > 1e-4:
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    else:
        s, c = 1.0 - square / 6.0, 0.5 - square / 24.0
    for j in range(3):
        v0, v1, v2 = R[0, j], R[1, j], R[2, j]
        c0, c1, c2 = y * v2 - z * v1, z * v0 - x * v2, x * v1 - y * v0
        R[0, j] = v0 + s * c0 + c * (y * c2 - z * c1)
        R[1, j] = v1 + s * c1 + c * (z * c0 - x * c2)
        R[2, j] = v2 + s * c2 + c * (x * c1 - y * c0)


@kernel
def _rows(R: Any, u: Any, v: Any, c: Any, rows: Any, error: Any) -> float:
    """Fill error_i = c_i - u_i·Rv_i and its gradient's rows Rv_i × u_i; return the largest error."""
    worst = 0.0
    for i in range(3):
        w0 = R[0, 0] * v[i, 0] + R[0, 1] * v[i, 1] + R[0, 2] * v[i, 2]
        w1 = R[1, 0] * v[i, 0] + R[1, 1] * v[i, 1] + R[1, 2] * v[i, 2]
        w2 = R[2, 0] * v[i, 0] + R[2, 1] * v[i, 1] + R[2, 2] * v[i, 2]
        error[i] = c[i] - (u[i, 0] * w0 + u[i, 1] * w1 + u[i, 2] * w2)
        worst = max(worst, abs(error[i]))
        rows[i, 0] = w1 * u[i, 2] - w2 * u[i, 1]
        rows[i, 1] = w2 * u[i, 0] - w0 * u[i, 2]
        rows[i, 2] = w0 * u[i, 1] - w1 * u[i, 0]
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
            cx, cy, cz = cross(rows[(i + 1) % 3], rows[(i + 2) % 3])
            x += error[i] * cx
            y += error[i] * cy
            z += error[i] * cz
        return x / determinant, y / determinant, z / determinant
    g00 = g11 = g22 = damping
    g01 = g02 = g12 = h0 = h1 = h2 = 0.0
    for i in range(3):
        x, y, z = rows[i, 0], rows[i, 1], rows[i, 2]
        g00 += x * x
        g11 += y * y
        g22 += z * z
        g01 += x * y
        g02 += x * z
        g12 += y * z
        h0 += x * error[i]
        h1 += y * error[i]
        h2 += z * error[i]
    c00, c01, c02 = g11 * g22 - g12 * g12, g02 * g12 - g01 * g22, g01 * g12 - g02 * g11
    c11, c12, c22 = g00 * g22 - g02 * g02, g01 * g02 - g00 * g12, g00 * g11 - g01 * g01
    scale = 1.0 / (g00 * c00 + g01 * c01 + g02 * c02)
    return (
        (c00 * h0 + c01 * h1 + c02 * h2) * scale,
        (c01 * h0 + c11 * h1 + c12 * h2) * scale,
        (c02 * h0 + c12 * h1 + c22 * h2) * scale,
    )


@kernel
def polish(R: Any, u: Any, v: Any, c: Any, rows: Any, error: Any, trial: Any) -> float:
    """Solve from a close start, in place; return the largest error reached."""
    best = _rows(R, u, v, c, rows, error)
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
            turn(trial, x, y, z)
            worst = _rows(trial, u, v, c, rows, error)
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
            _rows(R, u, v, c, rows, error)
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
    return _rows(R, u, v, c, rows, error)
