"""All orientations R with u_i · R v_i = c_i for three pairs of unit vectors, one set at a time, compiled.

Every forward kinematics of the wrist has this form: from limb lengths u_i is the direction of A_i, v_i of B_i and
c_i the cosine of the angle between them; from θ_yA the vector u_i is the normal of the limb's plane and c_i is zero.

In frames whose z axes are u_1 and v_1 the first equation gives R = Rz(φ) Ry(γ) Rz(ψ) with cos γ = c_1. The other two
are then A_i cos ψ + B_i sin ψ + C_i = 0 with A_i, B_i, C_i linear in cos φ and sin φ, and have a common ψ where

    D(φ) = (B_2 C_3 - B_3 C_2)² + (C_2 A_3 - C_3 A_2)² - (A_2 B_3 - A_3 B_2)² = 0,

of degree 4 in cos φ, sin φ: at most eight solutions. D is solved as a real polynomial of degree 8 in tan φ/2 in two
charts, |φ| <= 90° and |φ - 180°| <= 90°, so that the parameter stays within [-1, 1] and every root is finite.
Every root is then polished by Newton's method on the rotation group, on the three equations themselves.

If v_1 is parallel to v_2 or v_3, that equation has no ψ in it (A_i = B_i = 0), and D = C_i² (A² + B²) is a square, all
of whose roots are double. So the first equation is one whose v is parallel to no other, and not nearly; parallel u
do no harm, because A_i, B_i and C_i are then constant and give ψ alone.

Two modes meet where D has a double root. Rounding then splits it into two close roots or moves it off zero, so the
extrema of D near zero are tried as well; starts that Newton's method leads to the same orientation are one solution. A
double root of D may also be two different ψ at one φ (symmetric poses), so both are tried there.

Newton's method on the rotation group for three equations u_i · R v_i = c_i, compiled.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.polynomial import MAX_DEGREE, roots_and_touches
from ...numerics.small_linear import solve_cholesky
from ...numerics.vectors import cross, dot, matrix, triple, turn, turn_back, vector

#: Largest number of solutions.
MAX_MODES = 8
#: Returned instead of a number of solutions where a whole curve of orientations solves the equations.
CONTINUUM = -1
#: Two modes closer than this, rad, count as one: rounding alone moves modes that meet by √eps = 1.5e-8.
_SAME = 1e-6
#: Smallest singular value below which a mode meets another, or nearly.
MEETING_MARGIN = 1e-6
#: Residual of a solution in the cosines. Rounding of c leaves a few eps; a complex pair of roots with an imaginary
#: part below √1e-13, 3e-7 rad, counts as modes that meet.
_SOLVED = 1e-13
#: Extrema of D this close to zero, against the size of its terms, are tried.
_TOUCH = 1e-8
#: D as small as this against its terms vanishes for every φ.
_VANISHES = 1e-13
#: Where |A_2 B_3 - A_3 B_2| is below this, ψ is not taken from the two equations together.
_PARALLEL = 1e-3


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


@kernel
def frame_along(axis: Any, out: Any) -> None:
    """Write a rotation whose third column is ``axis``."""
    # The coordinate axis farthest from it is the safest start.
    e = np.zeros(3)
    e[np.abs(axis).argmin()] = 1.0
    x, y, z = cross(e, axis)
    size = 1.0 / math.sqrt(x * x + y * y + z * z)
    out[0, 0], out[1, 0], out[2, 0] = x * size, y * size, z * size
    out[0, 1], out[1, 1], out[2, 1] = cross(axis, out[:, 0])
    out[:, 2] = axis


@kernel
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


@kernel
def _product(p: Any, q: Any, factor: float, out: Any) -> None:
    """Add factor × the product of two quadratics to ``out``."""
    for i in range(3):
        for j in range(3):
            out[i + j] += factor * p[i] * q[j]


@kernel
def _square(p: Any, factor: float, out: Any) -> float:
    """Add factor × the square of a quartic to ``out``; return the largest coefficient of the square."""
    largest = 0.0
    for i in range(5):
        for j in range(5):
            out[i + j] += factor * p[i] * p[j]
        largest = max(largest, abs(p[i]))
    return largest * largest


@kernel
def _fill_terms(u: Any, v: Any, c: Any, first: int, cos_g: float, sin_g: float, E: Any, F: Any, terms: Any) -> None:
    """Fill A, B, C of the two equations besides ``first``, shape (2, 3, 3): the parts constant, of cos φ and of sin φ.

    E and F are rotations whose third columns are u and v of ``first``.
    """
    for e in range(2):
        i = (first + 1 + e) % 3
        ux, uy, uz = turn_back(matrix(E), vector(u, i))
        vx, vy, vz = turn_back(matrix(F), vector(v, i))
        # p = Rz(-φ) u: px = ux cos + uy sin, py = uy cos - ux sin, pz = uz.
        terms[e, 0, 0] = -vx * uz * sin_g
        terms[e, 0, 1] = vx * ux * cos_g + vy * uy
        terms[e, 0, 2] = vx * uy * cos_g - vy * ux
        terms[e, 1, 0] = vy * uz * sin_g
        terms[e, 1, 1] = -vy * ux * cos_g + vx * uy
        terms[e, 1, 2] = -vy * uy * cos_g - vx * ux
        terms[e, 2, 0] = vz * uz * cos_g - c[i]
        terms[e, 2, 1] = vz * ux * sin_g
        terms[e, 2, 2] = vz * uy * sin_g


@kernel
def _eliminate(terms: Any, octic: Any, mirrored: Any) -> float:
    """Fill D in tan φ/2 and in tan (φ - 180°)/2; return the size of its terms, or -1 where D vanishes for every φ."""
    # q[e, k] is A, B, C (k = 0, 1, 2) of an equation as a polynomial of degree 2 in tan φ/2, times 1 + tan².
    q = np.empty((2, 3, 3))
    for e in range(2):
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
    octic[:] = 0.0
    size = _square(quartics[0], 1.0, octic)
    size = max(size, _square(quartics[1], 1.0, octic))
    size = max(size, _square(quartics[2], -1.0, octic))
    largest = 0.0
    for k in range(MAX_DEGREE + 1):
        largest = max(largest, abs(octic[k]))
        mirrored[k] = octic[MAX_DEGREE - k] if k % 2 == 0 else -octic[MAX_DEGREE - k]
    # The quartics themselves, of order one, vanish where two of the three equations are one and the same.
    return -1.0 if largest <= _VANISHES * size or size <= _VANISHES**2 else size


@kernel
def _spins(terms: Any, cos_f: float, sin_f: float, psi: Any) -> int:
    """Write the ψ to try at a root φ of D; return their number."""
    A2, B2, C2 = turn(matrix(terms[0]), (1.0, cos_f, sin_f))
    A3, B3, C3 = turn(matrix(terms[1]), (1.0, cos_f, sin_f))
    delta = A2 * B3 - A3 * B2
    size2, size3 = math.hypot(A2, B2), math.hypot(A3, B3)
    psi[0] = math.atan2((C2 * A3 - C3 * A2) * delta, (B2 * C3 - B3 * C2) * delta)
    tries = 1
    if abs(delta) < _PARALLEL * (size2 * size3 + 1e-30):
        for A, B, C, reach in ((A2, B2, C2, size2), (A3, B3, C3, size3)):
            if reach > 1e-12:
                middle = math.atan2(B, A)
                half = math.acos(min(1.0, max(-1.0, -C / reach)))
                psi[tries], psi[tries + 1] = middle + half, middle - half
                tries += 2
    return tries


@kernel
def _orientation(cos_f: float, sin_f: float, cos_g: float, sin_g: float, psi: float, E: Any, F: Any, R: Any) -> None:
    """Write R = E Rz(φ) Ry(γ) Rz(ψ) Fᵀ."""
    cos_p, sin_p = math.cos(psi), math.sin(psi)
    middle = (
        (cos_f * cos_g * cos_p - sin_f * sin_p, -cos_f * cos_g * sin_p - sin_f * cos_p, cos_f * sin_g),
        (sin_f * cos_g * cos_p + cos_f * sin_p, -sin_f * cos_g * sin_p + cos_f * cos_p, sin_f * sin_g),
        (-sin_g * cos_p, sin_g * sin_p, cos_g),
    )
    for i in range(3):
        row = turn_back(middle, vector(E, i))
        for j in range(3):
            R[i, j] = dot(row, vector(F, j))


@kernel
def _pivot(v: Any, c: Any) -> int:
    """The equation whose u and v are the axes: far from folded, and with a v that is parallel to no other."""
    first, best = 0, -1.0
    for i in range(3):
        score = 1.0 - c[i] * c[i]
        for j in range(3):
            if j != i:
                x, y, z = cross(vector(v, i), vector(v, j))
                score *= x * x + y * y + z * z
        if score > best:
            best, first = score, i
    return first


@kernel
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
        Number of solutions; 0 also where some |c_i| > 1; :data:`CONTINUUM` where a curve of orientations solves them.
    """
    for i in range(3):
        if not abs(c[i]) <= 1.0 + 1e-14:
            return 0
    first = _pivot(v, c)
    cos_g = c[first]
    sin_g = math.sqrt(max(0.0, (1.0 - cos_g) * (1.0 + cos_g)))
    E, F, terms = np.empty_like(u), np.empty_like(u), np.empty((2, 3, 3))
    frame_along(u[first], E)
    frame_along(v[first], F)
    _fill_terms(u, v, c, first, cos_g, sin_g, E, F, terms)
    octic, mirrored = np.empty(MAX_DEGREE + 1), np.empty(MAX_DEGREE + 1)
    size = _eliminate(terms, octic, mirrored)
    if size < 0.0:
        return CONTINUUM
    found, psi = np.empty(2 * MAX_DEGREE), np.empty(5)
    R, turned, rows, error = np.empty_like(u), np.empty_like(u), np.empty_like(u), np.empty_like(c)
    count = 0
    for chart in range(2):
        number = roots_and_touches(octic if chart == 0 else mirrored, MAX_DEGREE, _TOUCH * size, found)
        for n in range(number):
            t = found[n]
            scale = 1.0 / (1.0 + t * t)
            cos_f, sin_f = (1.0 - t * t) * scale, 2.0 * t * scale
            if chart == 1:
                cos_f, sin_f = -cos_f, -sin_f
            for m in range(_spins(terms, cos_f, sin_f, psi)):
                _orientation(cos_f, sin_f, cos_g, sin_g, psi[m], E, F, R)
                if polish(R, u, v, c, rows, error, turned) <= _SOLVED:
                    count = _add(R, margin_of(rows), rotations, margins, count)
    return count
