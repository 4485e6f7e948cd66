"""Orientation of the glenoid from the angles of the scapula against the trunk."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, MissingData
from ...core.validation import FloatArray, as_finite, as_rotation
from ...load_case.motion_and_load import as_elevations


def glenoid_orientation(
    internal_rotation: ArrayLike,
    upward_rotation: ArrayLike,
    tilt: ArrayLike,
    *,
    retroversion: ArrayLike,
    inclination: ArrayLike,
    degrees: bool = False,
) -> Rotation:
    """Orientation of a left glenoid, for :class:`exo_pin.GlenoidCone`; a right one is the mirror image.

    The scapula's angles are those of the International Society of Biomechanics (Wu et al. 2005), order Y-X-Z: about
    the vertical, the axis across the blade and the axis along its spine, here with the clinical signs, positive as
    named. Bone pins gave 39, 39, 37 degrees of internal rotation, 16, 34, 44 of upward rotation and -11, -3, 4 of tilt
    at 30, 90, 120 degrees of elevation in the scapular plane (Ludewig et al. 2009, J. Bone Joint Surg. Am. 91:378, as
    cited by others); a hanging arm has about 35, 0 and -10 (Struyf et al. 2011, doi 10.1111/j.1600-0838.2010.01274.x).
    19 donors had 5 degrees of retroversion and 8 of inclination (doi 10.1186/s12891-021-04660-4).

    Parameters
    ----------
    internal_rotation : array_like
        Turn of the blade that lets the socket face forward, rad, shape (...).
    upward_rotation : array_like
        Turn that lets the socket face upward, rad.
    tilt : array_like
        Posterior tilt, rad: the upper edge goes backward. Negative where the scapula leans forward, as at rest.
    retroversion : array_like
        Turn of the glenoid's opening backward against the scapula, rad.
    inclination : array_like
        Turn of its opening upward, rad.
    degrees : bool
        Whether the angles are in degrees.

    Returns
    -------
    Rotation
        Shape (...). Takes the glenoid's axes (x anterior, y out of the socket, z superior) to {O_A}:
        Rz(-internal) Rx(upward) Ry(-tilt) Rz(retroversion) Rx(inclination). With all angles zero it is the identity:
        a left socket that faces straight to the left.

    Raises
    ------
    InvalidInput
        If an angle is not finite or beyond ±90 degrees, or the shapes do not fit.

    Examples
    --------
    A socket that follows the arm from 30 to 120 degrees of elevation:

    >>> measured = [39, 39, 37], [16, 34, 44], [-11, -3, 4]
    >>> turns = ep.glenoid_orientation(*measured, retroversion=5, inclination=8, degrees=True)
    >>> cone = ep.GlenoidCone(orientation=turns, elevation=np.radians([30, 90, 120]))
    >>> np.degrees(turns.magnitude()).round(1)  # of the socket against the torso
    array([42.3, 53.1, 61.1])
    """
    if not isinstance(degrees, bool):
        raise InvalidInput(f"expected degrees to be True or False, got {degrees!r:.80}")
    named = {"internal_rotation": internal_rotation, "upward_rotation": upward_rotation, "tilt": tilt}
    angles = []
    for name, value in (named | {"retroversion": retroversion, "inclination": inclination}).items():
        angle = as_finite(name, value, (), stack=True) * (np.pi / 180.0 if degrees else 1.0)
        if (np.abs(angle) > np.pi / 2).any():
            raise InvalidInput(f"expected {name} within ±90 degrees, got {np.degrees(np.abs(angle).max()):g} degrees")
        angles.append(angle)
    try:
        inward, up, back, version, rise = np.broadcast_arrays(*angles)
    except ValueError:
        shapes = ", ".join(str(angle.shape) for angle in angles)
        raise InvalidInput(f"expected angles of shapes that fit, got {shapes}") from None
    scapula = Rotation.from_euler("ZXY", np.stack([-inward, up, -back], axis=-1))
    return scapula * Rotation.from_euler("ZX", np.stack([version, rise], axis=-1))


def checked_elevation(orientation: Rotation | None, elevation: ArrayLike | None) -> FloatArray | None:
    """Elevations of the arm, rad, that orientations of a socket belong to; None for a single orientation or none.

    Raises
    ------
    InvalidInput
        If the two do not fit each other.
    """
    if orientation is None:
        if elevation is not None:
            raise InvalidInput("elevation needs an orientation for each of its angles: give both or neither")
        return None
    shape = as_rotation("orientation", orientation).shape
    if elevation is None:
        if shape:
            raise InvalidInput(f"expected a single orientation, or elevation with it, got a stack of shape {shape}")
        return None
    if len(shape) != 1:
        raise InvalidInput(f"expected orientations of shape (k,), one an elevation, got {shape}")
    return as_elevations(elevation, shape[0], "orientations")


def known_orientation(orientation: Rotation | None) -> Rotation:
    """The orientation of a socket; raises MissingData if there is none."""
    if orientation is None:
        raise MissingData(
            ["orientation of the glenoid"],
            "a glenoid cone",
            advice="take a person's (person.glenoid_cone(); --person on the command line), or give the scapula's "
            "angles (orientation=exo_pin.glenoid_orientation(...))",
        )
    return orientation
