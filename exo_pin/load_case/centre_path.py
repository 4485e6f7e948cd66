"""Motion of the shoulder's centre with the elevation of the arm."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.conventions import MIRROR
from ..core.errors import InvalidInput
from ..core.fields import set_fields
from ..core.records import Record
from ..core.validation import FloatArray, as_finite, as_rotation
from .motion_and_load import CentreOffset


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


@dataclass(frozen=True, eq=False)
class CentrePath(Record):
    """Where the anatomical centre of the shoulder goes as the arm is elevated.

    Between the given points a monotone cubic (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238)
    interpolates each coordinate, so that it does not swing out between them. No path is assumed: measure one, or take
    one from the literature.

    Attributes
    ----------
    elevation : ndarray
        Shape (k,), rad, k >= 2, rising.
    displacement : ndarray
        Shape (k, 3), m, base frame: from the place of the centre at rest.
    fit : ndarray
        Shape (3,), m: offset of the device at rest, base and cuff together.
    """

    elevation: FloatArray
    displacement: FloatArray
    fit: FloatArray | ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        moved = as_finite("displacement", self.displacement, (None, 3))
        angles = as_elevations(self.elevation, len(moved), "displacements")
        CentreOffset(moved, moved)  # its check of the size
        set_fields(self, elevation=angles, displacement=moved, fit=as_finite("fit", self.fit, (3,)))

    def at(self, elevation: ArrayLike) -> FloatArray:
        """Displacement of the centre, shape (..., 3), m, at elevations of shape (...), rad.

        Raises
        ------
        InvalidInput
            If an elevation lies outside the given ones: there is no extrapolation.
        """
        angles = known_elevations(as_finite("elevation", elevation, (), stack=True), self.elevation)
        return np.asarray(scipy.interpolate.PchipInterpolator(self.elevation, self.displacement)(angles))

    def offset(self, poses: Rotation) -> CentreOffset:
        """Offset of the device in poses of shape (...): the base is displaced by minus the motion of the centre."""
        return CentreOffset.of_moving_shoulder(self.at(elevation_angle(poses)), np.asarray(self.fit))

    def mirrored(self) -> CentrePath:
        """Mirror image in the x-z plane, for the other shoulder."""
        return replace(self, displacement=self.displacement @ MIRROR, fit=np.asarray(self.fit) @ MIRROR)
