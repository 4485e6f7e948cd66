"""Forward kinematics over stacks from limb lengths, and from θ_xA, which give the lengths, compiled.

Every kernel fills, for each of N rows, up to W modes: unit quaternions (x, y, z, w), residual, signed margin, and a
code in ``count`` (their number, or :data:`CONTINUUM`). Modes are ordered by their angle from a reference pose.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN
from .solutions import solve, write_modes

__all__ = ["lengths_stack", "twist_roots", "twist_stack", "unit_directions"]


@kernel
def _length_error(R: Any, base: Any, platform: Any, lengths: Any) -> float:
    worst = 0.0
    for i in range(base.shape[0]):
        square = 0.0
        for j in range(3):
            d = R[j, 0] * platform[i, 0] + R[j, 1] * platform[i, 1] + R[j, 2] * platform[i, 2] - base[i, j]
            square += d * d
        worst = max(worst, abs(math.sqrt(square) - lengths[i]))
    return worst


@kernel(stack=True, cost=20)
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


@kernel
def unit_directions(base: Any, platform: Any, u: Any, v: Any, size: Any) -> None:
    """Write the unit vectors along A_i and B_i, shape (n, 3), and their lengths, shape (n, 2)."""
    for i in range(base.shape[0]):
        size[i, 0] = math.sqrt(base[i, 0] ** 2 + base[i, 1] ** 2 + base[i, 2] ** 2)
        size[i, 1] = math.sqrt(platform[i, 0] ** 2 + platform[i, 1] ** 2 + platform[i, 2] ** 2)
        for j in range(3):
            u[i, j], v[i, j] = base[i, j] / size[i, 0], platform[i, j] / size[i, 1]


@kernel
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
    """The modes of one set of lengths, written after the first ``start`` of the row.

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
    found = solve(u, v, c, triples, R, margins)
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
    return write_modes(R, margins, errors, found, reference, q, residual, margin, start)


@kernel
def twist_roots(sine: float, a: float, b: float, roots: Any) -> tuple[int, float]:
    """Write the positive roots of l² + 2 l a sin θx + a² - b² = 0, (4-27).

    The discriminant b² - a² cos²θx compares the line's closest approach to O with the platform's radius.

    Returns
    -------
    int
        Number of roots; roots that differ by rounding alone are one.
    float
        Half their difference over b, 0 where they meet: that is b·s/b, the distance of the sensor from its
        singularity.

    Notes
    -----
    Source: thesis (4-27).
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


@kernel(stack=True, cost=20)
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

    Source: thesis (4-27), (5-3).
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
