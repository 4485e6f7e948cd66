"""The glenoid cone: contact forces at which the humeral head stays in its socket."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation, Slerp

from ...core.conventions import MIRROR, as_side
from ...core.errors import InvalidInput, MissingData
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_choice, as_finite, as_rotation, set_fields, set_positive
from ...load_case.motion_and_load import as_elevations, elevation_angle, known_elevations

_FEWEST_FACES, _MOST_FACES = 3, 256


@checked
@dataclass(frozen=True, eq=False)
class GlenoidCone(Record):
    """Contact forces at which the humeral head stays in its socket: an elliptical cone about the glenoid's axis.

    With N the compression of the contact (along the axis that points out of the socket, as the socket pushes the
    head) and S, P its shear towards superior and anterior,

        (S / superior)² + (P / anterior)² <= N²,   N >= 0.

    The default ratios 0.61 and 0.34 are of published musculoskeletal models; Lippitt et al. (1993) measured up to
    0.6, greatest along superior and inferior. A circle of 0.5 is the other form in use.

    **Where the socket faces** is the person's, and nothing is assumed: a hanging scapula already faces 30 to 40
    degrees forward, and turns upward with the arm. Three ways to say it:

    * :meth:`exo_pin.Person.glenoid_cone`, from the anatomical model, following the elevation of the arm;
    * ``orientation`` by :func:`exo_pin.glenoid_orientation`, from angles that were measured or published;
    * the same at several values of ``elevation``, so that the socket follows the arm.

    Without an orientation a cone has its ratios alone. That is enough for :meth:`exo_pin.Person.joint_contact`, which
    knows the scapula; every other use raises MissingData.

    **The person's own muscles add compression**, tens to hundreds of N, which the equilibrium of the device does not
    contain. Without them nearly every device pulls the head out of this cone. Give their compression as
    ``muscle_compression``, or as a :class:`exo_pin.Load` through O, against :meth:`axes`; then the load is
    part of F_s, and ``muscle_compression`` stays 0.

    Attributes
    ----------
    superior, anterior : float
        Ratio of shear to compression at the edge, along superior-inferior and anterior-posterior.
    orientation : Rotation or None
        Takes the glenoid's axes (x anterior, y out of the socket, z superior) of a **left** shoulder to {O_A}; a right
        one is the mirror image in the x-z plane. The identity faces straight to the left. Single, or shape (k,) at
        the elevations.
    elevation : ndarray or None
        Shape (k,), rad, rising, k >= 2: elevations of the arm (0 hanging) at which the orientations hold; between them
        it turns about one axis at a constant rate. None: the socket stays.
    faces : int
        Number of flat faces of the polyhedral cone that the programs use.
    approximation : {"inner", "outer"}
        "inner": its edges lie on the elliptical cone, which contains it. "outer": its faces touch the elliptical cone,
        which it contains.
    muscle_compression : float
        Compression of the joint by the person's own muscles, N, besides F_s.
    penalty : float or None
        None: the cone is a constraint. A number: N² of cost per N² of distance from the cone, so that the socket
        makes no pose infeasible.

    Raises
    ------
    InvalidInput
        If a ratio is not positive, orientation and elevation do not fit, or the faces are too few or too many.

    Examples
    --------
    A scapula at rest that faces 35° forward and leans 10° forward, its glenoid turned 5° back and 8° up. The force of
    the socket on a left head points forward and to the left; straight sideways it would slide out.

    >>> turn = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)
    >>> cone = ep.GlenoidCone(orientation=turn)
    >>> cone.axes("left")[0].round(2)
    array([0.52, 0.84, 0.15])
    >>> cone.axes("right")[0].round(2)
    array([ 0.52, -0.84,  0.15])
    >>> round(float(cone.utilisation([0.0, 100.0, 0.0])), 2)  # above 1: out of the socket
    1.77
    """

    superior: float = 0.61
    anterior: float = 0.34
    orientation: Rotation | None = None
    elevation: FloatArray | ArrayLike | None = None
    faces: int = 16
    approximation: str = "inner"
    muscle_compression: float = 0.0
    penalty: float | None = None

    def __post_init__(self) -> None:
        set_positive(self, "superior", "anterior")
        set_fields(self, elevation=checked_elevation(self.orientation, self.elevation))
        if isinstance(self.faces, bool) or not isinstance(self.faces, (int, np.integer)):
            raise InvalidInput(f"expected faces to be an integer, got {echo(self.faces)}")
        if not _FEWEST_FACES <= self.faces <= _MOST_FACES:
            raise InvalidInput(f"expected {_FEWEST_FACES} to {_MOST_FACES} faces, got {echo(self.faces)}")
        as_choice("approximation", self.approximation, ("inner", "outer"))
        set_positive(self, "muscle_compression", zero=True)
        set_positive(self, "penalty", optional=True)

    @property
    def error(self) -> float:
        """Largest relative error of the polyhedral cone in the shear it allows: 1 - cos(π/faces), or its reciprocal.

        "inner" allows down to this fraction less than the ellipse, "outer" up to 1/cos(π/faces) - 1 more.
        """
        cosine = float(np.cos(np.pi / self.faces))
        return 1.0 - cosine if self.approximation == "inner" else 1.0 / cosine - 1.0

    def axes(self, side: str = "left", pose: Rotation | None = None) -> FloatArray:
        """Axes of the glenoid in the base frame.

        Parameters
        ----------
        side : {"left", "right"}
            Side of the body.
        pose : Rotation, optional
            Of the arm, single or a stack of shape (...); needed by a cone that follows it.

        Returns
        -------
        ndarray
            Shape (..., 3, 3), rows: out of the socket, superior, anterior; unit vectors.

        Raises
        ------
        MissingData
            If the cone has no orientation.
        InvalidInput
            If it follows the arm and there is no ``pose``, or one beyond the given elevations.

        Examples
        --------
        >>> out, superior, anterior = ep.GlenoidCone(orientation=ep.thesis_rotation(0, 0, 0)).axes("left")
        >>> anterior.round(9) + 0.0, round(float(out @ superior), 9)  # forward; at right angles
        (array([1., 0., 0.]), 0.0)
        """
        side, orientation = as_side(side), known_orientation(self.orientation)
        turns = orientation.as_matrix()
        shape = () if pose is None else as_rotation("pose", pose).shape
        if self.elevation is not None:
            if pose is None:
                raise InvalidInput("this cone follows the elevation of the arm: give the pose, too")
            angles = known_elevations(elevation_angle(pose), np.asarray(self.elevation))
            turns = Slerp(self.elevation, orientation)(angles.ravel()).as_matrix().reshape(*shape, 3, 3)
        anterior, outward, superior = np.moveaxis(turns, -1, 0)
        rows = np.broadcast_to(np.stack([outward, superior, anterior], axis=-2), (*shape, 3, 3))
        return rows if side == "left" else rows @ MIRROR

    def half_spaces(self, side: str = "left", pose: Rotation | None = None) -> tuple[FloatArray, FloatArray]:
        """The polyhedral cone as N F_s <= h, the muscles' compression included; parameters of :meth:`axes`.

        Parameters
        ----------
        side, pose : optional
            As :meth:`axes`.

        Returns
        -------
        N : ndarray
            Shape (..., faces, 3), unit rows in the base frame.
        h : ndarray
            Shape (faces,), N, zero or more.

        Examples
        --------
        >>> cone = ep.GlenoidCone(orientation=ep.thesis_rotation(0, 0, 0), muscle_compression=100.0)
        >>> N, h = cone.half_spaces()
        >>> out, superior, _ = cone.axes()
        >>> forces = 50.0 * superior, 80.0 * superior, -90.0 * out  # N; 61 N of superior shear at 100 N
        >>> [bool((N @ force <= h).all()) for force in forces]
        [True, False, True]
        """
        angles = 2.0 * np.pi * np.arange(self.faces) / self.faces
        size = np.cos(np.pi / self.faces) if self.approximation == "inner" else 1.0
        rows = np.stack(
            [np.full(self.faces, -size), np.cos(angles) / self.superior, np.sin(angles) / self.anterior], axis=1
        )
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        return rows @ self.axes(side, pose), -self.muscle_compression * rows[:, 0]

    def components(self, shoulder_force: FloatArray, side: str = "left", pose: Rotation | None = None) -> FloatArray:
        """Compression, superior and anterior shear of the contact force, the muscles' compression included.

        Parameters
        ----------
        shoulder_force : ndarray
            F_s, shape (..., 3), N, base frame: the force of the shoulder on the arm.
        side, pose : optional
            As :meth:`axes`.

        Returns
        -------
        ndarray
            Shape (..., 3), N. The socket's force on the head; the head presses back with the opposite.

        Examples
        --------
        >>> cone = ep.GlenoidCone(orientation=ep.thesis_rotation(0, 0, 0), muscle_compression=200.0)
        >>> cone.components(30.0 * cone.axes()[1]).round(6) + 0.0  # N; 30 N upward beside the muscles' 200 N
        array([200.,  30.,   0.])
        """
        force = as_finite("shoulder_force", shoulder_force, (3,), stack=True)
        parts = np.array(np.einsum("...ij,...j->...i", self.axes(side, pose), force))
        parts[..., 0] += self.muscle_compression
        return parts

    def utilisation(self, shoulder_force: FloatArray, side: str = "left", pose: Rotation | None = None) -> FloatArray:
        """Shear over the limit of the elliptical cone, shape (...): up to 1 inside, infinite without compression.

        Parameters
        ----------
        shoulder_force : ndarray
            F_s, shape (..., 3), N, base frame: the force of the shoulder on the arm.
        side, pose : optional
            As :meth:`axes`.

        Returns
        -------
        ndarray
            Shape (...).

        Examples
        --------
        >>> turn = ep.glenoid_orientation(35, 0, 0, retroversion=0, inclination=0, degrees=True)
        >>> cone = ep.GlenoidCone(orientation=turn)
        >>> out = cone.axes("left")[0]  # the direction in which the socket faces: it presses so on the humerus
        >>> round(float(cone.utilisation(100.0 * out)), 6), float(cone.utilisation(-100.0 * out))  # a pull leaves it
        (0.0, inf)
        """
        compression, superior, anterior = np.moveaxis(self.components(shoulder_force, side, pose), -1, 0)
        shear = np.hypot(superior / self.superior, anterior / self.anterior)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(compression > 0.0, shear / compression, np.inf)
        return np.where((shear == 0.0) & (compression == 0.0), 0.0, ratio)


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
