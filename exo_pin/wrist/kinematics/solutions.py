"""Solutions of n equations u_i · R v_i = c_i, and the rows of modes that they are written to, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.vectors import cross
from .assembly import CONTINUUM, assemble
from .rotation_polish import margin_of, turn

__all__ = ["quaternion", "rotation", "solve", "write_modes"]


@kernel
def quaternion(R: Any, q: Any) -> None:
    """Write the unit quaternion (x, y, z, w) of a rotation matrix, from its largest component (Shepperd)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    best, k = trace, 3
    for j in range(3):
        if R[j, j] > best:
            best, k = R[j, j], j
    if k == 3:
        q[3] = 1.0 + trace
        q[0], q[1], q[2] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    else:
        j, m = (k + 1) % 3, (k + 2) % 3
        q[k] = 1.0 + 2.0 * R[k, k] - trace
        q[j], q[m] = R[j, k] + R[k, j], R[m, k] + R[k, m]
        q[3] = R[m, j] - R[j, m]
    size = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for j in range(4):
        q[j] *= size


@kernel
def write_modes(
    R: Any, margins: Any, residuals: Any, found: int, reference: Any, q: Any, residual: Any, margin: Any, start: int
) -> int:
    """Insert ``found`` modes after the first ``start`` of a row, ordered by angle from the reference."""
    fresh = np.empty(4)
    count = start
    for k in range(found):
        if math.isnan(residuals[k]):
            continue
        quaternion(R[k], fresh)
        near = 0.0
        for j in range(4):
            near += fresh[j] * reference[j]
        place = count
        while place > 0:
            other = 0.0
            for j in range(4):
                other += q[place - 1, j] * reference[j]
            if abs(other) >= abs(near):
                break
            place -= 1
        for m in range(count, place, -1):
            q[m] = q[m - 1]
            residual[m] = residual[m - 1]
            margin[m] = margin[m - 1]
        q[place] = fresh
        residual[place] = residuals[k]
        margin[place] = margins[k]
        count += 1
    return count


@kernel
def _least_squares(R: Any, u: Any, v: Any, c: Any) -> None:
    """Turn R, a solution of some three of u_i·Rv_i = c_i, to the least sum of squares over all n (Gauss and Newton)."""
    n = u.shape[0]
    row = np.empty(3)
    for _ in range(50):
        G, h = np.zeros((3, 3)), np.zeros(3)
        for i in range(n):
            w0 = R[0, 0] * v[i, 0] + R[0, 1] * v[i, 1] + R[0, 2] * v[i, 2]
            w1 = R[1, 0] * v[i, 0] + R[1, 1] * v[i, 1] + R[1, 2] * v[i, 2]
            w2 = R[2, 0] * v[i, 0] + R[2, 1] * v[i, 1] + R[2, 2] * v[i, 2]
            error = c[i] - (u[i, 0] * w0 + u[i, 1] * w1 + u[i, 2] * w2)
            row[0] = w1 * u[i, 2] - w2 * u[i, 1]
            row[1] = w2 * u[i, 0] - w0 * u[i, 2]
            row[2] = w0 * u[i, 1] - w1 * u[i, 0]
            for j in range(3):
                h[j] += row[j] * error
                for k in range(3):
                    G[j, k] += row[j] * row[k]
        for j in range(3):
            G[j, j] += 1e-15
        step = np.linalg.solve(G, h)
        size = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        if size > 0.3:
            step *= 0.3 / size
        turn(R, step[0], step[1], step[2])
        if size < 1e-15:
            break


@kernel
def solve(u: Any, v: Any, c: Any, triples: Any, R: Any, margins: Any) -> int:
    """Solutions of n equations: of three exactly, of more from the first triple that has isolated solutions."""
    n = u.shape[0]
    if n == 3:
        return assemble(u, v, c, R, margins)
    rows = np.empty((3, 3))
    u3, v3, c3 = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for t in range(triples.shape[0]):
        for e in range(3):
            i = triples[t, e]
            u3[e], v3[e], c3[e] = u[i], v[i], c[i]
        found = assemble(u3, v3, c3, R, margins)
        if found == CONTINUUM:
            continue
        selected = 0
        for k in range(found):
            _least_squares(R[k], u, v, c)
            fresh = True
            for m in range(selected):
                fresh = fresh and np.abs(R[m] - R[k]).max() > 1e-6
            if fresh:
                R[selected] = R[k]
                # The best margin of all triples counts: the other limbs hold what one triple does not.
                margins[selected] = 0.0
                for s in range(triples.shape[0]):
                    for e in range(3):
                        i = triples[s, e]
                        w = R[selected] @ v[i]
                        x, y, z = cross(w, u[i])
                        rows[e, 0], rows[e, 1], rows[e, 2] = x, y, z
                    margins[selected] = max(margins[selected], abs(margin_of(rows)))
                selected += 1
        return selected
    return CONTINUUM


@kernel
def rotation(q: Any, R: Any) -> None:
    """Rotation matrix of a unit quaternion (x, y, z, w)."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
