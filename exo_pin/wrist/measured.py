"""Forward kinematics over stacks: from what is measured to the equations of :mod:`.assembly`, compiled.

Every kernel fills, for each of N rows, up to W modes: unit quaternions (x, y, z, w), residual, signed margin, and a
code in ``count`` (how many, or :data:`CONTINUUM`). Modes are ordered by their angle from a reference pose.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN, assemble, margin_of, turn
from .formulas import cross
from .kernels import limb_vectors

__all__ = [
    "angle_residuals",
    "lengths_stack",
    "planes_stack",
    "quaternion",
    "twist_roots",
    "twist_stack",
    "unit_directions",
    "wrapped",
]

_compile = njit(cache=True, error_model="numpy")


@_compile
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


@_compile
def _write(
    R: Any, margins: Any, residuals: Any, found: int, reference: Any, q: Any, residual: Any, margin: Any, start: int
) -> int:
    """Put ``found`` modes behind the first ``start`` of a row, keeping the row ordered by angle from the reference."""
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


@_compile
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


@_compile
def _solve(u: Any, v: Any, c: Any, triples: Any, R: Any, margins: Any) -> int:
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
        kept = 0
        for k in range(found):
            _least_squares(R[k], u, v, c)
            fresh = True
            for m in range(kept):
                fresh = fresh and np.abs(R[m] - R[k]).max() > 1e-6
            if fresh:
                R[kept] = R[k]
                # Of all the triples' margins the best counts: the other limbs hold what one triple lets go.
                margins[kept] = 0.0
                for s in range(triples.shape[0]):
                    for e in range(3):
                        i = triples[s, e]
                        w = R[kept] @ v[i]
                        x, y, z = cross(w, u[i])
                        rows[e, 0], rows[e, 1], rows[e, 2] = x, y, z
                    margins[kept] = max(margins[kept], abs(margin_of(rows)))
                kept += 1
        return kept
    return CONTINUUM


@_compile
def _length_error(R: Any, base: Any, platform: Any, lengths: Any) -> float:
    worst = 0.0
    for i in range(base.shape[0]):
        square = 0.0
        for j in range(3):
            d = R[j, 0] * platform[i, 0] + R[j, 1] * platform[i, 1] + R[j, 2] * platform[i, 2] - base[i, j]
            square += d * d
        worst = max(worst, abs(math.sqrt(square) - lengths[i]))
    return worst


@_compile
def lengths_stack(
    lengths: Any,
    base: Any,
    platform: Any,
    triples: Any,
    tolerance: float,
    reference: Any,
    q: Any,
    residual: Any,
    margin: Any,
    count: Any,
) -> None:
    """All poses with given limb lengths: a_i · R B_i = (|a|² + |b|² - l²)/2.

    Parameters
    ----------
    lengths : ndarray
        Shape (N, n), m; rows with a NaN or a length that is not positive get no modes.
    base, platform : ndarray
        Shape (n, 3).
    triples : ndarray of int
        Shape (T, 3), triples of limbs to solve with, best first; used for n > 3.
    tolerance : float
        With more than three limbs, modes with a larger residual are dropped, m.
    reference : ndarray
        Shape (4,), quaternion of the pose that modes are ordered from.
    q, residual, margin, count : ndarray
        Shapes (N, 8, 4), (N, 8), (N, 8), (N,), written. The residual is the largest error of a length, m.
    """
    n = base.shape[0]
    u, v, size = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 2))
    unit_directions(base, platform, u, v, size)
    c, R, margins, errors = np.empty(n), np.empty((MAX_MODES, 3, 3)), np.empty(MAX_MODES), np.empty(MAX_MODES)
    for k in range(lengths.shape[0]):
        count[k] = _from_lengths(
            lengths[k], base, platform, u, v, size, triples, tolerance, reference, np.inf, 0,
            c, R, margins, errors, q[k], residual[k], margin[k], 0,
        )  # fmt: skip


@_compile
def unit_directions(base: Any, platform: Any, u: Any, v: Any, size: Any) -> None:
    """Write the unit vectors along A_i and B_i, shape (n, 3), and their lengths, shape (n, 2)."""
    for i in range(base.shape[0]):
        size[i, 0] = math.sqrt(base[i, 0] ** 2 + base[i, 1] ** 2 + base[i, 2] ** 2)
        size[i, 1] = math.sqrt(platform[i, 0] ** 2 + platform[i, 1] ** 2 + platform[i, 2] ** 2)
        for j in range(3):
            u[i, j], v[i, j] = base[i, j] / size[i, 0], platform[i, j] / size[i, 1]


@_compile
def _from_lengths(
    lengths: Any,
    base: Any,
    platform: Any,
    u: Any,
    v: Any,
    size: Any,
    triples: Any,
    tolerance: float,
    reference: Any,
    closest: float,
    flips: int,
    c: Any,
    R: Any,
    margins: Any,
    errors: Any,
    q: Any,
    residual: Any,
    margin: Any,
    start: int,
) -> int:
    """The modes of one set of lengths, behind the first ``start`` of the row.

    Where the lengths are roots themselves, modes also meet where two roots do: ``closest`` bounds the margin, and each
    of ``flips`` second roots turns its sign.
    """
    n = base.shape[0]
    for i in range(n):
        if not lengths[i] > 0.0:
            return start
        a, b = size[i, 0], size[i, 1]
        # (a² + b² - l²)/2ab, by the law of cosines; near ±1 this form loses no digits of the angle's square.
        short, long = lengths[i] - (b - a), lengths[i] + (b - a)
        c[i] = 1.0 - short * long / (2.0 * a * b)
    found = _solve(u, v, c, triples, R, margins)
    if found == CONTINUUM:
        return CONTINUUM
    for m in range(found):
        errors[m] = _length_error(R[m], base, platform, lengths)
        if abs(margins[m]) > closest:
            margins[m] = math.copysign(closest, margins[m])
        if flips % 2 == 1:
            margins[m] = -margins[m]
        if n > 3 and errors[m] > tolerance:
            errors[m] = math.nan
    return _write(R, margins, errors, found, reference, q, residual, margin, start)


@_compile
def twist_roots(sine: float, a: float, b: float, roots: Any) -> tuple[int, float]:
    """Write the positive roots of l² + 2 l a sin θx + a² - b² = 0, (4-27).

    The discriminant b² - a² cos²θx compares the line's closest approach to O with the platform's radius.

    Returns
    -------
    int
        How many; roots that rounding cannot tell apart are one.
    float
        Half their difference over b, 0 where they meet: that is b·s/b, the sensor's own distance from its
        singularity.
    """
    closest = a * math.sqrt(max(0.0, (1.0 - sine) * (1.0 + sine)))
    square = (b - closest) * (b + closest)
    if square < 0.0:
        # Rounding of an angle at which the two roots meet moves the discriminant by a few eps.
        if square < -4e-15 * b * b:
            return 0, 0.0
        square = 0.0
    half, width = -a * sine, math.sqrt(square)
    # The root that is a difference comes from the product of the two, (a - b)(a + b), without losing digits.
    first = half + width if half >= 0.0 else half - width
    second = (a - b) * (a + b) / first if first != 0.0 else 0.0
    # A root as short as this is the spurious l = 0 of |a| = |b|, where every angle fits.
    shortest = 1e-12 * (a + b)
    number = 0
    if max(first, second) > shortest:
        roots[0] = max(first, second)
        number = 1
        if min(first, second) > shortest and width > MEETING_MARGIN * b:
            roots[1] = min(first, second)
            number = 2
    return number, width / b


@_compile
def twist_stack(
    theta_x: Any,
    base: Any,
    platform: Any,
    triples: Any,
    tolerance: float,
    reference: Any,
    q: Any,
    residual: Any,
    margin: Any,
    count: Any,
) -> None:
    """All poses with given θ_xA (Scenario Two), the residual in rad.

    Each angle gives the length of its limb alone, l² + 2 l |a| sin θx + |a|² - |b|² = 0, with one positive root where
    |b| > |a|, and two or none where |b| < |a|; then the lengths give the poses. Arguments as
    :func:`lengths_stack`; W is 8 times the number of combinations of roots.
    """
    n = base.shape[0]
    u, v, size = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 2))
    unit_directions(base, platform, u, v, size)
    c, R, margins, errors = np.empty(n), np.empty((MAX_MODES, 3, 3)), np.empty(MAX_MODES), np.empty(MAX_MODES)
    lengths, roots, number = np.empty(n), np.empty((n, 2)), np.empty(n, dtype=np.int64)
    for k in range(theta_x.shape[0]):
        combinations, real, closest = 1, True, np.inf
        for i in range(n):
            number[i] = 0
            if abs(theta_x[k, i]) <= 0.5 * math.pi:
                number[i], width = twist_roots(math.sin(theta_x[k, i]), size[i, 0], size[i, 1], roots[i])
                closest = min(closest, width)
            combinations *= number[i]
        total = 0
        for m in range(combinations):
            rest, flips = m, 0
            for i in range(n):
                lengths[i] = roots[i, rest % number[i]]
                flips += rest % number[i]
                rest //= number[i]
            following = _from_lengths(
                lengths, base, platform, u, v, size, triples, np.inf, reference, closest, flips,
                c, R, margins, errors, q[k], residual[k], margin[k], total,
            )  # fmt: skip
            if following == CONTINUUM:
                real = False
                break
            total = following
        count[k] = total if real else CONTINUUM


@_compile
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
    solutions, of which the second keeps some. Arguments as :func:`lengths_stack`; ``frames`` is {A_i}, shape
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
        found = _solve(X, v, c, triples, R, margins)
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
        count[k] = _write(R, margins, errors, found, reference, q[k], residual[k], margin[k], 0)


@_compile
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
        kept = 0
        for m in range(count[k]):
            _matrix(q[k, m], R)
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
            q[k, kept], residual[k, kept], margin[k, kept] = q[k, m], worst, margin[k, m]
            kept += 1
        for m in range(kept, count[k]):
            q[k, m], residual[k, m], margin[k, m] = np.nan, np.nan, np.nan
        if count[k] > kept:
            count[k] = kept


@_compile
def wrapped(angle: float) -> float:
    """The angle within ±π."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@_compile
def _matrix(q: Any, R: Any) -> None:
    """Rotation matrix of a unit quaternion (x, y, z, w)."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
