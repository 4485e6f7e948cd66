"""Conversion between orientation angles and rotations.

Frames: {O_A} is fixed to the torso with its origin at the shoulder centre O, x forward, y to the left, z up,
on both sides of the body. {O_B} turns with the arm, which hangs along -z. An orientation is the active rotation
that takes coordinates in {O_B} to coordinates in {O_A}.

Three conventions occur in the source and must not be mixed:

* (4-7) of the thesis, intrinsic X-Y-Z: :func:`thesis_rotation`;
* the shoulder angles of Table 2-1, Appendix C and the daily-life tasks, intrinsic Y-X-Z (flexion, abduction,
  axial rotation): :func:`shoulder_rotation`, with clinical signs;
* plane of elevation, elevation and axial rotation of the ISB, as in Figure 5-15: :func:`isb_rotation`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .errors import InvalidInput
from .errors.checked import checked
from .validation import FloatArray, as_choice, as_rotation, broadcast, frozen

Side = Literal["left", "right"]

#: Names of the clinical angles as columns and keys, in their order.
CLINICAL_ANGLES = ("flexion_deg", "abduction_deg", "internal_rotation_deg")

#: Sine of an elevation at which the plane of elevation has no meaning.
_LOCKED = 1e-9
#: Standard gravity of the thesis, m/s², base frame.
GRAVITY: FloatArray = frozen(np.array([0.0, 0.0, -9.81]))

#: Mirror in the x-z (sagittal) plane that turns a left shoulder into a right one.
MIRROR: FloatArray = frozen(np.diag([1.0, -1.0, 1.0]))
#: The same mirror for a force and a moment; moments are pseudovectors.
WRENCH_MIRROR: FloatArray = frozen(np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0]))


def as_side(side: str) -> Side:
    """Return ``side`` if it is "left" or "right", else raise UnknownName."""
    return "left" if as_choice("side", side, ("left", "right")) == "left" else "right"


def other_side(side: str) -> Side:
    """The other side of the body."""
    return "right" if as_side(side) == "left" else "left"


def refuse_other_side(changes: Mapping[str, Any], own: str) -> None:
    """Raise InvalidInput if changes of a record name the other side, which would give it a label and mirror nothing."""
    if "side" in changes and as_side(changes["side"]) != own:
        raise InvalidInput(
            f"this device is for the {own} shoulder, and another side alone would mirror nothing: use mirrored(), or "
            f'load it with side="{other_side(own)}"'
        )


def _stacked(degrees: bool, **angles: ArrayLike) -> FloatArray:
    """Three angles as one array, shape (..., 3), rad."""
    stacked = np.stack(broadcast(**angles), axis=-1)
    return np.radians(stacked) if degrees else stacked


def _outward(side: str) -> float:
    """Sign of y out of the body."""
    return 1.0 if as_side(side) == "left" else -1.0


@checked
def thesis_rotation(theta_x: ArrayLike, theta_y: ArrayLike, theta_z: ArrayLike, degrees: bool = False) -> Rotation:
    """Orientation from the thesis's angles, (4-7): Rx(θx) Ry(θy) Rz(θz), intrinsic X-Y-Z.

    Parameters
    ----------
    theta_x, theta_y, theta_z : array_like
        Angles in rad (degrees with ``degrees=True``); they broadcast to a stack of shape (...).
    degrees : bool
        Whether the angles are in degrees.

    Returns
    -------
    scipy.spatial.transform.Rotation
        Takes {O_B} to {O_A}; single, or a stack of shape (...).

    Raises
    ------
    InvalidInput
        If an angle is not finite or the shapes do not broadcast.

    Notes
    -----
    Source: thesis (4-3), (4-4), (4-5), (4-6), (4-7).

    Examples
    --------
    >>> round(float(np.degrees(ep.thesis_rotation(0, 45, 45, degrees=True).magnitude())), 2)  # degrees about one axis
    62.8
    """
    angles = _stacked(degrees, theta_x=theta_x, theta_y=theta_y, theta_z=theta_z)
    return Rotation.from_euler("XYZ", angles)


@checked
def shoulder_rotation(
    flexion: ArrayLike, abduction: ArrayLike, internal_rotation: ArrayLike, side: str = "left", degrees: bool = False
) -> Rotation:
    """Orientation from clinical shoulder angles, all positive as named, intrinsic Y-X-Z.

    Left shoulder: Ry(-flexion) Rx(abduction) Rz(-internal). The right shoulder is the mirror image in the x-z
    plane, which negates abduction and axial rotation. The first and last angle are not separate at ±90° of
    abduction: use the Rotation, not the angles, as the state of a computation.

    Parameters
    ----------
    flexion : array_like
        Arm forward, rad (degrees with ``degrees=True``).
    abduction : array_like
        Arm away from the body.
    internal_rotation : array_like
        Arm turned inward about its own axis.
    side : {"left", "right"}
        Side of the body.
    degrees : bool
        Whether the angles are in degrees.

    Returns
    -------
    scipy.spatial.transform.Rotation
        Takes {O_B} to {O_A}; single, or a stack of shape (...).

    Raises
    ------
    InvalidInput
        If an angle is not finite or the shapes do not broadcast.
    UnknownName
        If ``side`` is neither "left" nor "right".

    Notes
    -----
    Source: thesis Table 2-1.

    Examples
    --------
    >>> ep.shoulder_rotation(90, 0, 0, degrees=True).apply([0, 0, -1]).round(9) + 0.0  # the arm points forward
    array([1., 0., 0.])
    """
    angles = _stacked(degrees, flexion=flexion, abduction=abduction, internal_rotation=internal_rotation)
    sign = _outward(side)
    return Rotation.from_euler("YXZ", angles * np.array([-1.0, sign, -sign]))


def _euler(poses: Rotation, order: str) -> FloatArray:
    # At the lock SciPy warns and sets the third angle to zero; that choice is documented, so no warning travels.
    return np.asarray(as_rotation("poses", poses).as_euler(order, suppress_warnings=True))


@checked
def thesis_angles(poses: Rotation, degrees: bool = False) -> FloatArray:
    """Angles (θx, θy, θz) of (4-7) of an orientation.

    Parameters
    ----------
    poses : Rotation
        Single or a stack of shape (...).
    degrees : bool
        Whether to return degrees.

    Returns
    -------
    ndarray
        Shape (..., 3), rad or degrees, θy within ±90°. At θy = ±90° only θx ± θz has a meaning and θz is 0.

    Notes
    -----
    Source: thesis (4-22).

    Examples
    --------
    >>> pose = ep.load("prototype").pose(abduction=30)  # about x
    >>> ep.thesis_angles(pose, degrees=True).round(6) + 0.0
    array([30.,  0.,  0.])
    """
    angles = _euler(poses, "XYZ")
    return np.degrees(angles) if degrees else angles


@checked
def shoulder_angles(poses: Rotation, side: str = "left", degrees: bool = False) -> FloatArray:
    """Clinical angles (flexion, abduction, internal rotation) of an orientation.

    Parameters
    ----------
    poses : Rotation
        Single or a stack of shape (...).
    side : {"left", "right"}
        Side of the body.
    degrees : bool
        Whether to return degrees.

    Returns
    -------
    ndarray
        Shape (..., 3), rad or degrees, abduction within ±90°. At ±90° of abduction the internal rotation is 0.

    Examples
    --------
    >>> pose = ep.shoulder_rotation(40, 25, 10, degrees=True)
    >>> ep.shoulder_angles(pose, degrees=True).round(6)
    array([40., 25., 10.])
    """
    sign = _outward(side)
    angles = _euler(poses, "YXZ") * np.array([-1.0, sign, -sign]) + 0.0  # no -0.0
    return np.degrees(angles) if degrees else angles


@checked
def pose_columns(poses: Rotation, side: str, shape: tuple[int, ...] | None = None) -> dict[str, FloatArray]:
    """Clinical angles in degrees as columns of a table, each of the stack's shape or the ``shape`` it is part of."""
    angles = shoulder_angles(poses, side, degrees=True)
    return {
        name: angles[..., k] if shape is None else np.broadcast_to(angles[..., k], shape)
        for k, name in enumerate(CLINICAL_ANGLES)
    }


