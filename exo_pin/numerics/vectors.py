"""The formulas of the wrist for one limb or one pose, on plain numbers. All kernels use them.

Vectors are tuples of three numbers and matrices tuples of three rows, so that a compiler can keep them in registers and
work on several poses at once; no array is touched here.

Symbols: a = A_i and b = R B_i, both from O in the base frame; s = (b - a)/l the limb's direction from torso to arm;
X = -(a × b)/|a × b| the normal of the limb's plane O A_i B_i, (D-11); h = |b × s| the distance from O to the limb's
line. They satisfy b × s = -h X, so that the actuation and the constraint singularity of this wrist are one
locus, det[X_1 X_2 X_3] = 0, next to the folded case h_i = 0.

Signs: f > 0 is tension, the limb pulls the arm with -f s; the side force -g X passes through O.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.compiled import kernel
from ..core.validation import FloatArray

OK, NEAR_SINGULAR, SINGULAR, FOLDED, NOT_SOLVED = 0, 1, 2, 3, 4

#: Sine of the angle A_i O B_i below which a limb counts as folded: its plane, and with it X_i, has no direction.
FOLDED_SINE = 1e-9
#: Margin below which a pose has no answer: rounding would leave fewer than about seven digits.
SINGULAR_MARGIN = 1e-9
#: Margin below which an answer is marked: some moments take more than 1000 times the effort that others take.
NEAR_MARGIN = 1e-3


@kernel(inline=True)
def root(number: float) -> float:
    """Square root, which Numba compiles to one instruction of the processor."""
    return math.sqrt(number)


@kernel(inline=True)
def vector(array: Any, row: int) -> Any:
    """Row of an array of shape (N, 3)."""
    return array[row, 0], array[row, 1], array[row, 2]


@kernel(inline=True)
def matrix(array: Any) -> Any:
    """Rows of an array of shape (3, 3)."""
    return vector(array, 0), vector(array, 1), vector(array, 2)


@kernel(inline=True)
def add(u: Any, v: Any) -> Any:
    """Sum of two vectors."""
    return u[0] + v[0], u[1] + v[1], u[2] + v[2]


@kernel(inline=True)
def dot(u: Any, v: Any) -> float:
    """Scalar product."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@kernel(inline=True)
