"""Elevation of the arm: its angle from hanging, of poses and as given by a user."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite, as_rotation


def elevation_angle(poses: Rotation) -> FloatArray:
    """Angle between the upper arm, -z of {O_B}, and -z of the base, shape (...), rad: 0 hanging, π straight up."""
    R = as_rotation("poses", poses).as_matrix()
    # As an arc tangent, which is accurate where the arm hangs, too.
    return np.asarray(np.arctan2(np.hypot(R[..., 0, 2], R[..., 1, 2]), R[..., 2, 2]))


def as_elevations(value: ArrayLike, count: int, what: str) -> FloatArray:
    """Rising elevations within 0 to π, shape (count,), rad, one for each of ``what``.

    Raises
    ------
    InvalidInput
        If they are not.
    """
    angles = as_finite("elevation", value, (None,))
    if len(angles) < 2 or len(angles) != count:
        raise InvalidInput(f"expected as many elevations as {what}, 2 or more, got {len(angles)} and {count}")
    if (np.diff(angles) <= 0.0).any() or angles[0] < 0.0 or angles[-1] > np.pi + 1e-9:
        raise InvalidInput(f"expected elevation to rise within 0 to π rad, got {angles} (degrees?)")
    return angles


def known_elevations(angles: FloatArray, known: FloatArray) -> FloatArray:
    """Elevations of shape (...), rad, if they lie within the ``known`` ones.

    Raises
    ------
    InvalidInput
        If one does not: there is no extrapolation.
    """
    low, high = float(known[0]), float(known[-1])
    # Rounding of a rotation's matrix moves the angle of a hanging arm by about 1e-8.
    beyond = (angles < low - 1e-7) | (angles > high + 1e-7)
    if beyond.any():
        raise InvalidInput(
            f"expected elevations of {np.degrees(low):g} to {np.degrees(high):g} degrees, where the path is "
            f"known, got {np.degrees(angles[beyond].ravel()[0]):g} degrees"
        )
    return np.asarray(np.clip(angles, low, high))
