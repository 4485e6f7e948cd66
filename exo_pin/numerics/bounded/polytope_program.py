"""The least force within limits on sums of at most three unknowns, compiled: tensions that balance themselves.

    minimise |c + G z|² + ε |z|²   over   low <= f + N z <= high,     z of one to three numbers

That is a strictly convex program in at most three variables, and it is solved exactly by adding one inequality after
the other (R. Seidel's method, Discrete & Computational Geometry 6 (1991) 423, for a quadratic objective): an inequality
that the answer so far meets changes nothing; one that it violates is active in the new answer, which is then computed
on its plane, with one variable less. The small ε, :data:`REGULAR`, makes z unique where the force does not depend on
it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ..small_linear import solve_cholesky

#: ε: weight of the variables beside the force, both squared. It raises |c + G z| by at most ε |z|² / (2 |c + G z|).
REGULAR = 1e-9
#: Most variables that the method takes.
FEW = 3
#: Violation of a scaled inequality that counts as rounding.
_SLACK = 1e-11
#: Length of a row below which an inequality has no direction in what is left of the variables.
_NO_ROW = 1e-11


@kernel
def _on_line(h: float, g: float, a: Any, b: Any, count: int, slack: float, out: Any) -> bool:
    """Minimise h t²/2 + g t over a_k t >= b_k; write t to ``out[0]`` and return whether there is one."""
    low, high = -np.inf, np.inf
    for k in range(count):
        if abs(a[k]) < _NO_ROW:
            if b[k] > slack:
                return False
            continue
        edge = b[k] / a[k]
        if a[k] > 0.0:
            low = max(low, edge)
        else:
            high = min(high, edge)
    if low > high:
        if low - high > slack:
            return False
        out[0] = 0.5 * (low + high)
        return True
    out[0] = min(max(-g / h, low), high)
    return True


@kernel
def _on_plane(H: Any, g: Any, a: Any, b: Any, count: int, slack: float, out: Any, a1: Any, b1: Any, t1: Any) -> bool:
    """Minimise tᵀ H t/2 + gᵀ t over a_k · t >= b_k for two variables; ``H`` is (H_11, H_12, H_22)."""
    determinant = H[0] * H[2] - H[1] * H[1]
    x, y = (H[1] * g[1] - H[2] * g[0]) / determinant, (H[1] * g[0] - H[0] * g[1]) / determinant
    for k in range(count):
        size = math.sqrt(a[k, 0] ** 2 + a[k, 1] ** 2)
        if size < _NO_ROW:
            if b[k] > slack:
                return False
            continue
        u, v, w = a[k, 0] / size, a[k, 1] / size, b[k] / size
        if u * x + v * y >= w - slack:
            continue
        px, py = u * w, v * w
        for j in range(k):
            a1[j] = -v * a[j, 0] + u * a[j, 1]
            b1[j] = b[j] - a[j, 0] * px - a[j, 1] * py
        slope_x, slope_y = g[0] + H[0] * px + H[1] * py, g[1] + H[1] * px + H[2] * py
        bend = H[0] * v * v - 2.0 * H[1] * u * v + H[2] * u * u
        if not _on_line(bend, u * slope_y - v * slope_x, a1, b1, k, slack, t1):
            return False
        x, y = px - v * t1[0], py + u * t1[0]
    out[0], out[1] = x, y
    return True


@kernel
def _in_space(
    H: Any, g: Any, a: Any, b: Any, count: int, slack: float, out: Any, E: Any, a2: Any, b2: Any, t2: Any, a1: Any,
    b1: Any, t1: Any,
) -> bool:  # fmt: skip
    """Minimise tᵀ H t/2 + gᵀ t over a_k · t >= b_k for three variables."""
    for r in range(3):
        out[r] = -g[r]
    solve_cholesky(H.copy(), out)
    H2, g2 = np.empty_like(out), np.empty_like(out)
    for k in range(count):
        size = math.sqrt(a[k, 0] ** 2 + a[k, 1] ** 2 + a[k, 2] ** 2)
        if size < _NO_ROW:
            if b[k] > slack:
                return False
            continue
        u, v, w, edge = a[k, 0] / size, a[k, 1] / size, a[k, 2] / size, b[k] / size
        if u * out[0] + v * out[1] + w * out[2] >= edge - slack:
            continue
        # Two directions E across the normal (u, v, w), without a branch (Duff and others, 2017).
        sign = math.copysign(1.0, w)
        p, q = -1.0 / (sign + w), u * v * (-1.0 / (sign + w))
        E[0, 0], E[0, 1], E[0, 2] = 1.0 + sign * u * u * p, sign * q, -sign * u
        E[1, 0], E[1, 1], E[1, 2] = q, sign + v * v * p, -v
        px, py, pz = u * edge, v * edge, w * edge
        for j in range(k):
            for e in range(2):
                a2[j, e] = E[e, 0] * a[j, 0] + E[e, 1] * a[j, 1] + E[e, 2] * a[j, 2]
            b2[j] = b[j] - a[j, 0] * px - a[j, 1] * py - a[j, 2] * pz
        index = 0
        for e in range(2):
            g2[e] = 0.0
            for r in range(3):
                g2[e] += E[e, r] * (g[r] + H[r, 0] * px + H[r, 1] * py + H[r, 2] * pz)
            for f in range(e, 2):
                H2[index] = 0.0
                for r in range(3):
                    H2[index] += E[e, r] * (H[r, 0] * E[f, 0] + H[r, 1] * E[f, 1] + H[r, 2] * E[f, 2])
                index += 1
        if not _on_plane(H2, g2, a2, b2, k, slack, t2, a1, b1, t1):
            return False
        out[0] = px + E[0, 0] * t2[0] + E[1, 0] * t2[1]
        out[1] = py + E[0, 1] * t2[0] + E[1, 1] * t2[1]
        out[2] = pz + E[0, 2] * t2[0] + E[1, 2] * t2[1]
    return True


@kernel
def sum_rows(f: Any, N: Any, low: Any, high: Any, a: Any, b: Any) -> int:
    """Write low <= f + N z <= high as rows a_k · z >= b_k, infinite bounds left out; return their number."""
    count, m = 0, N.shape[1]
    for i in range(f.shape[0]):
        for side in range(2):
            bound = low[i] if side == 0 else high[i]
            if not abs(bound) < np.inf:
                continue
            sign = 1.0 if side == 0 else -1.0
            for j in range(m):
                a[count, j] = sign * N[i, j]
            b[count] = sign * (bound - f[i])
            count += 1
    return count


@kernel
def least_sum_force(c: Any, G: Any, f: Any, N: Any, low: Any, high: Any, z: Any) -> bool:
    """Fill z with the answer of the module's program; return whether the inequalities have one.

    Parameters
    ----------
    c, G : ndarray
        Shapes (3,), N, and (3, m), m = 1, 2 or 3.
    f, N : ndarray
        Shapes (n,), N, and (n, m), columns orthonormal.
    low, high : ndarray
        Shape (n,), N.
    z : ndarray
        Shape (m,), written.
    """
    n, m = N.shape
    most = 2 * n
    a, b = np.empty((most, m)), np.empty(most)
    count = sum_rows(f, N, low, high, a, b)
    scale = 1.0
    for i in range(n):
        scale = max(scale, abs(f[i]))
    slack = _SLACK * scale
    H, g = np.empty((m, m)), np.empty(m)
    for i in range(m):
        g[i] = G[0, i] * c[0] + G[1, i] * c[1] + G[2, i] * c[2]
        for j in range(m):
            H[i, j] = G[0, i] * G[0, j] + G[1, i] * G[1, j] + G[2, i] * G[2, j]
        H[i, i] += REGULAR
    a1, b1, t1 = np.empty_like(b), np.empty_like(b), np.empty_like(z)
    if m == 1:
        return _on_line(H[0, 0], g[0], a[:, 0], b, count, slack, z)
    if m == 2:
        upper = np.empty(3)
        upper[0], upper[1], upper[2] = H[0, 0], H[0, 1], H[1, 1]
        return _on_plane(upper, g, a, b, count, slack, z, a1, b1, t1)
    a2, b2, t2, E = np.empty_like(a), np.empty_like(b), np.empty_like(z), np.empty_like(a)
    return _in_space(H, g, a, b, count, slack, z, E, a2, b2, t2, a1, b1, t1)
