"""Singular poses of the wrist: det[X_1 X_2 X_3] = 0, and limbs that point at O.

Singular poses over the shoulder's range of motion: det X, and curves where it is zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.conventions import shoulder_rotation
from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.optional_packages import optional
from ...core.results import Result
from ...core.validation import FloatArray, as_finite
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ...load_case.ranges_of_motion import ADL_BOX, RangeOfMotion
from ...numerics.vectors import (
    FOLDED_SINE,
    NEAR_MARGIN,
    SINGULAR_MARGIN,
    cross,
    dot,
    margin_of_values,
    matrix,
    triple,
    turn,
    vector,
)
from ..kinematics.inverse import inverse_kinematics


@dataclass(frozen=True, eq=False)
class Singularity(Result):
    """Distance of a pose, or each of a stack of shape (...), from singularity.

    Attributes
    ----------
    determinant : ndarray
        det[X_1 X_2 X_3], shape (...), dimensionless; NaN for other than three limbs and for a folded limb. Its
        sign differs on the two sides of the singular surface.
    actuation_determinant : ndarray
        det[b_i × s_i] = -h_1 h_2 h_3 det[X_1 X_2 X_3], shape (...), m³; NaN for other than three limbs. It is zero for
        a folded limb too.
    reach : ndarray
        h_i, distance from O to the limb's line, shape (..., n), m.
    smallest_singular_value : ndarray
        Of the matrix of rows b_i × s_i, shape (...), m: moment per limb force in the worst direction.
    margin : ndarray
        Shape (...), 0 in a singular pose to 1 where limbs make all moments with the same ease: the root of the harmonic
        over the arithmetic mean of the squared singular values of these rows, ``margin_of_values``.
    amplification : ndarray
        Its inverse, shape (...), 1/m: limb force (root of sum of squares) per moment in the worst direction.
    condition : ndarray
        Largest over smallest singular value of the rows b_i × s_i, shape (...); inf in a singular pose.
    constraint_condition : ndarray
        The same of the rows X_i of the UPU limbs, shape (...); inf where they do not hold O.
    centre_shift : ndarray
        Shape (...), dimensionless: largest displacement of O without the ball joint, per unit of play of every
        UPU limb to either side along X_i, :func:`centre_shift`.
    lost_direction : ndarray
        Shape (..., 3), unit vector, base frame: the axis about which the limbs resist least.
    kind : ndarray of str
        Shape (...): "regular", "near" (margin below 1e-3), "singular" (the limbs do not hold the lost
        direction, and without the ball joint O can move too), "folded" (a limb points at
        O; of more than three limbs, a UPU limb, for an SPS limb only loses its moment arm).
    actuation, constraint : ndarray of bool
        Shape (...): locked actuators do not hold the arm about O; the UPU limbs do not hold O by themselves. One
        implies the other for three UPU limbs. The plane of a folded limb is undefined, so that a folded
        limb does not count as holding O.
    folded : ndarray of bool
        Shape (..., n): limbs that point at O.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> found = exo.singularity(exo.pose(50, 10))
    >>> product = -found.reach.prod() * found.determinant  # -h_1 h_2 h_3 det X
    >>> round(float(product / found.actuation_determinant), 9)
    1.0
    """

    determinant: FloatArray
    actuation_determinant: FloatArray
    reach: FloatArray
    smallest_singular_value: FloatArray
    margin: FloatArray
    amplification: FloatArray
    condition: FloatArray
    constraint_condition: FloatArray
    centre_shift: FloatArray
    lost_direction: FloatArray
    kind: NDArray[np.str_]
    actuation: NDArray[np.bool_]
    constraint: NDArray[np.bool_]
    folded: NDArray[np.bool_]


@checked
def singularity(geometry: WristGeometry, poses: Rotation, is_upu: ArrayLike | None = None) -> Singularity:
    """Analyse poses for singularity.

    With b_i × s_i = -h_i X_i the actuation singularity (locked limbs do not hold the arm) and the constraint
    singularity (without the ball joint O can move) of a 3UPU wrist are one locus, det X = 0, next to the folded
    case h_i = 0.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    poses : Rotation
        Pose, single or a stack of shape (...).
    is_upu : array_like of bool, optional
        Shape (n,), which limbs have universal joints at both ends and so hold O along X_i; all if left out.

    Returns
    -------
    Singularity

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("scenario-one")
    >>> round(float(wrist.singularity(exo.geometry, exo.pose(30)).determinant), 3)  # of the plane normals X_i
    -0.598
    """
    state = inverse_kinematics(geometry, poses)
    radius = np.linalg.norm(geometry.platform_points, axis=1)
    rows = np.cross(state.platform_points, state.directions)
    _, values, directions = np.linalg.svd(rows)
    smallest = values[..., 2]
    margin = margin_of_values(values)
    folded = state.reach <= FOLDED_SINE * radius
    normals = np.where(np.isnan(state.normals), 0.0, state.normals)
    if geometry.limb_count == 3:
        determinant = np.where(folded.any(axis=-1), np.nan, np.linalg.det(normals))
        actuation_determinant = np.where(folded.any(axis=-1), 0.0, np.linalg.det(rows))
    else:
        determinant = np.full(smallest.shape, np.nan)
        actuation_determinant = determinant.copy()
    held = _as_upu(is_upu, geometry.limb_count)
    normals = normals[..., held, :]
    padded = np.concatenate([normals, np.zeros((*normals.shape[:-2], 3, 3))], axis=-2)
    constraint_values = np.linalg.svd(padded, compute_uv=False)
    # An SPS limb needs no plane: with more than three limbs one may be folded while the others hold the pose.
    needed = held if geometry.limb_count > 3 else np.ones_like(held)
    constraint = constraint_values[..., 2] < SINGULAR_MARGIN
    with np.errstate(divide="ignore", invalid="ignore"):
        amplification = 1.0 / smallest
        condition = np.where(smallest > 0.0, values[..., 0] / smallest, np.inf)
        constraint_condition = np.where(constraint, np.inf, constraint_values[..., 0] / constraint_values[..., 2])
    return Singularity(
        determinant,
        actuation_determinant,
        state.reach,
        smallest,
        margin,
        amplification,
        condition,
        constraint_condition,
        np.where(constraint, np.inf, centre_shift(normals)),
        directions[..., 2, :],
        kind_of(margin, (folded & needed).any(axis=-1)),
        margin < SINGULAR_MARGIN,
        constraint,
        folded,
    )


def kind_of(margin: FloatArray, folded: NDArray[np.bool_]) -> NDArray[np.str_]:
    """Kinds of poses: "regular", "near", "singular" or "folded"."""
    cases = [folded, margin < SINGULAR_MARGIN, margin < NEAR_MARGIN]
    return np.select(cases, ["folded", "singular", "near"], "regular")


def require_three_limbs(geometry: WristGeometry) -> None:
    """Raise InvalidInput for other than three limbs: of more the singular poses are curves or single poses."""
    if geometry.limb_count != 3:
        raise InvalidInput(f"expected three limbs, whose singular poses form a surface, got {geometry.limb_count}")


@checked
def centre_shift(normals: ArrayLike) -> FloatArray:
    """Largest displacement of O if each limb may shift by a unit along its X_i.

    Without the ball joint a translation δ of O shifts limb i by X_i·δ along its normal. The side force passes through
    O, so that nothing else shifts it, whatever the actuators hold. With play c on either side every δ with |X_i·δ| <= c
    for all i is possible. The farthest point of that polytope is one of its corners, where three limbs are at the end
    of their play.

    Parameters
    ----------
    normals : array_like
        X_i, shape (..., n, 3); a row of zeros is a limb that holds nothing.

    Returns
    -------
    ndarray
        Shape (...), m per m of play; inf where no three limbs hold O.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> round(float(wrist.centre_shift(np.eye(3))), 6)  # planes at right angles: √3
    1.732051
    """
    rows = as_finite("normals", normals, (None, 3), stack=True)
    farthest = np.full(rows.shape[:-2], np.inf)
    for i, j, k in combinations(range(rows.shape[-2]), 3):
        corner_rows = rows[..., (i, j, k), :]
        determinant = np.linalg.det(corner_rows)
        regular = np.abs(determinant) > SINGULAR_MARGIN**2
        inverse = np.linalg.inv(np.where(regular[..., None, None], corner_rows, np.eye(3)))
        for signs in product((1.0, -1.0), repeat=2):
            corner = inverse @ np.array([1.0, *signs])
            # Rounding of a corner where more than three limbs are at the end of their play.
            slack = 1.0 + 1e-9
            inside = regular & (np.abs(np.einsum("...ij,...j->...i", rows, corner)) <= slack).all(axis=-1)
            size = np.linalg.norm(corner, axis=-1)
            farthest = np.where(inside, np.where(np.isinf(farthest), size, np.maximum(farthest, size)), farthest)
    return np.asarray(farthest)


def _as_upu(is_upu: ArrayLike | None, count: int) -> NDArray[np.bool_]:
    if is_upu is None:
        return np.ones(count, dtype=bool)
    held = np.asarray(is_upu)
    if held.shape != (count,) or held.dtype != bool:
        raise InvalidInput(f"expected is_upu to be {count} booleans, got {echo(is_upu)}")
    return held


@kernel(stack=True)
def _locus_stack(R: Any, base: Any, platform: Any, smooth: Any, determinant: Any) -> None:
    """Fill -det[a_i × b_i] over Π |a_i||b_i|, and det[X_1 X_2 X_3] (NaN for a folded limb)."""
    normal, scale = np.empty_like(base), 1.0
    for i in range(3):
        a, p = vector(base, i), vector(platform, i)
        scale *= np.sqrt(dot(a, a) * dot(p, p))
    for k in range(R.shape[0]):
        area = 1.0
        for i in range(3):
            across = cross(vector(base, i), turn(matrix(R[k]), vector(platform, i)))
            normal[i, 0], normal[i, 1], normal[i, 2] = across
            area *= np.sqrt(dot(across, across))
        volume = -triple(normal[0], normal[1], normal[2])
        smooth[k] = volume / scale
        determinant[k] = volume / area if area > 0.0 else np.nan


def locus_function(geometry: WristGeometry, poses: Rotation) -> tuple[FloatArray, FloatArray]:
    """A smooth function that vanishes in every singular pose, and det X.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    poses : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    smooth : ndarray
        -det[a_i × b_i] / Π |a_i||b_i| = det X Π sin∠(a_i, b_i), shape (...): the sign of det X, zero for a folded limb
        too, without the corners that det X has there.
    determinant : ndarray
        det[X_1 X_2 X_3], shape (...); NaN for a folded limb.

    Raises
    ------
    InvalidInput
        For other than three limbs: of more the singular poses are curves or single poses.
    """
    require_three_limbs(geometry)
    shape, matrices = pose_matrices(poses)
    smooth, determinant = np.empty(len(matrices)), np.empty(len(matrices))
    _locus_stack(matrices, geometry.base_points, geometry.platform_points, smooth, determinant)
    return smooth.reshape(shape), determinant.reshape(shape)


def shoulder_slice(
    geometry: WristGeometry,
    internal_rotation_deg: float = 0.0,
    box: RangeOfMotion = ADL_BOX,
    step_deg: float = 0.5,
    side: str = "left",
) -> tuple[FloatArray, FloatArray, FloatArray, list[FloatArray]]:
    """det X over flexion and abduction at a fixed internal rotation.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    internal_rotation_deg : float
        Held fixed, degrees.
    box : RangeOfMotion
        Its flexion and abduction are covered.
    step_deg : float
        Of the grid, degrees.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    flexion, abduction : ndarray
        Shapes (p,) and (q,), degrees.
    determinant : ndarray
        det X, shape (p, q).
    curves : list of ndarray
        Where it is zero: curves of shape (k, 2), (flexion, abduction) in degrees.

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    InvalidInput
        For other than three limbs.
    """
    flexion, abduction, _ = box.axes(step_deg)
    poses = shoulder_rotation(flexion[:, None], abduction[None, :], internal_rotation_deg, side, degrees=True)
    smooth, determinant = locus_function(geometry, poses)
    contours = optional("plot", "contourpy")  # part of matplotlib
    lines = contours.contour_generator(abduction, flexion, smooth).lines(0.0)
    return flexion, abduction, determinant, [np.asarray(line)[:, ::-1] for line in lines]
