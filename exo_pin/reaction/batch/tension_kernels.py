"""Tensions of one pose within their limits, of least norm, compiled: limbs that carry no side force.

What :class:`exo_pin.reaction.splits.spherical.Spherical` chooses in stacks, from the same programs of the numerics.
"""

from __future__ import annotations

from typing import Any

from ...core.compiled import kernel
from ...numerics.bounded.least_force_of_sums import SUMMED, least_sum_force
from ...numerics.small_linear import complete_basis
from ...numerics.vectors import root
from ...wrist.forces.wrench_feasibility import moment_margin

__all__ = ["MET", "NOT_HELD", "UNDECIDED", "tensions_within"]

#: The tensions are within their limits; no tensions are; rounding decides, or there are too many limbs.
MET, NOT_HELD, UNDECIDED = 0, 1, 2
#: Share of the largest tension by which a limit may be passed: rounding.
_ROUNDING = 1e-9
#: Margin of the moments, relative to forces and lever arms, beyond which rounding does not decide.
_CLEAR = 1e-9
#: Imbalance, relative to the largest tension, of an exact answer.
_EXACT = 1e-10


@kernel
def tensions_within(
    s: Any, X: Any, reach: Any, M: Any, radius: float, Q: Any, low: Any, high: Any, N: Any, G: Any, c: Any, z: Any,
    arms: Any, moment: Any, relief: Any, f: Any, shoulder: Any,
) -> int:  # fmt: skip
    """Replace f, the tensions of least norm, and F_s by those of least norm within limits; return one of the codes.

    Parameters
    ----------
    s, X, reach, M, radius : ndarray, tuple, float
        Directions, normals and lever arms of the limbs, shape (n, 3), (n, 3), (n,); the moment that they carry, N m;
        the largest |B_i|, m.
    Q : ndarray
        What :func:`exo_pin.wrist.forces.force_kernels.spherical_forces` leaves, shape (n, 3).
    low, high : ndarray
        Shape (n,), N, infinite where there is no limit.
    N, G, c, z, arms, moment, relief : ndarray
        Room, shapes (n, n - 3), (3, n - 3), (3,), (n - 3,), (n, 3), (2, 3) and (2, n).
    f, shoulder : ndarray
        Shape (n,), N, and (3,), N, changed if the result is :data:`MET`.
    """
    n, m = f.shape[0], N.shape[1]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(f[i]))
    inside, slack = True, _ROUNDING * largest
    for i in range(n):
        inside = inside and low[i] - slack <= f[i] <= high[i] + slack
    if inside:
        return MET
    if m > SUMMED:
        return UNDECIDED
    complete_basis(Q, N)
    for j in range(3):
        c[j] = 0.0
        for k in range(m):
            G[j, k] = 1.0 if j == k else 0.0
    for k in range(m):
        for i in range(n):
            c[k] += N[i, k] * f[i]
    if not least_sum_force(c, G, f, N, low, high, z[:m]):
        scale = max(largest, root(shoulder[0] ** 2 + shoulder[1] ** 2 + shoulder[2] ** 2))
        for i in range(n):
            scale = max(scale, max(low[i], -high[i]))
            for j in range(3):
                arms[i, j] = -reach[i] * X[i, j]
        moment[0, 0], moment[0, 1], moment[0, 2] = M
        margin = moment_margin(arms, moment[0], low, high, moment[1], relief[0], relief[1])
        return NOT_HELD if margin < -_CLEAR * scale * radius else UNDECIDED
    miss_x = miss_y = miss_z = most = 0.0
    for i in range(n):
        change = 0.0
        for k in range(m):
            change += N[i, k] * z[k]
        relief[0, i] = min(max(f[i] + change, low[i]), high[i]) - f[i]
        most = max(most, abs(f[i] + relief[0, i]))
        miss_x += relief[0, i] * reach[i] * X[i, 0]
        miss_y += relief[0, i] * reach[i] * X[i, 1]
        miss_z += relief[0, i] * reach[i] * X[i, 2]
    if max(abs(miss_x), max(abs(miss_y), abs(miss_z))) > _EXACT * radius * most:
        return UNDECIDED
    for i in range(n):
        f[i] += relief[0, i]
        for j in range(3):
            shoulder[j] += relief[0, i] * s[i, j]
    return MET
