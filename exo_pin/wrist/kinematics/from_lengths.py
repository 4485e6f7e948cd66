"""Forward kinematics over stacks from limb lengths, and from θ_xA, which give the lengths, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.vectors import dot, matrix, root, turn, vector
from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN
from .solutions import Joints, Modes, Solutions, solve, write_modes


@kernel
def _length_error(R: Any, base: Any, platform: Any, lengths: Any) -> float:
    worst = 0.0
    for i in range(base.shape[0]):
        x, y, z = turn(matrix(R), vector(platform, i))
        line = (x - base[i, 0], y - base[i, 1], z - base[i, 2])
        worst = max(worst, abs(root(dot(line, line)) - lengths[i]))
    return worst


@kernel(stack=True, cost=20)
def lengths_stack(lengths: Any, joints: Joints, tolerance: float, modes: Modes) -> None:
    """All poses with given limb lengths: a_i · R B_i = (|a|² + |b|² - l²)/2.

    Parameters
    ----------
    lengths : ndarray
        Shape (N, n), m; rows with a NaN or a length that is not positive get no modes.
    joints : Joints
        The wrist.
    tolerance : float
        With more than three limbs, modes with a larger residual are dropped, m.
    modes : Modes
        Written, W >= 8. The residual is the largest error of a length, m.
    """
    found = Solutions(np.empty((MAX_MODES, 3, 3)), np.empty(MAX_MODES), np.empty(MAX_MODES))
    for k in range(lengths.shape[0]):
        modes.number[k] = _from_lengths(lengths[k], joints, tolerance, np.inf, 0, found, modes, k, 0)


@kernel
def _from_lengths(
    lengths: Any, joints: Joints, tolerance: float, closest: float, flips: int, found: Solutions, modes: Modes,
    row: int, start: int,
) -> int:  # fmt: skip
    """The modes of one set of lengths, written after the first ``start`` of the row.

    Where the lengths are roots themselves, modes also meet where two roots do: ``closest`` bounds the margin, and each
    of ``flips`` second roots turns its sign.
    """
    n = joints.base.shape[0]
    c = np.empty(n)
    for i in range(n):
        if not lengths[i] > 0.0:
            return start
        a, b = joints.a[i], joints.b[i]
        # (a² + b² - l²)/2ab, by the law of cosines; near ±1 this form loses no digits of the angle's square.
        short, long = lengths[i] - (b - a), lengths[i] + (b - a)
        c[i] = 1.0 - short * long / (2.0 * a * b)
    number = solve(joints.u, joints.v, c, joints.triples, found)
    for m in range(number):
        error = _length_error(found.R[m], joints.base, joints.platform, lengths)
        found.residuals[m] = math.nan if n > 3 and error > tolerance else error
        if abs(found.margins[m]) > closest:
            found.margins[m] = math.copysign(closest, found.margins[m])
        if flips % 2 == 1:
            found.margins[m] = -found.margins[m]
    return write_modes(found, number, joints.reference, modes, row, start)


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
def twist_stack(theta_x: Any, joints: Joints, modes: Modes) -> None:
    """All poses with given θ_xA (Scenario Two), the residual in rad.

    Each angle gives the length of its limb alone, l² + 2 l |a| sin θx + |a|² - |b|² = 0, with one positive root where
    |b| > |a|, and two or none where |b| < |a|; then the lengths give the poses. Arguments as
    :func:`lengths_stack`; W is 8 times the number of combinations of roots.

    Source: thesis (4-27), (5-3).
    """
    n = joints.base.shape[0]
    found = Solutions(np.empty((MAX_MODES, 3, 3)), np.empty(MAX_MODES), np.empty(MAX_MODES))
    lengths, roots, number = np.empty(n), np.empty((n, 2)), np.empty(n, dtype=np.int64)
    for k in range(theta_x.shape[0]):
        combinations, closest = 1, np.inf
        for i in range(n):
            number[i] = 0
            if abs(theta_x[k, i]) <= 0.5 * math.pi:
                number[i], width = twist_roots(math.sin(theta_x[k, i]), joints.a[i], joints.b[i], roots[i])
                closest = min(closest, width)
            combinations *= number[i]
        total = 0
        for m in range(combinations):
            rest, flips = m, 0
            for i in range(n):
                lengths[i] = roots[i, rest % number[i]]
                flips += rest % number[i]
                rest //= number[i]
            total = _from_lengths(lengths, joints, np.inf, closest, flips, found, modes, k, total)
            if total == CONTINUUM:
                break
        modes.number[k] = total
