"""Singular poses over the shoulder's range of motion: det X, and curves where it is zero."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.conventions import shoulder_rotation
from ...core.errors import MissingExtra
from ...core.errors.checked import checked
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ...load_case.ranges_of_motion import ADL_BOX, RangeOfMotion
from ...numerics.vectors import cross, dot, matrix, triple, turn, vector
from .measures import require_three_limbs


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


@checked
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

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("prototype")
    >>> smooth, determinant = wrist.locus_function(exo.geometry, exo.pose(flexion=[30, 60]))  # crossed at 35.45°
    >>> np.sign(smooth).tolist(), determinant.round(4).tolist()
    ([-1.0, 1.0], [-0.0085, 0.06])
    """
    require_three_limbs(geometry)
    shape, matrices = pose_matrices(poses)
    smooth, determinant = np.empty(len(matrices)), np.empty(len(matrices))
    _locus_stack(matrices, geometry.base_points, geometry.platform_points, smooth, determinant)
    return smooth.reshape(shape), determinant.reshape(shape)


@dataclass(frozen=True, eq=False)
class LocusSlice:
    """det X over flexion and abduction.

    Attributes
    ----------
    x, y : ndarray
        Shapes (p,) and (q,), flexion and abduction, degrees.
    fixed : str
        Name and value of the fixed angle.
    determinant : ndarray
        det X, shape (p, q).
    curves : list of ndarray
        Where it is zero: curves of shape (k, 2), (x, y) in degrees.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> found = wrist.shoulder_slice(ep.load("prototype").geometry, step_deg=2.0)
    >>> round(float(found.determinant[0, found.y.tolist().index(0.0)]), 4)  # at rest
    -0.0143
    """

    x: FloatArray
    y: FloatArray
    fixed: str
    determinant: FloatArray
    curves: list[FloatArray] = field(default_factory=list)


@checked
def shoulder_slice(
    geometry: WristGeometry,
    internal_rotation_deg: float = 0.0,
    box: RangeOfMotion = ADL_BOX,
    step_deg: float = 0.5,
    side: str = "left",
) -> LocusSlice:
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
    LocusSlice

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    InvalidInput
        For other than three limbs.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> found = wrist.shoulder_slice(ep.load("prototype").geometry, step_deg=1.0)
    >>> crossing = min(np.concatenate(found.curves), key=lambda point: abs(point[0]) + 1e-3 * abs(point[1]))
    >>> round(float(crossing[1]), 1)  # degrees of abduction without flexion: 6.21 exactly
    6.2
    """
    try:
        from contourpy import contour_generator  # part of matplotlib
    except ImportError as error:
        raise MissingExtra("plot", "matplotlib") from error
    flexion, abduction, _ = box.axes(step_deg)
    poses = shoulder_rotation(flexion[:, None], abduction[None, :], internal_rotation_deg, side, degrees=True)
    smooth, determinant = locus_function(geometry, poses)
    lines = contour_generator(abduction, flexion, smooth).lines(0.0)
    curves = [np.asarray(line)[:, ::-1] for line in lines]
    return LocusSlice(flexion, abduction, f"internal rotation {internal_rotation_deg:g}°", determinant, curves)
