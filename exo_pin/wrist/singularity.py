"""Where the wrist loses its hold: det[X_1 X_2 X_3] = 0, and limbs that point at O."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..design import WristGeometry
from ..validation import FloatArray
from .inverse import inverse_kinematics
from .kernels import FOLDED_SINE, NEAR_MARGIN, SINGULAR_MARGIN

__all__ = ["Singularity", "singularity"]


@dataclass(frozen=True, eq=False)
class Singularity:
    """How far a pose, or each of a stack of shape (...), is from losing control.

    Attributes
    ----------
    determinant : ndarray
        det[X_1 X_2 X_3], shape (...), dimensionless; NaN for other than three limbs and for a folded limb. Its
        sign tells the two sides of the singular surface apart.
    smallest_singular_value : ndarray
        Of the matrix of rows b_i × s_i, shape (...), m: N m of moment per N of limb force in the worst direction.
    amplification : ndarray
        Its inverse, shape (...), 1/m: limb force (root of sum of squares) per N m in the worst direction.
    lost_direction : ndarray
        Shape (..., 3), unit vector, base frame: the axis about which the limbs hold worst.
    kind : ndarray of str
        Shape (...): "regular", "near" (margin below 1e-3), "singular" (the limbs do not hold the lost
        direction, and without the ball joint the constraints give way too), "folded" (a limb points at O).
    """

    determinant: FloatArray
    smallest_singular_value: FloatArray
    amplification: FloatArray
    lost_direction: FloatArray
    kind: NDArray[np.str_]


def singularity(geometry: WristGeometry, orientation: Rotation) -> Singularity:
    """Analyse poses for singularity.

    With b_i × s_i = -h_i X_i the actuation singularity (locked limbs do not hold the arm) and the constraint
    singularity (without the ball joint O can move) of a 3UPU wrist are one locus, det X = 0, next to the folded
    case h_i = 0.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    Singularity
    """
    state = inverse_kinematics(geometry, orientation)
    radius = np.linalg.norm(geometry.platform_points, axis=-1)
    rows = np.cross(state.platform_points, state.directions)
    _, values, directions = np.linalg.svd(rows, full_matrices=False)
    smallest = values[..., 2]
    margin = smallest / radius.max()
    if geometry.limb_count == 3:
        determinant = np.linalg.det(np.nan_to_num(state.normals))
        determinant = np.where(np.isnan(state.normals).any(axis=(-1, -2)), np.nan, determinant)
    else:
        determinant = np.full(smallest.shape, np.nan)
    kind = np.full(smallest.shape, "regular", dtype="<U8")
    kind[margin < NEAR_MARGIN] = "near"
    kind[margin < SINGULAR_MARGIN] = "singular"
    kind[(state.reach <= FOLDED_SINE * radius).any(axis=-1)] = "folded"
    with np.errstate(divide="ignore"):
        amplification = 1.0 / smallest
    return Singularity(determinant, smallest, amplification, directions[..., 2, :], kind)
