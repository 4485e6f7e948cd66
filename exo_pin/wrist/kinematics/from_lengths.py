"""Forward kinematics over stacks from limb lengths, and from θ_xA, which give the lengths, compiled.

Forward kinematics from angles of the base joints over stacks, compiled.

Scenario One has both angles of every base joint, and finds the pose by least squares; else θ_yA alone is known.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.vectors import dot, matrix, root, rotation_matrix, turn, turn_back, vector
from ..limbs import fill_limbs
from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN, rotate
from .inverse import joint_rows
from .solutions import Joints, Modes, Solutions, half_cosine, insert, quaternion, solve, write_modes

#: Modes with more than this multiple of the least residual (plus 1e-9 rad) are dropped.
_KEEP = 3.0


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


@kernel(stack=True, cost=20)
def planes_stack(theta_y: Any, joints: Joints, modes: Modes) -> None:
    """All poses with given θ_yA.

    The angle fixes the half-plane, bounded by the line O A_i, in which B_i lies: X_i · R B_i = 0 with
    X_i = (cos θy, 0, -sin θy) in {A_i}, and B_i on the side of (sin θy, 0, cos θy). The first has at most eight
    solutions; the second selects among them. Arguments as :func:`.lengths_stack`; the residual is computed by the
    caller.
    """
    n = joints.base.shape[0]
    X, side, c = np.empty_like(joints.base), np.empty_like(joints.base), np.zeros(n)
    found = Solutions(np.empty((MAX_MODES, 3, 3)), np.empty(MAX_MODES), np.empty(MAX_MODES))
    for k in range(theta_y.shape[0]):
        modes.number[k] = 0
        if not np.isfinite(theta_y[k]).all():
            continue
        for i in range(n):
            cosine, sine, frame = math.cos(theta_y[k, i]), math.sin(theta_y[k, i]), matrix(joints.frames[i])
            X[i, 0], X[i, 1], X[i, 2] = turn(frame, (cosine, 0.0, -sine))
            side[i, 0], side[i, 1], side[i, 2] = turn(frame, (sine, 0.0, cosine))
        number = solve(X, joints.v, c, joints.triples, found)
        for m in range(number):
            found.residuals[m] = 0.0
            for i in range(n):
                if not dot(vector(side, i), turn(matrix(found.R[m]), vector(joints.v, i))) > 0.0:
                    found.residuals[m] = math.nan
        modes.number[k] = write_modes(found, number, joints.reference, modes, k, 0)


@kernel(stack=True)
def angle_residuals(theta: Any, about_x: bool, joints: Joints, tolerance: float, modes: Modes) -> None:
    """Fill the residual of modes found from θ_xA or θ_yA alone, rad: the largest error of an angle.

    With more than three limbs, modes with a residual above ``tolerance`` are dropped.
    """
    n = joints.base.shape[0]
    like, length, reach = joints.base, np.empty(n), np.empty(n)
    b, s, X = np.empty_like(like), np.empty_like(like), np.empty_like(like)
    for k in range(theta.shape[0]):
        selected = 0
        for m in range(modes.number[k]):
            q = modes.q[k, m]
            fill_limbs(rotation_matrix(q[0], q[1], q[2], q[3]), joints.base, joints.platform, b, s, X, length, reach)
            worst = 0.0
            for i in range(n):
                x, y, z = turn_back(matrix(joints.frames[i]), vector(s, i))
                angle = math.atan2(-y, math.hypot(x, z)) if about_x else math.atan2(x, z)
                worst = max(worst, abs(wrapped(theta[k, i] - angle)))
            if n > 3 and worst > tolerance:
                continue
            modes.q[k, selected], modes.residual[k, selected], modes.margin[k, selected] = q, worst, modes.margin[k, m]
            selected += 1
        modes.number[k] = min(modes.number[k], selected)


@kernel
def wrapped(angle: float) -> float:
    """The angle within ±π."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@kernel
def _angle_errors(
    R: Any, joints: Joints, theta_x: Any, theta_y: Any, limbs: Any, rows: Any, J: Any, error: Any
) -> float:
    """Fill the 2n angle errors and their Jacobian's rows; return the sum of squares (inf for a folded limb)."""
    b, s, X, length, reach = limbs
    if fill_limbs(matrix(R), joints.base, joints.platform, b, s, X, length, reach) > 0:
        return np.inf
    total = 0.0
    for i in range(b.shape[0]):
        joint_rows(joints.base[i], b[i], s[i], X[i], length[i], reach[i], rows)
        x, y, z = turn_back(matrix(joints.frames[i]), vector(s, i))
        error[2 * i] = theta_x[i] - math.atan2(-y, math.hypot(x, z))
        error[2 * i + 1] = wrapped(theta_y[i] - math.atan2(x, z))
        J[2 * i], J[2 * i + 1] = rows[1], rows[2]
        total += error[2 * i] ** 2 + error[2 * i + 1] ** 2
    return total


