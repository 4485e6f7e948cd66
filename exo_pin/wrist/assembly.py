"""All orientations R with u_i · R v_i = c_i for three pairs of unit vectors, one set at a time, compiled.

Every forward kinematics of the wrist comes down to this: from limb lengths u_i is the direction of A_i, v_i of B_i and
c_i the cosine of the angle between them; from θ_yA the vector u_i is the normal of the limb's plane and c_i is zero.

In frames whose z axes are u_1 and v_1 the first equation says R = Rz(φ) Ry(γ) Rz(ψ) with cos γ = c_1. The other two
are then A_i cos ψ + B_i sin ψ + C_i = 0 with A_i, B_i, C_i linear in cos φ and sin φ, and have a common ψ where

    D(φ) = (B_2 C_3 - B_3 C_2)² + (C_2 A_3 - C_3 A_2)² - (A_2 B_3 - A_3 B_2)² = 0,

of degree 4 in cos φ, sin φ: at most eight solutions. D is solved as a real polynomial of degree 8 in tan φ/2 in two
charts, |φ| <= 90° and |φ - 180°| <= 90°, so that the parameter never leaves [-1, 1] and no root runs off to infinity.
Every root is then polished by Newton's method on the rotation group, on the three equations themselves.

Two modes meet where D has a double root. Rounding then splits it into two close roots or lifts it off zero, so the
extrema of D near zero are tried as well, and what Newton brings to the same orientation is one solution. A double root
of D may also be two different ψ at one φ (symmetric poses), so both are tried there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from .formulas import cross, triple
from .polynomial import MAX_DEGREE, roots_and_touches

__all__ = ["CONTINUUM", "MAX_MODES", "MEETING_MARGIN", "assemble", "margin_of", "turn"]

#: Largest number of solutions.
MAX_MODES = 8
#: Returned instead of a number of solutions where a whole curve of orientations solves the equations.
CONTINUUM = -1
#: Two modes closer than this, rad, cannot be told apart: rounding alone moves modes that meet by √eps = 1.5e-8.
_SAME = 1e-6
#: A mode whose smallest singular value is below this is about to meet another, or does.
MEETING_MARGIN = 1e-6
#: Residual of a solution in the cosines. Rounding of c leaves a few eps; a complex pair of roots with an imaginary
#: part below √1e-13, 3e-7 rad, is taken for modes that meet.
_SOLVED = 1e-13
#: Extrema of D this close to zero, against the size of its terms, are tried.
_TOUCH = 1e-8
#: D as small as this against its terms vanishes for every φ.
_VANISHES = 1e-13
#: Where |A_2 B_3 - A_3 B_2| is below this, ψ is not taken from the two equations together.
_PARALLEL = 1e-3

_compile = njit(cache=True, error_model="numpy")


@_compile
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


@_compile
def _frame(axis: Any, out: Any) -> None:
    """Write a rotation whose third column is ``axis``."""
    # The coordinate axis farthest from it is the safest start.
    k = 0
    for j in range(1, 3):
        if abs(axis[j]) < abs(axis[k]):
            k = j
    e = np.zeros(3)
    e[k] = 1.0
    x, y, z = cross(e, axis)
    size = 1.0 / math.sqrt(x * x + y * y + z * z)
    out[0, 0], out[1, 0], out[2, 0] = x * size, y * size, z * size
    out[0, 2], out[1, 2], out[2, 2] = axis[0], axis[1], axis[2]
    x, y, z = cross(axis, out[:, 0])
    out[0, 1], out[1, 1], out[2, 1] = x, y, z


@_compile
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


@_compile
def margin_of(rows: Any) -> float:
    """Smallest singular value of three rows within a factor √3, signed: det / √(second Gram invariant)."""
    second = 0.0
    for i in range(3):
        x, y, z = cross(rows[i], rows[(i + 1) % 3])
        second += x * x + y * y + z * z
    return triple(rows[0], rows[1], rows[2]) / math.sqrt(second) if second > 0.0 else 0.0


@_compile
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


@_compile
def _polish(R: Any, u: Any, v: Any, c: Any, rows: Any, error: Any, trial: Any) -> float:
    """Solve from a close start, in place; return the largest error reached."""
    best = _rows(R, u, v, c, rows, error)
    damping = 0.0
    for _ in range(60):
        if best <= 2e-16:
            break
        x, y, z = _step(rows, error, damping)
        size = math.sqrt(x * x + y * y + z * z)
        # A step this long does not belong to the start's own solution (NaN fails the test, too).
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


@_compile
def _add(R: Any, margin: float, rotations: Any, margins: Any, count: int) -> int:
    """Add a solution unless it is there already."""
    for k in range(count):
        square = 0.0
        for i in range(3):
            for j in range(3):
                square += (rotations[k, i, j] - R[i, j]) ** 2
        # |R - R'|² = 8 sin²(angle/2)
        if square <= 2.0 * _SAME * _SAME:
            return count
    if count < rotations.shape[0]:
        rotations[count] = R
        margins[count] = margin
        return count + 1
    return count


@_compile
def _product(p: Any, q: Any, factor: float, out: Any) -> None:
    """Add factor × the product of two quadratics to ``out``."""
    for i in range(3):
        for j in range(3):
            out[i + j] += factor * p[i] * q[j]


@_compile
def _square(p: Any, factor: float, out: Any) -> float:
    """Add factor × the square of a quartic to ``out``; return the largest coefficient of the square."""
    largest = 0.0
    for i in range(5):
        for j in range(5):
            out[i + j] += factor * p[i] * p[j]
        largest = max(largest, abs(p[i]))
    return largest * largest


@_compile
def assemble(u: Any, v: Any, c: Any, rotations: Any, margins: Any) -> int:
    """Write all solutions R of u_i · R v_i = c_i, i = 1..3.

    Parameters
    ----------
    u, v : ndarray
        Shape (3, 3), unit vectors as rows, in the base frame and in the arm frame.
    c : ndarray
        Shape (3,).
    rotations : ndarray
        Shape (8, 3, 3), written.
    margins : ndarray
        Shape (8,), written: smallest singular value (within √3) of the rows R v_i × u_i in each solution, with the sign
        of their determinant, which two modes that meet do not share; below :data:`MEETING_MARGIN` two modes meet.

    Returns
    -------
    int
        How many there are; 0 also where some |c_i| > 1; :data:`CONTINUUM` where a curve of orientations solves them.
    """
    first, widest = 0, -1.0
    for i in range(3):
        if not abs(c[i]) <= 1.0 + 1e-14:
            return 0
        if 1.0 - abs(c[i]) > widest:
            widest, first = 1.0 - abs(c[i]), i
    cos_g = c[first]
    sin_g = math.sqrt(max(0.0, (1.0 - cos_g) * (1.0 + cos_g)))
    E, F = np.empty((3, 3)), np.empty((3, 3))
    _frame(u[first], E)
    _frame(v[first], F)
    # q[i, k] is A, B, C (k = 0, 1, 2) of equation i as a polynomial of degree 2 in tan φ/2, times 1 + tan².
    q = np.empty((2, 3, 3))
    terms = np.empty((2, 3, 3))
    for e in range(2):
        i = (first + 1 + e) % 3
        ux = E[0, 0] * u[i, 0] + E[1, 0] * u[i, 1] + E[2, 0] * u[i, 2]
        uy = E[0, 1] * u[i, 0] + E[1, 1] * u[i, 1] + E[2, 1] * u[i, 2]
        uz = E[0, 2] * u[i, 0] + E[1, 2] * u[i, 1] + E[2, 2] * u[i, 2]
        vx = F[0, 0] * v[i, 0] + F[1, 0] * v[i, 1] + F[2, 0] * v[i, 2]
        vy = F[0, 1] * v[i, 0] + F[1, 1] * v[i, 1] + F[2, 1] * v[i, 2]
        vz = F[0, 2] * v[i, 0] + F[1, 2] * v[i, 1] + F[2, 2] * v[i, 2]
        # p = Rz(-φ) u: px = ux cos + uy sin, py = uy cos - ux sin, pz = uz. Terms: constant, cos φ, sin φ.
        terms[e, 0, 0] = -vx * uz * sin_g
        terms[e, 0, 1] = vx * ux * cos_g + vy * uy
        terms[e, 0, 2] = vx * uy * cos_g - vy * ux
        terms[e, 1, 0] = vy * uz * sin_g
        terms[e, 1, 1] = -vy * ux * cos_g + vx * uy
        terms[e, 1, 2] = -vy * uy * cos_g - vx * ux
        terms[e, 2, 0] = vz * uz * cos_g - c[i]
        terms[e, 2, 1] = vz * ux * sin_g
        terms[e, 2, 2] = vz * uy * sin_g
        for k in range(3):
            q[e, k, 0] = terms[e, k, 0] + terms[e, k, 1]
            q[e, k, 1] = 2.0 * terms[e, k, 2]
            q[e, k, 2] = terms[e, k, 0] - terms[e, k, 1]
    quartics = np.zeros((3, 5))
    _product(q[0, 1], q[1, 2], 1.0, quartics[0])
    _product(q[1, 1], q[0, 2], -1.0, quartics[0])
    _product(q[0, 2], q[1, 0], 1.0, quartics[1])
    _product(q[1, 2], q[0, 0], -1.0, quartics[1])
    _product(q[0, 0], q[1, 1], 1.0, quartics[2])
    _product(q[1, 0], q[0, 1], -1.0, quartics[2])
    octic, mirrored = np.zeros(MAX_DEGREE + 1), np.empty(MAX_DEGREE + 1)
    size = _square(quartics[0], 1.0, octic)
    size = max(size, _square(quartics[1], 1.0, octic))
    size = max(size, _square(quartics[2], -1.0, octic))
    largest = 0.0
    for k in range(MAX_DEGREE + 1):
        largest = max(largest, abs(octic[k]))
    # The quartics themselves, of order one, vanish where two of the three equations are one and the same.
    if largest <= _VANISHES * size or size <= _VANISHES**2:
        return CONTINUUM
    for k in range(MAX_DEGREE + 1):
        mirrored[k] = octic[MAX_DEGREE - k] if k % 2 == 0 else -octic[MAX_DEGREE - k]
    found = np.empty(2 * MAX_DEGREE)
    psi = np.empty(5)
    R, turned, rows, error = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    M = np.empty((3, 3))
    count = 0
    for chart in range(2):
        number = roots_and_touches(octic if chart == 0 else mirrored, MAX_DEGREE, _TOUCH * size, found)
        for n in range(number):
            t = found[n]
            scale = 1.0 / (1.0 + t * t)
            cos_f, sin_f = (1.0 - t * t) * scale, 2.0 * t * scale
            if chart == 1:
                cos_f, sin_f = -cos_f, -sin_f
            A2 = terms[0, 0, 0] + terms[0, 0, 1] * cos_f + terms[0, 0, 2] * sin_f
            B2 = terms[0, 1, 0] + terms[0, 1, 1] * cos_f + terms[0, 1, 2] * sin_f
            C2 = terms[0, 2, 0] + terms[0, 2, 1] * cos_f + terms[0, 2, 2] * sin_f
            A3 = terms[1, 0, 0] + terms[1, 0, 1] * cos_f + terms[1, 0, 2] * sin_f
            B3 = terms[1, 1, 0] + terms[1, 1, 1] * cos_f + terms[1, 1, 2] * sin_f
            C3 = terms[1, 2, 0] + terms[1, 2, 1] * cos_f + terms[1, 2, 2] * sin_f
            delta = A2 * B3 - A3 * B2
            size2, size3 = math.hypot(A2, B2), math.hypot(A3, B3)
            tries = 0
            psi[tries] = math.atan2((C2 * A3 - C3 * A2) * delta, (B2 * C3 - B3 * C2) * delta)
            tries += 1
            if abs(delta) < _PARALLEL * (size2 * size3 + 1e-30):
                for e in range(2):
                    A, B, C, reach = (A2, B2, C2, size2) if e == 0 else (A3, B3, C3, size3)
                    if reach > 1e-12:
                        middle = math.atan2(B, A)
                        half = math.acos(min(1.0, max(-1.0, -C / reach)))
                        psi[tries], psi[tries + 1] = middle + half, middle - half
                        tries += 2
            for m in range(tries):
                cos_p, sin_p = math.cos(psi[m]), math.sin(psi[m])
                # Rz(φ) Ry(γ) Rz(ψ)
                M[0, 0] = cos_f * cos_g * cos_p - sin_f * sin_p
                M[0, 1] = -cos_f * cos_g * sin_p - sin_f * cos_p
                M[0, 2] = cos_f * sin_g
                M[1, 0] = sin_f * cos_g * cos_p + cos_f * sin_p
                M[1, 1] = -sin_f * cos_g * sin_p + cos_f * cos_p
                M[1, 2] = sin_f * sin_g
                M[2, 0], M[2, 1], M[2, 2] = -sin_g * cos_p, sin_g * sin_p, cos_g
                for i in range(3):
                    for j in range(3):
                        total = 0.0
                        for k in range(3):
                            total += E[i, k] * (M[k, 0] * F[j, 0] + M[k, 1] * F[j, 1] + M[k, 2] * F[j, 2])
                        R[i, j] = total
                if _polish(R, u, v, c, rows, error, turned) <= _SOLVED:
                    count = _add(R, margin_of(rows), rotations, margins, count)
    return count
