"""Tensions within limits that come nearest to a moment, and of several those of least shoulder force.

For controllers, whose wanted moments the limbs often cannot give. Two programs follow each other, exact and compiled:

1. minimise |Jᵀ f - m| over f_min <= f <= f_max. The moment that is left is unique.
2. of all f with that moment, if there are several, minimise |F_s|, F_s = Σ f_i s_i - F. Limbs carry no side force.
"""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray
from ...numerics.bounded.box_program import least_forces
from ...numerics.bounded.polytope_program import least_sum_force

#: Singular value of Jᵀ, relative to the largest, below which a direction of f counts as moving nothing.
_RANK = 1e-9
#: The second program's limit of unknowns.
_MOST_SUMS = 3


def nearest_tensions(
    arms: FloatArray, moment: FloatArray, pulls: FloatArray, force: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """f of one pose, shape (n,), N.

    Parameters
    ----------
    arms : ndarray
        Jᵀ, shape (3, n), m: ``arms @ f`` is the moment that tensions take up.
    moment : ndarray
        m, shape (3,), N m.
    pulls : ndarray
        s_i as columns, shape (3, n).
    force : ndarray
        F, shape (3,), N: what weight and motion of the arm put on shoulder and limbs together.
    lower, upper : ndarray
        Limits of f, shape (n,), N; they may be infinite.
    """
    f = least_forces(-moment[None], arms[None], lower[None], upper[None]).variables[0]
    axes = np.ascontiguousarray(_unmoving(arms))
    if 0 < axes.shape[1] <= _MOST_SUMS:
        pull, sums = np.ascontiguousarray(pulls), np.empty(axes.shape[1])
        if least_sum_force(pull @ f - force, pull @ axes, f, axes, lower, upper, sums):
            f = np.clip(f + axes @ sums, lower, upper)
    return f


def missing_moments(moments: FloatArray, arms: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Least |Jᵀ f - m| within the limits in N poses, shape (N,), N m.

    ``moments`` has the shape (N, 3), ``arms`` (N, 3, n), the limits (N, n).
    """
    return np.asarray(np.linalg.norm(least_forces(-moments, arms, lower, upper).forces, axis=-1))


def _unmoving(arms: FloatArray) -> FloatArray:
    """Orthonormal sums of tensions without moment, shape (n, k)."""
    _, values, axes = np.linalg.svd(arms)
    rank = int((values > _RANK * values[0]).sum())
    return np.asarray(axes[rank:].T)