@kernel(stack=True, cost=20)
def directions_stack(theta_x: Any, theta_y: Any, joints: Joints, modes: Modes) -> None:
    """Poses from both angles of every base joint (Scenario One), least squares over the 2n angles.

    The angles give each limb's direction s, (4-25); with l² + 2 l (a·s) + |a|² - |b|² = 0 they give its end point, two
    points where both roots are positive (where none is real: the point of the line closest to the platform's
    sphere). Each combination of points is fitted by a rotation (Kabsch), which starts Levenberg's method on the
    angles themselves.

    Parameters
    ----------
    theta_x, theta_y : ndarray
        Shape (N, n), rad.
    joints : Joints
        The wrist.
    modes : Modes
        Written, best residual first. The residual is the largest error of an angle, rad; the margin the smallest
        singular value of the angles' Jacobian.

    Notes
    -----
    Source: thesis (4-17), (4-21).
    """
    n = joints.base.shape[0]
    like = joints.base
    limbs = (np.empty_like(like), np.empty_like(like), np.empty_like(like), np.empty(n), np.empty(n))
    rows, J, error = np.empty((5, 3)), np.empty((2 * n, 3)), np.empty(2 * n)
    roots, number, lines, ends = np.empty((n, 2)), np.empty(n, dtype=np.int64), np.empty_like(like), np.empty_like(like)
    R, trial, fresh = np.empty((3, 3)), np.empty((3, 3)), np.empty(4)
    for k in range(theta_x.shape[0]):
        modes.number[k] = 0
        combinations = 1
        for i in range(n):
            number[i] = 0
            sine, cosine, y = math.sin(theta_x[k, i]), math.cos(theta_x[k, i]), theta_y[k, i]
            direction = (cosine * math.sin(y), -sine, cosine * math.cos(y))
            lines[i, 0], lines[i, 1], lines[i, 2] = turn(matrix(joints.frames[i]), direction)
            if math.isfinite(theta_x[k, i]) and math.isfinite(y):
                number[i], _ = twist_roots(sine, joints.a[i], joints.b[i], roots[i])
                if number[i] == 0 and sine < 0.0:
                    roots[i, 0], number[i] = -joints.a[i] * sine, 1
            combinations *= number[i]
        for m in range(combinations):
            rest = m
            for i in range(n):
                ends[i] = joints.base[i] + roots[i, rest % number[i]] * lines[i]
                rest //= number[i]
            U, _, Vt = np.linalg.svd(ends.T @ joints.platform)
            if not np.linalg.det(U) * np.linalg.det(Vt) > 0.0:
                U[:, 2] *= -1.0
            R[:, :] = U @ Vt
            best = _angle_errors(R, joints, theta_x[k], theta_y[k], limbs, rows, J, error)
            damping = 0.0
            for _ in range(60):
                if not best < np.inf or best < 1e-31:
                    break
                G = J.T @ J
                for j in range(3):
                    G[j, j] += damping * (1.0 + G[j, j]) + 1e-15
                step = np.linalg.solve(G, J.T @ error)
                trial[:, :] = R
                rotate(trial, step[0], step[1], step[2])
                total = _angle_errors(trial, joints, theta_x[k], theta_y[k], limbs, rows, J, error)
                if total < best:
                    R[:, :] = trial
                    done = best - total <= 1e-15 * best
                    best = total
                    damping *= 0.1
                    if done:
                        break
                else:
                    best = _angle_errors(R, joints, theta_x[k], theta_y[k], limbs, rows, J, error)
                    if damping > 1e3 or step @ step < 1e-28:
                        break
                    damping = max(10.0 * damping, 1e-6)
            if not best < np.inf:
                continue
            quaternion(R, fresh)
            known = modes.number[k] == modes.q.shape[1]
            for e in range(modes.number[k]):
                # 1 - cos(angle/2) of two poses closer than about 1e-6 rad.
                known = known or half_cosine(fresh, modes.q[k, e]) > 1.0 - 1e-13
            if known:
                continue
            largest = np.abs(error).max()
            smallest = math.sqrt(max(0.0, np.linalg.eigvalsh(J.T @ J)[0]))
            place = np.searchsorted(modes.residual[k, : modes.number[k]], largest, "right")
            insert(modes, k, place, modes.number[k], fresh, largest, smallest)
            modes.number[k] += 1
        while modes.number[k] > 1 and modes.residual[k, modes.number[k] - 1] > _KEEP * modes.residual[k, 0] + 1e-9:
            modes.number[k] -= 1
