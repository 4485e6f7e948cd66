"""The shoulder: range and stiffness of the joint at O.

What sits between device and person: a spring under the base ring (harness) and one under the platform (cuff).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.conventions import MIRROR
from ..core.errors import InvalidInput, MissingData
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import (
    FloatArray,
    as_finite,
    as_positive,
    as_real,
    frozen,
    require_type,
    require_types,
    set_fields,
    set_positive,
)


def as_stiffness(name: str, value: Any) -> FloatArray:
    """Return a stiffness as a symmetric positive semi-definite matrix, shape (3, 3), N/m; a number means isotropic.

    Raises
    ------
    InvalidInput
        If it is neither a number nor such a matrix.
    """
    if as_real(name, value).ndim == 0:
        return frozen(as_positive(name, value, zero=True) * np.eye(3))
    matrix = as_finite(name, value, (3, 3))
    scale = float(np.abs(matrix).max())
    if (matrix - matrix.T).max() > 1e-9 * scale:
        raise InvalidInput(f"expected {name} to be symmetric, got {matrix.tolist()}")
    if scale > 0.0 and np.linalg.eigvalsh(matrix)[0] < -1e-9 * scale:
        raise InvalidInput(f"expected {name} without a negative principal stiffness, got {matrix.tolist()}")
    return frozen(0.5 * (matrix + matrix.T))


@checked
@dataclass(frozen=True, eq=False)
class Shoulder(Record):
    """A ball joint at O, and the range it allows.

    Attributes
    ----------
    abduction_centre : float or None
        Middle of the range of motion, rad: |θx - centre| + |θz| < half_diagonal, Table 5-6, in the shoulder's Y-X-Z
        angles (θx is abduction, θz axial rotation; flexion is free). None where no range is known.
    half_diagonal : float or None
        Half width of that range, rad.
    stiffness : ndarray or None
        K_s, shape (3, 3), N/m, base frame: force per displacement of the joint's centre. A number means the
        same in every direction. None where it is not known; no value for a person was found in the literature,
        so sweep it.

    Examples
    --------
    >>> soft, stiff = ep.Shoulder(stiffness=20e3), ep.Shoulder(stiffness=np.diag([40e3, 20e3, 60e3]))
    >>> (1e-3 * np.diag(stiff.stiffness - soft.stiffness)).round()  # N/mm
    array([20.,  0., 40.])
    """

    abduction_centre: float | None = None
    half_diagonal: float | None = None
    stiffness: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.stiffness is not None:
            set_fields(self, stiffness=as_stiffness("stiffness", self.stiffness))
        if self.abduction_centre is not None:
            set_fields(self, abduction_centre=float(as_finite("abduction_centre", self.abduction_centre, ())))
        set_positive(self, "half_diagonal", optional=True)

    def mirrored(self) -> Shoulder:
        """Mirror image in the x-z plane, for the other side of the body.

        Returns
        -------
        Shoulder

        Examples
        --------
        >>> K = np.array([[20e3, 3e3, 0.0], [3e3, 20e3, 0.0], [0.0, 0.0, 30e3]])
        >>> float(ep.Shoulder(stiffness=K).mirrored().stiffness[0, 1])  # N/m, between x and y
        -3000.0
        """
        if self.stiffness is None:
            return self
        return replace(self, stiffness=MIRROR @ self.stiffness @ MIRROR)


#: Pressures to compare the cuff's with, and where they come from: none was found for the upper arm.
PRESSURE_LIMITS = (
    "pressure hurts under a ring about the calf at 26 ± 1.6 kPa (Eur J Pain 2001, 5:267), on the lower leg at 22.8 ± "
    "10.0 kPa (16,288 people, Tromsø); no limit was found for the upper arm"
)
#: No cuff covers more of an arm, seen from one side, m².
_LARGEST_AREA = 0.1
#: Mirror image of a wrench (force, moment): a moment is a pseudovector.
_MIRROR = np.block([[MIRROR, np.zeros((3, 3))], [np.zeros((3, 3)), -MIRROR]])


@checked
@dataclass(frozen=True, eq=False)
class Interface(Record):
    """A spring with six degrees of freedom between a part of the device and the body under it.

    Attributes
    ----------
    stiffness : ndarray
        K, shape (6, 6), symmetric, positive definite: (force, moment) per (displacement, rotation vector) of the
        device's part against the body; N/m, N (that is N/rad and N m/m) and N m/rad. The moment is about ``at``.
    at : ndarray
        Shape (3,), m: the point whose displacement is meant. Of a harness in the base frame, of a cuff in the arm frame
        {O_B}; so are the axes of ``stiffness``.
    source : str
        Where the numbers come from.

    Examples
    --------
    >>> soft = ep.Interface(np.diag([2e3, 2e3, 2e3, 10.0, 10.0, 5.0]), at=[0.0, 0.0, -0.15])  # N/m, N m/rad
    >>> round(float(1e3 * soft.compliance[0, 0] * 30.0), 3)  # mm that it gives way under 30 N along x
    15.0
    """

    stiffness: FloatArray
    at: FloatArray | ArrayLike = (0.0, 0.0, 0.0)
    source: str = ""

    def __post_init__(self) -> None:
        matrix = as_finite("interface stiffness", self.stiffness, (6, 6))
        if not (np.diag(matrix) > 0.0).all():
            raise InvalidInput(
                f"expected the diagonal of an interface's stiffness above zero, got {np.diag(matrix).tolist()}; "
                "leave the interface out for a rigid one"
            )
        scale = np.sqrt(np.diag(matrix))
        scaled = matrix / np.outer(scale, scale)
        if (scaled - scaled.T).max() > 1e-9:
            raise InvalidInput(f"expected the stiffness of an interface to be symmetric, got {matrix.tolist()}")
        if np.linalg.eigvalsh(scaled)[0] < 1e-12:
            raise InvalidInput(
                "expected an interface that resists every motion (a positive definite stiffness), got the eigenvalue "
                f"{np.linalg.eigvalsh(scaled)[0]:.3g} of the stiffness scaled to a diagonal of ones"
            )
        at = as_finite("at", self.at, (3,))
        if np.abs(at).max() > 2.0:
            raise InvalidInput(f"expected at in m, got {at.tolist()} (millimetres?)")
        set_fields(self, stiffness=frozen(0.5 * (matrix + matrix.T)), at=at)
        require_type("source", self.source, str, "a string")

    @classmethod
    def of(
        cls, translational: ArrayLike, rotational: ArrayLike, at: ArrayLike = (0.0, 0.0, 0.0), source: str = ""
    ) -> Interface:
        """Without coupling between the axes.

        Parameters
        ----------
        translational, rotational : array_like
            N/m and N m/rad, a number or shape (3,).
        at : array_like
            Shape (3,), m.
        source : str
            Where the numbers come from.

        Returns
        -------
        Interface

        Raises
        ------
        InvalidInput
            If a number is not positive, or an array does not fit.

        Examples
        --------
        >>> cuff = ep.Interface.of(translational=[3.7e3, 3.15e3, 2.25e3], rotational=10.0)
        >>> round(float(1e3 * 45.0 / cuff.stiffness[2, 2]), 1)  # mm that 45 N along the arm move it
        20.0
        """
        values = []
        for name, given in (("translational", translational), ("rotational", rotational)):
            array = as_finite(name, np.broadcast_to(given, (3,)) if np.ndim(given) == 0 else given, (3,))
            values += [as_positive(name, value) for value in array.tolist()]
        return cls(np.diag(values), at, source)

    @classmethod
    def upper_arm_cuff(cls, distance: float, times: float = 1.0) -> Interface:
        """A cuff on the upper arm, as measured on 21 young adults in overhead postures.

        Mean of the linear fits to both senses (subject group regressions): 2.25 N/mm along the arm, 3.15 and 3.70 N/mm
        across it (latero-medial and caudo-cranial: y and x of the arm that hangs); 0.035 N m/° about the arm, 0.21 and
        0.185 N m/° across it. Between 2 and 5 N/mm in most people, and stiffer under load: sweep ``times``.

        Parameters
        ----------
        distance : float
            From the shoulder's centre along the arm to the cuff, m.
        times : float
            Factor on all of it.

        Returns
        -------
        Interface

        Notes
        -----
        Source: Schiebl et al., Sensors 25 (2025) 4605, doi 10.3390/s25154605, Table in Appendix B.1.

        Examples
        --------
        >>> cuff = ep.Interface.upper_arm_cuff(distance=0.15)
        >>> (1e-3 * np.diag(cuff.stiffness)[:3]).round(2)  # N/mm, along x, y and z of the arm
        array([3.7 , 3.15, 2.25])
        """
        factor, reach = as_positive("times", times), as_positive("distance", distance)
        per_degree = np.array([0.185, 0.21, 0.035])
        return cls.of(
            factor * np.array([3700.0, 3150.0, 2250.0]),
            factor * np.degrees(per_degree),
            (0.0, 0.0, -reach),
            "Schiebl et al., Sensors 25 (2025) 4605, doi 10.3390/s25154605",
        )

    @property
    def compliance(self) -> FloatArray:
        """K⁻¹, shape (6, 6)."""
        return np.asarray(np.linalg.inv(self.stiffness))

    def slip(self, wrench: FloatArray, matrices: FloatArray) -> FloatArray:
        """Displacement and rotation vector of a soft cuff against the arm, shape (..., 6), m and rad, arm frame.

        Of first order: compliance times the wrench of a rigid cuff that stays where it is. Both grow beyond that as the
        cuff moves; the split "elastic" finds the equilibrium of the displaced device.

        Parameters
        ----------
        wrench : ndarray
            Of the cuff on the arm, shape (..., 6): force, N, and moment about O, N m, base frame.
        matrices : ndarray
            Poses, shape (..., 3, 3).

        Returns
        -------
        ndarray
            Shape (..., 6).

        Examples
        --------
        >>> cuff = ep.Interface.of(2e3, 10.0, at=[0.0, 0.0, -0.15])
        >>> pull = np.array([0.0, 0.0, 6.0, 0.0, 0.0, 0.0])  # N, along the hanging arm
        >>> (1e3 * cuff.slip(pull, np.eye(3)))[:3].round(3)  # mm
        array([0., 0., 3.])
        """
        force, moment = (np.einsum("...ji,...j->...i", matrices, part) for part in np.split(wrench, 2, axis=-1))
        about = moment - np.cross(np.asarray(self.at), force)
        return np.asarray(np.concatenate([force, about], axis=-1) @ self.compliance.T)

    def mirrored(self) -> Interface:
        """Mirror image in the x-z plane.

        Returns
        -------
        Interface
            Its displacements and forces along y, and rotations and moments about x and z, change their sign.

        Examples
        --------
        >>> harness = ep.Interface.of(5e3, 50.0, at=[-0.1, 0.04, 0.2])
        >>> harness.mirrored().at.tolist()
        [-0.1, -0.04, 0.2]
        """
        return replace(self, stiffness=_MIRROR @ self.stiffness @ _MIRROR, at=np.asarray(self.at) @ MIRROR)


@dataclass(frozen=True)
class Interfaces:
    """What sits on the person. None is rigid: a part that does not move against the body.

    Attributes
    ----------
    harness : Interface or None
        Between torso and base ring. No measured stiffness of one was found in the literature, so sweep it.
    cuff : Interface or None
        Between arm and platform; see :meth:`Interface.upper_arm_cuff`.
    cuff_area : float or None
        Height of the cuff times width of the arm in it, m²: what it presses on from one side. None: not known.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> cuff = ep.Interface.upper_arm_cuff(distance=0.15)
    >>> soft = exo.replace(interfaces=ep.Interfaces(cuff=cuff, cuff_area=0.012))
    >>> pose = exo.pose(60)
    >>> len(soft.reaction(pose).cautions) - len(exo.reaction(pose).cautions)  # a rigid split leaves softness out
    1
    """

    harness: Interface | None = None
    cuff: Interface | None = None
    cuff_area: float | None = None

    def __post_init__(self) -> None:
        set_positive(self, "cuff_area", optional=True)
        if self.cuff_area is not None and self.cuff_area > _LARGEST_AREA:
            raise InvalidInput(f"expected cuff_area in m², at most {_LARGEST_AREA:g}, got {self.cuff_area:g} (cm²?)")
        require_types(self, harness=Interface | None, cuff=Interface | None)

    @property
    def are_rigid(self) -> bool:
        """Whether neither gives way."""
        return self.harness is None and self.cuff is None

    def mirrored(self) -> Interfaces:
        """Mirror image in the x-z plane.

        Returns
        -------
        Interfaces

        Examples
        --------
        >>> left = ep.Interfaces(harness=ep.Interface.of(4e3, 40.0, at=[0.0, 0.05, 0.1]))
        >>> float(left.mirrored().harness.at[1]), left.mirrored().cuff
        (-0.05, None)
        """
        harness, cuff = (own and own.mirrored() for own in (self.harness, self.cuff))
        return Interfaces(harness, cuff, self.cuff_area)


def nothing_gives_way(name: str) -> MissingData:
    """The error of a device without any stiffness; no value of a person's shoulder was found, so none is assumed."""
    return MissingData(
        ["shoulder stiffness, guide, cuff, harness or link that gives way"],
        'split="elastic"',
        name,
        "interfaces=ep.Interfaces(cuff=..., harness=...), shoulder=ep.Shoulder(stiffness=...), guides of limbs or "
        "soft_links; in its file [cuff], [harness], [shoulder], guides or [[soft_links]]",
    )
