"""The part that moves about the shoulder: the person's arm and the moving part of the device."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.conventions import MIRROR
from ..core.errors import InvalidInput, MissingData
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, as_finite, as_inertia, as_positive, frozen, set_fields, set_positive
from .wearer import Wearer

#: A centre of mass farther than this from O, m, is taken for millimetres.
_FARTHEST_CENTRE = 3.0
#: A heavier arm, kg, is taken for grams.
_HEAVIEST = 100.0


@checked
@dataclass(frozen=True, eq=False)
class Arm(Record):
    """Mass properties of a rigid body that turns about O, in the arm frame {O_B}.

    Arms add: ``person + device`` is the moving part of a worn exoskeleton, and remembers which part is whose.

    Attributes
    ----------
    mass : float
        kg, above zero.
    centre_of_mass : ndarray
        Shape (3,), m, in {O_B}.
    inertia : ndarray or None
        Shape (3, 3), kg m², about the centre of mass, axes of {O_B}, as in URDF and Pinocchio (products of
        inertia are the negative of the integrals). None where it is not known: then a motion raises MissingData.
    device : bool
        Whether the body belongs to the device and not to the person.
    body_mass : float or None
        Mass of the whole person, kg, where it is known.
    wearer : Wearer or None
        Whose arm it is, where that is known: the shape of the body follows from it.
    parts : tuple of Arm
        Summands of a sum; a single body is its own only part.

    Raises
    ------
    InvalidInput
        If the mass is not positive, or no body has such an inertia.

    Examples
    --------
    >>> rod = ep.Arm(2.0, [0.0, 0.0, -0.3], np.diag([0.06, 0.06, 0.001]))
    >>> round(float(rod.mass * 9.81 * 0.3), 2)  # N m, what holding it level takes
    5.89
    """

    mass: float
    centre_of_mass: FloatArray
    inertia: FloatArray | None = None
    device: bool = False
    body_mass: float | None = None
    wearer: Wearer | None = None
    parts: tuple[Arm, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_positive(self, "mass")
        if self.mass > _HEAVIEST:
            raise InvalidInput(f"expected mass in kg, got {self.mass:g} (grams?)")
        centre = as_finite("centre_of_mass", self.centre_of_mass, (3,))
        if np.linalg.norm(centre) > _FARTHEST_CENTRE:
            raise InvalidInput(f"expected centre_of_mass in m, got {centre} (millimetres?)")
        set_fields(self, centre_of_mass=centre)
        if self.inertia is not None:
            tensor = as_inertia("inertia", self.inertia)
            if tensor.max() > self.mass * _FARTHEST_CENTRE**2:
                raise InvalidInput(f"expected inertia in kg m², got up to {tensor.max():.3g} (g mm²?)")
            set_fields(self, inertia=tensor)
        set_positive(self, "body_mass", optional=True)
        if self.wearer is not None and not isinstance(self.wearer, Wearer):
            raise InvalidInput(f"expected wearer to be a Wearer, got {type(self.wearer).__name__}")
        # A changed copy is a body of its own: only a sum has parts.
        set_fields(self, parts=(self,))

    @classmethod
    def from_inertia_about_origin(
        cls, mass: float, centre_of_mass: ArrayLike, inertia: ArrayLike, device: bool = False
    ) -> Arm:
        """An arm whose inertia tensor is given about O, as in Table 5-4.

        Parameters
        ----------
        mass : float
            kg.
        centre_of_mass : array_like
            Shape (3,), m, in {O_B}.
        inertia : array_like
            Shape (3, 3), kg m², about O, axes of {O_B}. A tensor: its off-diagonal entries are the negative of
            the integrals ∫xy dm that CAD programs print.
        device : bool
            Whether the body belongs to the device.

        Returns
        -------
        Arm

        Notes
        -----
        Source: thesis Table 5-4.

        Examples
        --------
        >>> arm = ep.Arm.from_inertia_about_origin(1.0, [0.0, 0.0, -0.2], np.diag([0.05, 0.05, 0.001]))
        >>> arm.inertia.diagonal().round(3)  # about the centre of mass: 0.05 - 1.0 × 0.2²
        array([0.01 , 0.01 , 0.001])
        """
        mass = as_positive("mass", mass)
        centre = as_finite("centre_of_mass", centre_of_mass, (3,))
        about_origin = as_finite("inertia", inertia, (3, 3))
        return cls(mass, centre, about_origin - _parallel_axis(mass, centre), device=device)

    @classmethod
    def from_anthropometry(
        cls,
        height: float,
        mass: float,
        sex: str,
        elbow_flexion: float = 0.0,
        payload: float = 0.0,
        degrees: bool = False,
    ) -> Arm:
        """A person's arm from height and mass, by the segment table of de Leva (1996).

        The parameters are those of :class:`exo_pin.Wearer`, which says what is raised.

        Parameters
        ----------
        height, mass, sex, elbow_flexion, payload, degrees
            As there; elbow straight and hand empty if left out.

        Returns
        -------
        Arm
            With ``wearer`` and ``body_mass`` set.

        Examples
        --------
        >>> arm = ep.Arm.from_anthropometry(1.75, 75, sex="male", payload=2.0)
        >>> round(float(arm.mass), 2)  # kg, 2 of them in the hand
        5.71
        """
        return cls.of_wearer(Wearer(height, mass, sex, elbow_flexion=elbow_flexion, payload=payload, degrees=degrees))

    @classmethod
    def of_wearer(cls, wearer: Wearer) -> Arm:
        """The arm of a person of given size, whose elbow is bent as given.

        Parameters
        ----------
        wearer : Wearer
            The person.

        Returns
        -------
        Arm

        Raises
        ------
        InvalidInput
            If ``wearer`` is none.

        Examples
        --------
        >>> arm = ep.Arm.of_wearer(ep.Wearer(1.75, 75, "male"))
        >>> round(float(arm.mass / 75.0), 4)  # of the body: upper arm, forearm and hand
        0.0494
        """
        if not isinstance(wearer, Wearer):
            raise InvalidInput(f"expected wearer to be a Wearer, got {type(wearer).__name__}")
        bodies = [cls(*segment, body_mass=wearer.mass) for segment in wearer.segments()]
        return replace(_combined(bodies), wearer=wearer)

    @cached_property
    def inertia_about_origin(self) -> FloatArray:
        """Shape (3, 3), kg m², about O, axes of {O_B}.

        Raises
        ------
        MissingData
            If the inertia is not known.
        """
        if self.inertia is None:
            raise MissingData(["arm inertia"], "the inertia about the shoulder")
        return frozen(self.inertia + _parallel_axis(self.mass, self.centre_of_mass))

    @property
    def person(self) -> Arm | None:
        """The part of the arm that belongs to the person; None if there is none."""
        own = [part for part in self.parts if not part.device]
        return _combined(own) if own else None

    def __add__(self, other: object) -> Arm:
        if not isinstance(other, Arm):
            return NotImplemented
        return _combined([*self.parts, *other.parts])

    def with_device_of(self, worn: Arm | None) -> Arm:
        """This arm with what a device moves besides on another arm.

        Parameters
        ----------
        worn : Arm or None
            An arm with what a device moves; None for nothing.

        Returns
        -------
        Arm

        Examples
        --------
        >>> man = ep.Arm.from_anthropometry(1.75, 75, sex="male")
        >>> worn = man.with_device_of(ep.load("prototype").arm)
        >>> round(float(worn.mass - man.mass), 3)  # kg
        0.657
        """
        return _combined([*self.parts, *(part for part in (() if worn is None else worn.parts) if part.device)])

    def weight_moment(self, gravity: FloatArray) -> float:
        """Greatest moment of the weight about the shoulder's centre, m g |c|, of all poses.

        Parameters
        ----------
        gravity : ndarray
            Shape (3,), m/s².

        Returns
        -------
        float
            N m.

        Examples
        --------
        >>> arm = ep.Arm(2.0, [0.0, 0.0, -0.3])
        >>> round(arm.weight_moment(np.array([0.0, 0.0, -9.81])), 3)
        5.886
        """
        gravity = as_finite("gravity", gravity, (3,))
        return float(self.mass * np.linalg.norm(gravity) * np.linalg.norm(self.centre_of_mass))

    def mirrored(self) -> Arm:
        """Mirror image in the x-z plane, for the other side of the body.

        Returns
        -------
        Arm

        Examples
        --------
        >>> arm = ep.load("prototype").arm
        >>> (1e3 * np.array([each.centre_of_mass for each in (arm, arm.mirrored())])).round(1)  # mm; Table 5-4
        array([[  -2.6,   22.7, -189.7],
               [  -2.6,  -22.7, -189.7]])
        """
        return _combined(
            replace(
                part,
                centre_of_mass=part.centre_of_mass @ MIRROR,
                inertia=None if part.inertia is None else MIRROR @ part.inertia @ MIRROR,
            )
            for part in self.parts
        )


def _parallel_axis(mass: float, offset: FloatArray) -> FloatArray:
    """Inertia about O of a point mass at ``offset``."""
    return mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))


def _combined(bodies: Iterable[Arm]) -> Arm:
    parts = tuple(bodies)
    if len(parts) == 1:
        return parts[0]
    mass = math.fsum(part.mass for part in parts)
    centre = sum((part.mass * part.centre_of_mass for part in parts), np.zeros(3)) / mass
    terms: list[Any] = []
    for part in parts:
        terms += [part.inertia, _parallel_axis(part.mass, part.centre_of_mass - centre)]
    known = {part.body_mass for part in parts if part.body_mass is not None}
    wearers = [part.wearer for part in parts if part.wearer is not None]
    if len(known) > 1:
        raise InvalidInput(f"these arms belong to persons of different body mass: {sorted(known)} kg")
    total = Arm(
        mass,
        centre,
        None if any(term is None for term in terms) else sum(terms, np.zeros((3, 3))),
        device=all(part.device for part in parts),
        body_mass=known.pop() if known else None,
        wearer=wearers[0] if wearers else None,
    )
    set_fields(total, parts=parts)
    return total