def isb_rotation(
    plane: ArrayLike, elevation: ArrayLike, axial_rotation: ArrayLike, side: str = "left", degrees: bool = False
) -> Rotation:
    """Orientation from the ISB's shoulder angles: plane of elevation, elevation and axial rotation, Y-X-Y.

    In the axes of {O_A} and {O_B} a right arm is Rz(plane) Rx(-elevation) Rz(axial), a left arm its mirror image. Van
    Andel et al. (2008), whose tasks Section 5.4.2 uses, state their movements in these angles.

    Parameters
    ----------
    plane : array_like
        Plane of elevation, rad (degrees with ``degrees=True``): 0 is abduction, 90° is flexion.
    elevation : array_like
        Angle of the arm from hanging, positive on both sides.
    axial_rotation : array_like
        Rotation of the arm about its own axis, inward positive.
    side : {"left", "right"}
        Side of the body.
    degrees : bool
        Whether the angles are in degrees.

    Returns
    -------
    scipy.spatial.transform.Rotation
        Takes {O_B} to {O_A}; single, or a stack of shape (...).

    Notes
    -----
    After Wu et al. (2005), J. Biomech. 38, 981-992.

    Source: thesis Figure 5-15.

    Examples
    --------
    >>> pose = ep.isb_rotation(90, 60, -90, degrees=True)  # 60° of flexion
    >>> ep.shoulder_angles(pose, degrees=True).round(6) + 0.0
    array([60.,  0.,  0.])
    """
    sign = _outward(side)
    angles = _stacked(degrees, plane=plane, elevation=elevation, axial_rotation=axial_rotation)
    return Rotation.from_euler("ZXZ", angles * np.array([-sign, sign, -sign]))


