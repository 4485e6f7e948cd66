"""The singular surface over the shoulder's range of motion: meshes and slices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.conventions import shoulder_rotation
from ...core.errors import InvalidInput, MissingExtra
from ...core.errors.checked import checked
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ...load_case.ranges_of_motion import ADL_BOX, RangeOfMotion, grid_rotation
from ...numerics.vectors import cross, dot, matrix, triple, turn, vector
from .measures import require_three_limbs

#: Step of central differences in degrees: truncation and rounding errors are about equal.
_STEP = float(np.degrees(np.finfo(float).eps ** (1 / 3)))


@kernel(stack=True)
def _locus_stack(R: Any, base: Any, platform: Any, smooth: Any, determinant: Any) -> None:
    """Fill -det[a_i × b_i] over Π |a_i||b_i|, and det[X_1 X_2 X_3] (NaN for a folded limb)."""
    normal, scale = np.empty((3, 3)), 1.0
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


def _measure() -> Any:
    try:
        from skimage import measure
    except ImportError as error:
        raise MissingExtra("plot", "scikit-image") from error
    return measure


@dataclass(frozen=True, eq=False)
class SingularSurface:
    """The singular surface inside a box of shoulder angles, as triangles.

    Attributes
    ----------
    vertices : ndarray
        Shape (V, 3): flexion, abduction, internal rotation, degrees. Empty where the surface does not enter the box.
    faces : ndarray of int
        Shape (F, 3), corners of the triangles.
    box : RangeOfMotion
        The box.
    side : str
        Side of the body.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("prototype")
    >>> surface = wrist.singular_surface(exo.geometry, step_deg=20.0)
    >>> pose = exo.pose(*surface.vertices[0])
    >>> abs(round(float(exo.singularity(pose).determinant), 6)), surface.faces.shape[1]
    (0.0, 3)
    """

    vertices: FloatArray
    faces: NDArray[np.int64]
    box: RangeOfMotion
    side: str

    @property
    def rotations(self) -> Rotation:
        """The vertices as orientations, a stack of V."""
        return _pose(self.vertices, self.side)


def _pose(angles: FloatArray, side: str) -> Rotation:
    """Orientations of rows of (flexion, abduction, internal rotation), degrees."""
    return shoulder_rotation(angles[:, 0], angles[:, 1], angles[:, 2], side, degrees=True)


@checked
def singular_surface(
    geometry: WristGeometry, box: RangeOfMotion = ADL_BOX, step_deg: float = 2.0, side: str = "left"
) -> SingularSurface:
    """Mesh the singular surface inside a box of shoulder angles.

    Marching cubes on a grid (scikit-image), then every vertex is moved onto the surface by Newton's method, so that the
    step of the grid limits the resolution and not the accuracy.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    box : RangeOfMotion
        Range of the angles.
    step_deg : float
        Of the grid, degrees; sheets closer together than this may be missed.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    SingularSurface

    Raises
    ------
    MissingExtra
        If scikit-image is not installed.
    InvalidInput
        For other than three limbs, or a box without volume.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> geometry = ep.load("optimised-table-c-2").geometry
    >>> surface = wrist.singular_surface(geometry, step_deg=20.0)
    >>> smooth = wrist.locus_function(geometry, ep.shoulder_rotation(*surface.vertices.T, degrees=True))[0]
    >>> len(smooth) > 0, round(float(np.abs(smooth).max()), 9)  # all corners on it
    (True, 0.0)
    """
    measure = _measure()
    axes = box_axes(box, step_deg)
    values, _ = locus_function(geometry, grid_rotation(*axes, side=side))
    if not values.min() < 0.0 < values.max():
        return SingularSurface(np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), box, side)
    origin = np.array([axis[0] for axis in axes])
    spacing = np.array([axis[1] - axis[0] for axis in axes])
    vertices, faces, _, _ = measure.marching_cubes(values, 0.0, spacing=tuple(spacing))
    points = _onto_surface(geometry, vertices.astype(float) + origin, box, side, float(spacing.max()))
    return SingularSurface(points, faces.astype(np.int64), box, side)


def box_axes(box: RangeOfMotion, step_deg: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The axes of the grid of a box that has a volume."""
    axes = box.axes(step_deg)
    if min(len(axis) for axis in axes) < 2:
        raise InvalidInput(f"expected a box with three extents, got {box.intervals}")
    return axes


def _onto_surface(
    geometry: WristGeometry, points: FloatArray, box: RangeOfMotion, side: str, reach: float
) -> FloatArray:
    """Newton's steps along the gradient, not beyond ``reach`` and not out of the box's faces."""
    low, high = np.array(box.intervals).T
    start = points.copy()

    def value(at: FloatArray) -> FloatArray:
        return locus_function(geometry, _pose(at, side))[0]

    on_face = (np.abs(start - low) < 1e-6) | (np.abs(start - high) < 1e-6)
    for _ in range(6):
        gradient = np.stack(
            [(value(points + _STEP * e) - value(points - _STEP * e)) / (2 * _STEP) for e in np.eye(3)], axis=-1
        )
        gradient[on_face] = 0.0
        steepness = (gradient**2).sum(axis=-1, keepdims=True)
        move = np.divide(-value(points)[:, None] * gradient, steepness, out=np.zeros_like(points), where=steepness > 0)
        following = np.clip(points + move, low, high)
        near = np.linalg.norm(following - start, axis=-1, keepdims=True) <= reach
        points = np.where(near, following, points)
    return points


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
        If scikit-image is not installed.
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
    flexion, abduction, _ = box.axes(step_deg)
    poses = shoulder_rotation(flexion[:, None], abduction[None, :], internal_rotation_deg, side, degrees=True)
    smooth, determinant = locus_function(geometry, poses)
    curves = []
    for line in _measure().find_contours(smooth, 0.0):
        columns = [np.interp(line[:, k], np.arange(len(axis)), axis) for k, axis in enumerate((flexion, abduction))]
        curves.append(np.stack(columns, axis=-1))
    return LocusSlice(flexion, abduction, f"internal rotation {internal_rotation_deg:g}°", determinant, curves)
