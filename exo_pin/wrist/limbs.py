"""The limbs of the wrist in stacks of poses, the angles of their joints, and whether a pose has an answer.

The formulas of :mod:`exo_pin.numerics.vectors`, with their symbols and signs, for all limbs of a pose.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import kernel
from ..core.validation import FloatArray
from ..design import Mechanism
from ..numerics.vectors import (
    dot,
    gram,
    limb,
    margin_of_moments,
    matrix,
    root,
    second_invariant,
    status_code,
    triple,
    turn_back,
    vector,
)

#: Names of the status codes of :mod:`exo_pin.numerics.vectors`.
STATUS = ("ok", "near_singular", "singular", "folded", "not_solved")


@kernel
def fill_limbs(R: Any, base: Any, platform: Any, b: Any, s: Any, X: Any, length: Any, reach: Any) -> int:
    """Fill b, s, X, l and h of every limb, (4-1) and (D-11), (D-12); return the number of folded limbs.

    The pose is a tuple of rows. A folded limb has X = 0 and h = 0, a limb without length also s = 0.

    Source: thesis (4-1), (D-4), (D-11), (D-12).
    """
    count = 0
    for i in range(base.shape[0]):
        b_i, s_i, X_i, length[i], reach[i], folded = limb(R, vector(base, i), vector(platform, i))
        for j in range(3):
            b[i, j], s[i, j], X[i, j] = b_i[j], s_i[j], X_i[j]
        count += folded
    return count


@kernel(stack=True)
def limb_stack(R: Any, base: Any, platform: Any, b: Any, s: Any, X: Any, length: Any, reach: Any) -> None:
    """:func:`fill_limbs` over a stack of poses, the first axis of every array but ``base`` and ``platform``."""
    for k in range(R.shape[0]):
        fill_limbs(matrix(R[k]), base, platform, b[k], s[k], X[k], length[k], reach[k])


@kernel
def margin_of_limbs(X: Any, reach: Any) -> float:
    """:func:`.margin_of_moments` of the rows h_i X_i."""
    n = X.shape[0]
    g0 = g1 = g2 = g3 = g4 = g5 = 0.0
    for i in range(n):
        part = gram(vector(X, i), reach[i])
        g0, g1, g2, g3, g4, g5 = g0 + part[0], g1 + part[1], g2 + part[2], g3 + part[3], g4 + part[4], g5 + part[5]
    second = second_invariant((g0, g1, g2, g3, g4, g5))
    if not second > 0.0:
        return 0.0
    volume = 0.0  # of the Gram matrix, as a sum of squares over all triples of limbs (Cauchy and Binet)
    for i in range(n):
        for j in range(i + 1, n):
            for k in range(j + 1, n):
                part_volume = triple(vector(X, i), vector(X, j), vector(X, k))
                part_volume *= reach[i] * reach[j] * reach[k]
                volume += part_volume * part_volume
    return margin_of_moments(g0 + g3 + g5, second, root(volume))


@kernel
def largest_radius(platform: Any) -> float:
    """The largest |B_i|, m."""
    radius = 0.0
    for i in range(platform.shape[0]):
        p = vector(platform, i)
        radius = max(radius, root(dot(p, p)))
    return radius


@kernel
def pose_status(X: Any, reach: Any, upu: Any) -> tuple[int, float]:
    """Status code and margin of a pose whose limbs are known.

    A pose with a folded UPU limb (h = 0; indices ``upu``) has no answer: X_i is undefined. A folded SPS limb only loses
    its moment arm; with more than three limbs the others may hold the pose.
    """
    margin = margin_of_limbs(X, reach)
    spoiled = False
    if X.shape[0] == 3:
        spoiled = reach[0] == 0.0 or reach[1] == 0.0 or reach[2] == 0.0
    else:
        for k in range(upu.shape[0]):
            spoiled |= reach[upu[k]] == 0.0
    return status_code(spoiled, margin), margin


@kernel(stack=True)
def classify_stack(R: Any, base: Any, platform: Any, upu: Any, limbs: Limbs) -> None:
    """:func:`limb_stack`, and status code, margin and det[X_1 X_2 X_3] (NaN for n > 3) of every pose."""
    for k in range(R.shape[0]):
        X, reach = limbs.X[k], limbs.reach[k]
        fill_limbs(matrix(R[k]), base, platform, limbs.b[k], limbs.s[k], X, limbs.length[k], reach)
        limbs.status[k], limbs.margin[k] = pose_status(X, reach, upu)
        limbs.determinant[k] = triple(vector(X, 0), vector(X, 1), vector(X, 2)) if base.shape[0] == 3 else np.nan


@kernel(stack=True)
def joint_angles(R: Any, base: Any, limbs: Limbs, about_a: Any, about_b: Any, angles: Any) -> None:
    """Fill the angles of platform_y, platform_x, base_x and base_y, rad, and the slide, m, of all limbs.

    Source: thesis (D-4), (D-11), (D-12).

    Parameters
    ----------
    R : ndarray
        Poses, shape (N, 3, 3).
    base : ndarray
        Points A_i, shape (n, 3), m.
    limbs : Limbs
        In these poses.
    about_a, about_b : ndarray
        Shape (n, 2, 3): sine and cosine per unit of X of its turn about -a_i, base frame, and about -b_i, arm frame.
    angles : ndarray
        Shape (N, n, 5), written.
    """
    for k in range(R.shape[0]):
        for i in range(base.shape[0]):
            axis, along, reach = vector(limbs.X[k], i), vector(limbs.s[k], i), limbs.reach[k, i]
            own = turn_back(matrix(R[k]), axis)
            angles[k, i, 0] = math.atan2(dot(about_b[i, 0], own), dot(about_b[i, 1], own))
            angles[k, i, 1] = math.atan2(reach, -dot(vector(limbs.b[k], i), along))
            angles[k, i, 2] = math.atan2(-reach, -dot(vector(base, i), along))
            angles[k, i, 3] = math.atan2(dot(about_a[i, 0], axis), dot(about_a[i, 1], axis))
            angles[k, i, 4] = limbs.length[k, i]


class Limbs(NamedTuple):
    """The limbs in N poses, and whether the poses have an answer.

    Attributes
    ----------
    status : ndarray of int8
        Index into :data:`STATUS`, shape (N,).
    margin : ndarray
        Shape (N,), dimensionless distance from the singular surface, 0 to 1: :func:`.margin_of_values` of the rows
        b_i × s_i.
    determinant : ndarray
        det[X_1 X_2 X_3], shape (N,); NaN for other than three limbs, 0 with a folded limb.
    b, s, X : ndarray
        Vectors from O to B_i in m, directions and axes of the limbs, base frame, shape (N, n, 3); X is 0 for a folded
        limb.
    length, reach : ndarray
        l_i, and distance h_i from O to the limb's line, shape (N, n), m.
    """

    status: NDArray[np.int8]
    margin: FloatArray
    determinant: FloatArray
    b: FloatArray
    s: FloatArray
    X: FloatArray
    length: FloatArray
    reach: FloatArray


def classify(mechanism: Mechanism, matrices: FloatArray) -> Limbs:
    """Find the limbs of poses, shape (N, 3, 3), and which poses have an answer."""
    count, geometry = len(matrices), mechanism.geometry
    n = len(geometry.base_points)
    limbs = Limbs(
        np.empty(count, dtype=np.int8),
        *(np.empty(count) for _ in range(2)),
        *(np.empty((count, n, 3)) for _ in range(3)),
        *(np.empty((count, n)) for _ in range(2)),
    )
    upu = np.flatnonzero(mechanism.is_upu)
    classify_stack(matrices, geometry.base_points, geometry.platform_points, upu, limbs)
    return limbs