@checked
def isb_angles(poses: Rotation, side: str = "left", degrees: bool = False) -> FloatArray:
    """The ISB's shoulder angles (plane of elevation, elevation, axial rotation) of an orientation.

    Near an elevation of 0 and of 180° plane and axial rotation are not separate: there a small turn of the arm changes
    both by much. At these elevations themselves the plane is 0 and the axial rotation holds the sum (the difference).

    Parameters
    ----------
    poses : Rotation
        Single or a stack of shape (...).
    side : {"left", "right"}
        Side of the body.
    degrees : bool
        Whether to return degrees.

    Returns
    -------
    ndarray
        Shape (..., 3), rad or degrees, elevation from 0 to 180°, the others within ±180°.

    Notes
    -----
    After Wu et al. (2005), J. Biomech. 38, 981-992.

    Source: thesis Figure 5-15.

    Examples
    --------
    >>> pose = ep.shoulder_rotation(60, 0, 0, degrees=True)
    >>> ep.isb_angles(pose, degrees=True).round(6) + 0.0
    array([ 90.,  60., -90.])
    """
    # A left arm is Rz(-plane) Rx(elevation) Rz(-axial).
    of_left = poses if _outward(side) > 0.0 else mirrored(poses)
    plane, elevation, axial = np.moveaxis(_euler(of_left, "ZXZ") * np.array([-1.0, 1.0, -1.0]), -1, 0)
    locked = np.abs(np.sin(elevation)) < _LOCKED
    whole = np.where(np.cos(elevation) > 0.0, axial + plane, axial - plane)
    plane, axial = np.where(locked, 0.0, plane), np.where(locked, whole, axial)
    turned = [np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi for angle in (plane, axial)]
    angles = np.stack([turned[0], elevation, turned[1]], axis=-1)
    return np.degrees(angles) if degrees else angles


def mirrored(poses: Rotation) -> Rotation:
    """Mirror image of an orientation in the x-z plane, S R S with S = diag(1, -1, 1).

    A rotation vector is a pseudovector, so its x and z components change sign and its y component stays.
    """
    quaternion = as_rotation("poses", poses).as_quat()
    return Rotation.from_quat(quaternion * np.array([-1.0, 1.0, -1.0, 1.0]))


def along_arm(vectors: FloatArray, matrices: FloatArray) -> FloatArray:
    """Part along the arm, positive towards the hand, of vectors (..., 3) in the base frame, in poses (..., 3, 3)."""
    return np.asarray(-(matrices[..., :, 2] * vectors).sum(axis=-1))
