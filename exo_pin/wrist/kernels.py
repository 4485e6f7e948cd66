"""The formulas of the wrist, one pose at a time, compiled. Everything else calls these.

Symbols: a = A_i and b = R B_i, both from O in the base frame; s = (b - a)/l the limb's direction from torso to arm;
X = -(a × b)/|a × b| the normal of the limb's plane O A_i B_i, (D-11); h = |b × s| the distance from O to the limb's
line. They are tied by b × s = -h X, so that the actuation and the constraint singularity of this wrist are one
locus, det[X_1 X_2 X_3] = 0, next to the folded case h_i = 0.

Signs: f > 0 is tension, the limb pulls the arm with -f s; the side force -g X passes through O.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

__all__ = [
    "FOLDED",
    "NEAR_SINGULAR",
    "OK",
    "SINGULAR",
    "arm_load",
    "classify_stack",
    "force_stack",
    "limb_stack",
    "limb_vectors",
]

OK, NEAR_SINGULAR, SINGULAR, FOLDED = 0, 1, 2, 3

#: Sine of the angle A_i O B_i below which a limb counts as folded: its plane, and with it X_i, has no direction.
FOLDED_SINE = 1e-9
#: Margin below which no force is given: rounding would leave fewer than about seven digits.
SINGULAR_MARGIN = 1e-9
#: Margin below which an answer is marked: limb forces exceed moment / joint radius by more than a factor 1000.
NEAR_MARGIN = 1e-3

_compile = njit(cache=True, error_model="numpy")


@_compile
def _cross(u: Any, v: Any) -> tuple[float, float, float]:
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@_compile
def _triple(u: Any, v: Any, w: Any) -> float:
    x, y, z = _cross(v, w)
    return u[0] * x + u[1] * y + u[2] * z


@_compile
def limb_vectors(R: Any, base: Any, platform: Any, b: Any, s: Any, X: Any, length: Any, reach: Any) -> int:
    """Fill b, s, X, l and h of every limb, (4-1) and (D-11), (D-12); return the number of folded limbs.

    A folded limb gets X = 0 and h = 0, one of no length also s = 0.
    """
    folded = 0
    for i in range(base.shape[0]):
        total, reach_a, reach_b = 0.0, 0.0, 0.0
        for j in range(3):
            b[i, j] = R[j, 0] * platform[i, 0] + R[j, 1] * platform[i, 1] + R[j, 2] * platform[i, 2]
            s[i, j] = b[i, j] - base[i, j]
            total += s[i, j] * s[i, j]
            reach_a += base[i, j] * base[i, j]
            reach_b += b[i, j] * b[i, j]
        x, y, z = _cross(base[i], b[i])
        area = math.sqrt(x * x + y * y + z * z)
        length[i] = math.sqrt(total)
        inverse = 1.0 / length[i] if length[i] > 0.0 else 0.0
        for j in range(3):
            s[i, j] *= inverse
        if area <= FOLDED_SINE * math.sqrt(reach_a * reach_b):
            folded += 1
            reach[i] = 0.0
            X[i, 0] = X[i, 1] = X[i, 2] = 0.0
        else:
            reach[i] = area * inverse
            X[i, 0], X[i, 1], X[i, 2] = -x / area, -y / area, -z / area
    return folded


@_compile
def _margin(X: Any, reach: Any, radius: float) -> float:
    """Smallest singular value of the matrix of rows h_i X_i / radius, within a factor √3, dimensionless.

    det / sqrt(second invariant of the Gram matrix): it goes to the singular value itself where that goes to zero,
    and does not square it, as the eigenvalues of the Gram matrix would.
    """
    n = X.shape[0]
    g00 = g01 = g02 = g11 = g12 = g22 = 0.0
    for i in range(n):
        w = (reach[i] / radius) ** 2
        g00 += w * X[i, 0] * X[i, 0]
        g01 += w * X[i, 0] * X[i, 1]
        g02 += w * X[i, 0] * X[i, 2]
        g11 += w * X[i, 1] * X[i, 1]
        g12 += w * X[i, 1] * X[i, 2]
        g22 += w * X[i, 2] * X[i, 2]
    second = g00 * g11 - g01 * g01 + g00 * g22 - g02 * g02 + g11 * g22 - g12 * g12
    if not second > 0.0:
        return 0.0
    volume = 0.0  # of the Gram matrix, as a sum of squares over all triples of limbs (Cauchy and Binet)
    for i in range(n):
        for j in range(i + 1, n):
            for k in range(j + 1, n):
                part = _triple(X[i], X[j], X[k]) * reach[i] * reach[j] * reach[k] / radius**3
                volume += part * part
    return math.sqrt(volume / second)


@_compile
def _largest_radius(platform: Any) -> float:
    radius = 0.0
    for i in range(platform.shape[0]):
        radius = max(radius, math.sqrt(platform[i, 0] ** 2 + platform[i, 1] ** 2 + platform[i, 2] ** 2))
    return radius


@_compile
def _status(folded: int, margin: float, n: int, needs_planes: bool) -> int:
    if folded > 0 and (needs_planes or n == 3):
        return FOLDED
    if margin < SINGULAR_MARGIN:
        return SINGULAR
    return NEAR_SINGULAR if margin < NEAR_MARGIN else OK


@_compile
def classify_stack(
    R: Any, base: Any, platform: Any, needs_planes: bool, status: Any, margin: Any, determinant: Any
) -> None:
    """Fill status code, margin and det[X_1 X_2 X_3] (NaN for n > 3) of a stack of poses."""
    n = base.shape[0]
    b, s, X = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    length, reach = np.empty(n), np.empty(n)
    radius = _largest_radius(platform)
    for k in range(R.shape[0]):
        folded = limb_vectors(R[k], base, platform, b, s, X, length, reach)
        margin[k] = _margin(X, reach, radius)
        status[k] = _status(folded, margin[k], n, needs_planes)
        determinant[k] = _triple(X[0], X[1], X[2]) if n == 3 else np.nan


@_compile
def _tensions_of_three(X: Any, reach: Any, M: Any, f: Any) -> None:
    """Solve sum f_i (b_i × s_i) = M for three limbs, (D-22)."""
    determinant = _triple(X[0], X[1], X[2])
    for i in range(3):
        f[i] = -_triple(M, X[(i + 1) % 3], X[(i + 2) % 3]) / (reach[i] * determinant)


@_compile
def _tensions_of_many(X: Any, reach: Any, M: Any, f: Any, Q: Any) -> None:
    """Solve sum f_i (b_i × s_i) = M for more than three limbs, with the least sum of squares of f.

    With J the matrix of rows b_i × s_i = Q U, the answer is f = Q (Uᵀ)⁻¹ M. Gram-Schmidt is run twice, which makes
    Q orthonormal to rounding.
    """
    n = X.shape[0]
    U = np.zeros((3, 3))
    for i in range(n):
        for j in range(3):
            Q[i, j] = -reach[i] * X[i, j]
    for j in range(3):
        for _ in range(2):
            for k in range(j):
                dot = 0.0
                for i in range(n):
                    dot += Q[i, k] * Q[i, j]
                U[k, j] += dot
                for i in range(n):
                    Q[i, j] -= dot * Q[i, k]
        norm = 0.0
        for i in range(n):
            norm += Q[i, j] * Q[i, j]
        U[j, j] = math.sqrt(norm)
        for i in range(n):
            Q[i, j] /= U[j, j]
    y0 = M[0] / U[0, 0]
    y1 = (M[1] - U[0, 1] * y0) / U[1, 1]
    y2 = (M[2] - U[0, 2] * y0 - U[1, 2] * y1) / U[2, 2]
    for i in range(n):
        f[i] = Q[i, 0] * y0 + Q[i, 1] * y1 + Q[i, 2] * y2


@_compile
def limb_stack(R: Any, base: Any, platform: Any, b: Any, s: Any, X: Any, length: Any, reach: Any) -> None:
    """:func:`limb_vectors` over a stack of poses, the first axis of every array but ``base`` and ``platform``."""
    for k in range(R.shape[0]):
        limb_vectors(R[k], base, platform, b[k], s[k], X[k], length[k], reach[k])


@_compile
def arm_load(
    R: Any,
    mass: float,
    centre: Any,
    inertia: Any,
    gravity: Any,
    velocity: Any,
    acceleration: Any,
    force: Any,
    moment: Any,
    F: Any,
    M: Any,
) -> None:
    """Add weight and inertia to the load on the arm: what limbs and shoulder together must carry.

    F = force + m (g - a_C) and M = moment + C × m g - (I η + ω × I ω), with a_C = η × C + ω × (ω × C), (D-1),
    (D-2), (D-8) with the sign of its first term put right; I and ``moment`` are about O, all in the base frame.

    Parameters
    ----------
    R, velocity, acceleration, force, moment, F, M : ndarray
        Stacks, shapes (N, 3, 3) and (N, 3); F and M are written.
    mass, centre, inertia, gravity : float or ndarray
        Of the arm: kg, m in {O_B}, kg m² about O in {O_B}; m/s² in the base frame.
    """
    C, Iw, Ia, local = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(R.shape[0]):
        w, e = velocity[k], acceleration[k]
        for j in range(3):
            C[j] = R[k, j, 0] * centre[0] + R[k, j, 1] * centre[1] + R[k, j, 2] * centre[2]
        for vector, product in ((w, Iw), (e, Ia)):
            for j in range(3):
                turned = R[k, 0, j] * vector[0] + R[k, 1, j] * vector[1] + R[k, 2, j] * vector[2]
                local[j] = turned
            t0 = inertia[0, 0] * local[0] + inertia[0, 1] * local[1] + inertia[0, 2] * local[2]
            t1 = inertia[1, 0] * local[0] + inertia[1, 1] * local[1] + inertia[1, 2] * local[2]
            t2 = inertia[2, 0] * local[0] + inertia[2, 1] * local[1] + inertia[2, 2] * local[2]
            for j in range(3):
                product[j] = R[k, j, 0] * t0 + R[k, j, 1] * t1 + R[k, j, 2] * t2
        e_C, w_C, gyroscopic, weight = _cross(e, C), _cross(w, C), _cross(w, Iw), _cross(C, gravity)
        w_w_C = _cross(w, w_C)
        for j in range(3):
            F[k, j] = force[k, j] + mass * (gravity[j] - e_C[j] - w_w_C[j])
            M[k, j] = moment[k, j] + mass * weight[j] - Ia[j] - gyroscopic[j]


@_compile
def force_stack(
    R: Any,
    base: Any,
    platform: Any,
    F: Any,
    M: Any,
    standalone: bool,
    needs_planes: bool,
    f: Any,
    g: Any,
    shoulder: Any,
    status: Any,
    margin: Any,
) -> None:
    """Limb and shoulder forces over a stack of poses, (D-22), (D-25), (D-29).

    Parameters
    ----------
    R, F, M : ndarray
        Stacks (N, 3, 3), (N, 3), (N, 3): poses, and what limbs and shoulder carry (:func:`arm_load`).
    base, platform : ndarray
        Shape (n, 3).
    standalone : bool
        Whether the limbs carry all of it, F_s = 0 (three UPU limbs); else g = 0.
    needs_planes : bool
        Whether a folded limb spoils the pose (a UPU limb needs its X_i).
    f, g, shoulder, status, margin : ndarray
        Written: (N, n), (N, n), (N, 3), (N,), (N,). Rows without an answer are NaN.
    """
    n = base.shape[0]
    b, s, X, Q = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    length, reach = np.empty(n), np.empty(n)
    radius = _largest_radius(platform)
    for k in range(R.shape[0]):
        folded = limb_vectors(R[k], base, platform, b, s, X, length, reach)
        margin[k] = _margin(X, reach, radius)
        status[k] = _status(folded, margin[k], n, needs_planes)
        if status[k] >= SINGULAR:
            f[k, :], g[k, :], shoulder[k, :] = np.nan, np.nan, np.nan
            continue
        if n == 3:
            _tensions_of_three(X, reach, M[k], f[k])
        else:
            _tensions_of_many(X, reach, M[k], f[k], Q)
        for j in range(3):
            shoulder[k, j] = -F[k, j]
            for i in range(n):
                shoulder[k, j] += f[k, i] * s[i, j]
        g[k, :] = 0.0
        if standalone:
            determinant = _triple(X[0], X[1], X[2])
            for i in range(3):
                g[k, i] = -_triple(shoulder[k], X[(i + 1) % 3], X[(i + 2) % 3]) / determinant
            shoulder[k, :] = 0.0
