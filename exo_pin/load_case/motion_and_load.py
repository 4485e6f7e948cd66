"""Motion of the arm, load on it, offset of the device, and the path of the shoulder's centre as the arm is lifted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.conventions import MIRROR
from ..core.errors import InvalidInput
from ..core.records import Record
from ..core.validation import FloatArray, as_choice, as_finite, as_rotation, set_fields


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


#: No arm turns faster (rad/s) or is accelerated more (rad/s²): beyond it a number is a slip.
FASTEST = 1e6
#: Largest load, N or N m, that is not a slip.
_STRONGEST = 1e9


@dataclass(frozen=True, eq=False)
class Motion(Record):
    """Angular velocity and acceleration of the arm, base frame.

    Attributes
    ----------
    angular_velocity : ndarray
        ω, shape (..., 3), rad/s.
    angular_acceleration : ndarray
        η, shape (..., 3), rad/s².
    cautions : tuple of str
        Doubts about ω and η of a measured movement.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> fast = ep.Motion([0.0, -2.0, 0.0], [0.0, -10.0, 0.0])  # rad/s, rad/s²: flexion that speeds up
    >>> [round(float(exo.reaction(exo.pose(45), motion).magnitude), 1) for motion in (None, fast)]
    [39.3, 56.3]
    """

    angular_velocity: FloatArray
    angular_acceleration: FloatArray
    cautions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("angular_velocity", "angular_acceleration"):
            value = as_finite(name, getattr(self, name), (3,), stack=True)
            if np.abs(value).max(initial=0.0) > FASTEST:
                raise InvalidInput(f"expected {name} in rad/s or rad/s² below {FASTEST:g}, got {np.abs(value).max():g}")
            set_fields(self, **{name: value})


@dataclass(frozen=True, eq=False)
class Load(Record):
    """A force and a couple on the arm, besides its weight.

    Attributes
    ----------
    force : ndarray
        Shape (..., 3), N.
    moment : ndarray
        Shape (..., 3), N m, a pure couple.
    at : ndarray
        Shape (..., 3), m, the point of the arm where the force acts, always in the arm frame {O_B}.
    frame : {"base", "arm"}
        Axes in which ``force`` and ``moment`` are given.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> answer = exo.reaction(exo.pose(60), load=ep.Load([0.0, 0.0, -15.0], at=[0.0, 0.0, -0.55], frame="base"))
    >>> print(answer.verdict)
    The device can hold this pose.
    """

    force: FloatArray
    moment: FloatArray | ArrayLike = 0.0
    at: FloatArray | ArrayLike = (0.0, 0.0, 0.0)
    frame: Literal["base", "arm"] = "base"

    def __post_init__(self) -> None:
        is_zero = isinstance(self.moment, (int, float)) and self.moment == 0
        moment = np.zeros(3) if is_zero else self.moment
        for name, value in (("force", self.force), ("moment", moment), ("at", self.at)):
            array = as_finite(name, value, (3,), stack=True)
            if np.abs(array).max(initial=0.0) > _STRONGEST:
                raise InvalidInput(f"expected {name} below {_STRONGEST:g}, got {np.abs(array).max():g}")
            set_fields(self, **{name: array})
        if np.abs(np.asarray(self.at)).max(initial=0.0) > 5.0:
            raise InvalidInput(f"expected at in m, got {self.at} (millimetres?)")
        as_choice("frame", self.frame, ("base", "arm"))


@dataclass(frozen=True, eq=False)
class CentreOffset(Record):
    """Offset of the device's centre from the anatomical centre of the shoulder.

    Attributes
    ----------
    base : ndarray
        Of the centre that base ring and torso hold, shape (..., 3), m, base frame. A stack lets the anatomical
        centre move with the pose: a shoulder that moves by d shifts the base by -d
        (:class:`CentrePath`).
    cuff : ndarray
        Of the centre that platform and arm carry, shape (..., 3), m, arm frame {O_B}.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> off = ep.CentreOffset([0.0, 0.0, 0.01], [0.0, 0.0, 0.01])  # base and cuff 10 mm too high
    >>> round(float(exo.reaction(exo.pose(45), centre_offset=off).magnitude), 1)
    40.8
    """

    base: FloatArray
    cuff: FloatArray

    def __post_init__(self) -> None:
        for name in ("base", "cuff"):
            offset = as_finite(name, getattr(self, name), (3,), stack=True)
            if (most := np.abs(offset).max(initial=0.0)) > 0.2:
                raise InvalidInput(f"expected {name} offset within 0.2 m, got {most:g} m (millimetres?)")
            set_fields(self, **{name: offset})

    @classmethod
    def together(cls, offset: ArrayLike) -> CentreOffset:
        """Base and cuff shifted alike: the device fits at rest, {O_B} = {O_A}, and misfits as the arm turns.

        Parameters
        ----------
        offset : array_like
            Shape (..., 3), m.

        Returns
        -------
        CentreOffset

        Examples
        --------
        >>> offset = ep.CentreOffset.together([0.01, 0.0, 0.0])  # m
        >>> bool((offset.base == offset.cuff).all())
        True
        """
        return cls(offset, offset)  # type: ignore[arg-type]


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

    Examples
    --------
    >>> path = ep.CentrePath([0.0, np.pi / 2], [[0.0, 0.0, 0.0], [-0.02, 0.0, 0.02]])
    >>> exo = ep.load("four-linear-actuators")
    >>> exo.reaction(exo.pose(flexion=[0, 45, 90]), centre_offset=path).magnitude.round(1)
    array([41.9, 38.2, 46.1])
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

        Parameters
        ----------
        elevation : array_like
            Shape (...), rad: of the upper arm from the hanging one, 0 to π.

        Returns
        -------
        numpy.ndarray
            Shape (..., 3), m, base frame: from the centre's place at rest.

        Raises
        ------
        InvalidInput
            If an elevation lies outside the given ones: there is no extrapolation.

        Examples
        --------
        >>> path = ep.CentrePath([0.0, np.pi / 2], [[0.0, 0.0, 0.0], [-0.02, 0.0, 0.03]])
        >>> (1e3 * path.at(np.pi / 4)).round(1)  # mm
        array([-10.,   0.,  15.])
        """
        angles = known_elevations(as_finite("elevation", elevation, (), stack=True), self.elevation)
        return np.asarray(scipy.interpolate.PchipInterpolator(self.elevation, self.displacement)(angles))

    def offset(self, poses: Rotation) -> CentreOffset:
        """Offset of the device in poses of shape (...): the base is displaced by minus the motion of the centre.

        Parameters
        ----------
        poses : Rotation
            Shape (...), {O_B} to {O_A}.

        Returns
        -------
        CentreOffset
            Shape (..., 3), m: ``base`` in the base frame, and ``cuff`` in the arm frame, which is ``fit``.

        Examples
        --------
        >>> path = ep.CentrePath([0.0, np.pi / 2], [[0.0, 0.0, 0.0], [-0.02, 0.0, 0.025]])
        >>> offset = path.offset(ep.load("prototype").pose(abduction=90))
        >>> (1e3 * offset.base).round(6)  # mm: the device's base, seen from the centre that has moved
        array([ 20.,   0., -25.])
        """
        own = np.asarray(self.fit)
        return CentreOffset(own - self.at(elevation_angle(poses)), own)

    def mirrored(self) -> CentrePath:
        """Mirror image in the x-z plane, for the other shoulder.

        Returns
        -------
        CentrePath

        Examples
        --------
        >>> path = ep.CentrePath([0.0, np.pi / 2], [[0.0, 0.0, 0.0], [0.0, 0.015, 0.02]])  # outward on the left
        >>> (1e3 * path.mirrored().at(np.pi / 2)).round(6)  # mm
        array([  0., -15.,  20.])
        """
        return replace(self, displacement=self.displacement @ MIRROR, fit=np.asarray(self.fit) @ MIRROR)
