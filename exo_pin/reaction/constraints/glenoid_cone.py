"""The glenoid cone: contact forces at which the humeral head stays in its socket."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.conventions import MIRROR, as_side
from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.fields import set_fields, set_positive
from ...core.validation import FloatArray, as_choice, as_finite, as_positive

__all__ = ["GlenoidCone"]

_FEWEST_FACES, _MOST_FACES = 3, 256


@dataclass(frozen=True)
class GlenoidCone:
    """Contact forces at which the humeral head stays in its socket: an elliptical cone about the glenoid's axis.

    With N the compression of the contact (along the axis that points out of the socket, as the socket pushes the
    head) and S, P its shear towards superior and anterior,

        (S / superior)² + (P / anterior)² <= N²,   N >= 0.

    The default ratios 0.61 and 0.34 are of published musculoskeletal models; Lippitt et al. (1993) measured up to
    0.6, greatest along superior and inferior. A circle of 0.5 is the other form in use.

    **The person's own muscles add compression**, tens to hundreds of N, which the equilibrium of the device does not
    contain. Without them nearly every device pulls the head out of this cone. Give their compression as
    ``muscle_compression``, or as a :class:`exo_pin.Load` through O (:meth:`muscle_load`); then the load is
    part of F_s, and ``muscle_compression`` stays 0.

    The glenoid is fixed in the base frame: it does not follow the scapula as the arm rises. Version and inclination
    are measured against the scapula, so the rotation of the scapula on the ribs is part of ``protraction``.

    Attributes
    ----------
    superior, anterior : float
        Ratio of shear to compression at the edge, along superior-inferior and anterior-posterior.
    retroversion : float
        Turn of the socket's opening backwards, rad; 1 ± 3 degrees in adults.
    inclination : float
        Turn of its opening upwards, rad; 7.1 ± 4.1 degrees of the bone.
    protraction : float
        Turn of the whole scapula forwards about the vertical, rad.
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
        If a ratio is not positive, an angle looks like degrees, or the faces are too few or too many.
    """

    superior: float = 0.61
    anterior: float = 0.34
    retroversion: float = 0.0
    inclination: float = 0.0
    protraction: float = 0.0
    faces: int = 16
    approximation: str = "inner"
    muscle_compression: float = 0.0
    penalty: float | None = None

    def __post_init__(self) -> None:
        set_positive(self, "superior", "anterior")
        for name in ("retroversion", "inclination", "protraction"):
            angle = float(as_finite(name, getattr(self, name), ()))
            if abs(angle) > np.pi / 2:
                raise InvalidInput(f"expected {name} in rad within ±π/2, got {angle:g} (degrees?)")
            set_fields(self, **{name: angle})
        if isinstance(self.faces, bool) or not isinstance(self.faces, (int, np.integer)):
            raise InvalidInput(f"expected faces to be an integer, got {echo(self.faces)}")
        if not _FEWEST_FACES <= self.faces <= _MOST_FACES:
            raise InvalidInput(f"expected {_FEWEST_FACES} to {_MOST_FACES} faces, got {echo(self.faces)}")
        as_choice("approximation", self.approximation, ("inner", "outer"))
        set_positive(self, "muscle_compression", zero=True)
        set_positive(self, "penalty", optional=True)

    @classmethod
    def circular(cls, ratio: float = 0.5, **details: float) -> GlenoidCone:
        """A circular cone."""
        return cls(superior=ratio, anterior=ratio, **details)  # type: ignore[arg-type]

    @property
    def error(self) -> float:
        """Largest relative error of the polyhedral cone in the shear it allows: 1 - cos(π/faces), or its reciprocal.

        "inner" allows down to this fraction less than the ellipse, "outer" up to 1/cos(π/faces) - 1 more.
        """
        cosine = float(np.cos(np.pi / self.faces))
        return 1.0 - cosine if self.approximation == "inner" else 1.0 / cosine - 1.0

    def axes(self, side: str = "left") -> FloatArray:
        """Axes of the glenoid in the base frame.

        Parameters
        ----------
        side : {"left", "right"}
            Side of the body.

        Returns
        -------
        ndarray
            Shape (3, 3), rows: out of the socket, superior, anterior. The left one points to +y at zero angles.
        """
        turn, rise = self.protraction - self.retroversion, self.inclination
        outward = np.array([np.sin(turn) * np.cos(rise), np.cos(turn) * np.cos(rise), np.sin(rise)])
        superior = np.array([-np.sin(turn) * np.sin(rise), -np.cos(turn) * np.sin(rise), np.cos(rise)])
        anterior = np.array([np.cos(turn), -np.sin(turn), 0.0])
        rows = np.stack([outward, superior, anterior])
        return rows if as_side(side) == "left" else rows @ MIRROR

    def half_spaces(self, side: str = "left") -> tuple[FloatArray, FloatArray]:
        """The polyhedral cone as N F_s <= h, the muscles' compression included.

        Returns
        -------
        N : ndarray
            Shape (faces, 3), unit rows in the base frame.
        h : ndarray
            Shape (faces,), N, zero or more.
        """
        angles = 2.0 * np.pi * np.arange(self.faces) / self.faces
        size = np.cos(np.pi / self.faces) if self.approximation == "inner" else 1.0
        rows = np.stack(
            [np.full(self.faces, -size), np.cos(angles) / self.superior, np.sin(angles) / self.anterior], axis=1
        )
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        axes = self.axes(side)
        normals = rows @ axes
        return normals, -self.muscle_compression * (normals @ axes[0])

    def components(self, shoulder_force: FloatArray, side: str = "left") -> FloatArray:
        """Compression, superior and anterior shear of the contact force, the muscles' compression included.

        Parameters
        ----------
        shoulder_force : ndarray
            F_s, shape (..., 3), N, base frame: the force of the shoulder on the arm.
        side : {"left", "right"}
            Side of the body.

        Returns
        -------
        ndarray
            Shape (..., 3), N. The socket's force on the head; the head presses back with the opposite.
        """
        parts = np.array(as_finite("shoulder_force", shoulder_force, (3,), stack=True) @ self.axes(side).T)
        parts[..., 0] += self.muscle_compression
        return parts

    def utilisation(self, shoulder_force: FloatArray, side: str = "left") -> FloatArray:
        """Shear over the limit of the elliptical cone, shape (...): up to 1 inside, infinite without compression."""
        compression, superior, anterior = np.moveaxis(self.components(shoulder_force, side), -1, 0)
        shear = np.hypot(superior / self.superior, anterior / self.anterior)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(compression > 0.0, shear / compression, np.inf)
        return np.where((shear == 0.0) & (compression == 0.0), 0.0, ratio)

    def muscle_load(self, newtons: float, side: str = "left") -> FloatArray:
        """Force of muscles that press the head straight into the socket, shape (3,), N, for a Load through O."""
        return -as_positive("newtons", newtons, zero=True) * self.axes(side)[0]