def cross(u: Any, v: Any) -> Any:
    """Vector product."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@kernel(inline=True)
def triple(u: Any, v: Any, w: Any) -> float:
    """u · (v × w)."""
    return dot(u, cross(v, w))


@kernel(inline=True)
def turn(R: Any, v: Any) -> Any:
    """R v: from the arm's axes to the base's."""
    return dot(R[0], v), dot(R[1], v), dot(R[2], v)


@kernel(inline=True)
def turn_back(R: Any, v: Any) -> Any:
    """Rᵀ v: from the base's axes to the arm's."""
    return (
        R[0][0] * v[0] + R[1][0] * v[1] + R[2][0] * v[2],
        R[0][1] * v[0] + R[1][1] * v[1] + R[2][1] * v[2],
        R[0][2] * v[0] + R[1][2] * v[1] + R[2][2] * v[2],
    )


@kernel(inline=True)
def rotation_matrix(x: float, y: float, z: float, w: float) -> Any:
    """Rotation matrix of a unit quaternion."""
    return (
        (x * x - y * y - z * z + w * w, 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), -x * x - y * y + z * z + w * w),
    )


@kernel(inline=True)
def limb(R: Any, a: Any, p: Any) -> Any:
    """One limb of a pose, (4-1), (D-11), (D-12): b, s, X, l, h, and whether it is folded.

    A folded limb has X = 0 and h = 0, a limb without length also s = 0. ``p`` is B_i in the arm's axes.

    Source: thesis (4-1), (4-9), (5-2), (D-4), (D-11), (D-12).
    """
    b = turn(R, p)
    span = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    normal = cross(a, b)
    square, area_square = dot(span, span), dot(normal, normal)
    length, area = root(square), root(area_square)
    folded = area_square <= FOLDED_SINE**2 * dot(a, a) * dot(b, b)
    # Both quotients are computed before one is selected, so that the loops over poses have no branch.
    per_length, per_area = 1.0 / length, -1.0 / area
    per_length = per_length if square > 0.0 else 0.0
    per_area = 0.0 if folded else per_area
    s = (span[0] * per_length, span[1] * per_length, span[2] * per_length)
    X = (normal[0] * per_area, normal[1] * per_area, normal[2] * per_area)
    return b, s, X, length, 0.0 if folded else area * per_length, folded


@kernel(inline=True)
def gram(X: Any, weight: float) -> Any:
    """Upper half of weight² X Xᵀ."""
    w = weight * weight
    return w * X[0] * X[0], w * X[0] * X[1], w * X[0] * X[2], w * X[1] * X[1], w * X[1] * X[2], w * X[2] * X[2]


@kernel(inline=True)
def second_invariant(g: Any) -> float:
    """Sum of the principal minors of order two of a symmetric matrix given by its upper half."""
    return g[0] * g[3] - g[1] * g[1] + g[0] * g[5] - g[2] * g[2] + g[3] * g[5] - g[4] * g[4]


@kernel(inline=True)
def margin_of_moments(trace: float, second: float, volume: float) -> float:
    """Distance of a pose from a singular one: :func:`margin_of_values` by the invariants of M Mᵀ, det = volume².

    Its roots are not taken, and near a singular pose it does not square what is small, as eigenvalues would.
    """
    margin = 3.0 * root(volume * volume / (trace * second))
    return margin if second > 0.0 else 0.0


def margin_of_values(values: ArrayLike) -> FloatArray:
    """Distance of poses from a singular one, from 0 (singular) to 1 (all moments are made with the same ease).

    The root of the harmonic over the arithmetic mean of σ², the squared singular values of the moments M about O per
    unit of effort: 1 over the product of the root mean squares of the effort for a unit moment and of the moment for a
    unit effort. It is dimensionless, lies between the least over the greatest σ and three times that, and does not
    change with the unit of effort or with a ratio of all gears.

    Parameters
    ----------
    values : array_like
        Singular values, shape (..., r), of efforts of one unit; where some are in N and others in N m, with the moments
        of the former over their mean lever (:attr:`exo_pin.device.device_structure.Structure.scales`).
    """
    squares = np.asarray(values, dtype=float) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        margin = squares.shape[-1] / np.sqrt(squares.sum(axis=-1) * (1.0 / squares).sum(axis=-1))
    return np.asarray(np.where(squares.min(axis=-1) > 0.0, margin, 0.0))


@kernel(inline=True)
def status_code(spoiled: bool, margin: float) -> int:
    """Status of a pose by its margin; ``spoiled``: whether it has no answer because of a folded limb."""
    code = OK if margin >= NEAR_MARGIN else NEAR_SINGULAR
    code = code if margin >= SINGULAR_MARGIN else SINGULAR
    return FOLDED if spoiled else code


@kernel(inline=True)
def weight_load(R: Any, mass: float, centre: Any, gravity: Any) -> Any:
    """C = R c, and force m g and moment C × m g of the weight about O.

    Source: thesis (D-3), (D-23), (D-24).
    """
    C = turn(R, centre)
    W = (mass * gravity[0], mass * gravity[1], mass * gravity[2])
    return C, W, cross(C, W)


@kernel(inline=True)
def inertia_load(R: Any, mass: float, C: Any, inertia: Any, w: Any, e: Any) -> Any:
    """Force -m a_C and moment -(I η + ω × I ω) about O, with a_C = η × C + ω × (ω × C).

    (D-1), (D-2) and (D-8), with the sign of the latter's first term put right; I is about O, in the arm's axes.

    Source: thesis (D-1), (D-2), (D-5), (D-8).
    """
    e_C, w_w_C = cross(e, C), cross(w, cross(w, C))
    Iw, Ie = turn(R, turn(inertia, turn_back(R, w))), turn(R, turn(inertia, turn_back(R, e)))
    gyroscopic = cross(w, Iw)
    return (
        (-mass * (e_C[0] + w_w_C[0]), -mass * (e_C[1] + w_w_C[1]), -mass * (e_C[2] + w_w_C[2])),
        (-Ie[0] - gyroscopic[0], -Ie[1] - gyroscopic[1], -Ie[2] - gyroscopic[2]),
    )


@kernel(inline=True)
def applied_load(R: Any, force: Any, couple: Any, at: Any, in_arm: bool) -> Any:
    """Force and moment about O, base frame, of a load that acts at ``at`` (arm's axes).

    ``in_arm``: whether force and couple are given in the arm's axes.
    """
    if in_arm:
        force, couple = turn(R, force), turn(R, couple)
    lever = cross(turn(R, at), force)
    return force, (couple[0] + lever[0], couple[1] + lever[1], couple[2] + lever[2])


@kernel(inline=True)
def along_normals(V: Any, X1: Any, X2: Any, X3: Any) -> Any:
    """y with Σ y_i X_i = -V, for three limbs.

    (D-22) and (D-25) at once: since b_i × s_i = -h_i X_i, the tensions that make the moment M are f_i = y_i(M) / h_i;
    and the side forces that take F_s away are g = y(F_s).

    Source: thesis (D-22), (D-25).
    """
    determinant = triple(X1, X2, X3)
    return (-triple(V, X2, X3) / determinant, -triple(V, X3, X1) / determinant, -triple(V, X1, X2) / determinant)
