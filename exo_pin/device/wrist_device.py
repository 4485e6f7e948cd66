"""A wrist of limbs as a device: its record, its own chain, and the closed forms that answer faster."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..chain import ClosedChain
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import FloatArray, as_choice, as_finite
from ..design import Limb, Mechanism, WristGeometry
from ..design.io.mechanism_files import mechanism_hash
from ..design.parameters.changes import check_parameters, dimensions_of, value_of, with_values
from ..design.parameters.names import DesignParameter, parameter
from ..wrist.clearance.clearance import BodyShape
from ..wrist.clearance.gaps import Gaps, LimbGaps
from ..wrist_chain import mechanism_urdf
from .chain_device import ChainDevice
from .parts.drives import Brake, Drive
from .parts.soft_parts import GuidedSlide

__all__ = ["WristDevice", "as_device"]


@checked
@dataclass(frozen=True, eq=False)
class WristDevice(Mechanism):
    """The kind of device whose limbs reach from torso to arm and meet in one centre; see :class:`exo_pin.Mechanism`.

    Its closed forms answer a question in place of its chain (:meth:`accelerate`); what they answer is what the chain
    does.

    Examples
    --------
    >>> from exo_pin.device import WristDevice
    >>> device = WristDevice.of(ep.load("prototype").mechanism)
    >>> device.limb_count, device.as_chain().limb_count
    (3, 3)
    """

    @classmethod
    def of(cls, record: Mechanism) -> WristDevice:
        """The device of a wrist's record; of the same record the same one.

        Parameters
        ----------
        record : Mechanism
            The record.

        Returns
        -------
        WristDevice

        Examples
        --------
        >>> from exo_pin.device import WristDevice
        >>> WristDevice.of(ep.load("prototype").mechanism).name
        'prototype'
        """
        return record if type(record) is cls else _made_once(record)

    @property
    def brakes(self) -> tuple[Brake, ...]:
        """None: a limb that is locked is a drive."""
        return ()

    @property
    def drives(self) -> tuple[Limb, ...]:
        """The limbs: each holds by its tension."""
        return self.limbs

    @property
    def efforts(self) -> tuple[Limb, ...]:
        """The limbs: their tensions hold the device."""
        return self.limbs

    @property
    def holds_alone(self) -> bool:
        """Whether the limbs hold the arm, away from singular poses: those of a wrist do."""
        return True

    @property
    def links_mass(self) -> float:
        """Zero: the masses of limbs are no part of what moves with the arm."""
        return 0.0

    @property
    def cuff_is_known(self) -> bool:
        """Whether it is known where the cuff is: it carries the joints B_i."""
        return True

    @cached_property
    def hash(self) -> str:
        """SHA-256 of its design file: the same design has the same."""
        return mechanism_hash(self)

    @cached_property
    def chain(self) -> ClosedChain:
        """The closed chain of limbs and ball joint, without masses that the record has not."""
        return ClosedChain.from_urdf(*mechanism_urdf(self, part="whole"))

    def as_chain(self) -> ChainDevice:
        """The same device as any chain with drives, without its closed forms.

        Returns
        -------
        ChainDevice
            Limbs with the actuators and strokes of the record, side forces by its guides, harness, cuff and shoulder.

        Examples
        --------
        >>> from exo_pin.device import WristDevice
        >>> exo = ep.load("four-cables")
        >>> case = ep.Case(exo.pose(60, 20))
        >>> ways = [ep.solve(device, case) for device in (exo, WristDevice.of(exo.mechanism).as_chain())]
        >>> [round(float(answer.magnitude), 6) for answer in ways]
        [47.04512, 47.04512]
        """
        return self._as_chain

    @cached_property
    def _as_chain(self) -> ChainDevice:
        roles, chain = self.chain.roles.limbs, self.chain
        ends = self.geometry.platform_points @ self.geometry.neutral.as_matrix().T
        # Slides are zero in the neutral pose.
        lengths = np.linalg.norm(ends - self.geometry.base_points, axis=1).tolist()
        drives = tuple(
            Drive(role.slide, role.slide, pulls=True, actuator=limb.actuator, stroke=limb.stroke, zero_length=length)
            for role, limb, length in zip(roles, self.limbs, lengths, strict=True)
        )
        pairs = zip(roles, self.limbs, strict=True)
        slides = [GuidedSlide(role.slide, limb.guide) for role, limb in pairs if limb.kind == "UPU"]
        return ChainDevice(
            chain, drives, arm=self.arm, side=self.side, name=self.name, title=self.title, sources=self.sources,
            shoulder=self.shoulder, interfaces=self.interfaces, guided_slides=tuple(slides),
        )  # fmt: skip

    def accelerate(self, question: str) -> Mechanism | None:
        """The record, whose closed forms answer every question.

        Parameters
        ----------
        question : str
            What is asked.

        Returns
        -------
        Mechanism or None

        Examples
        --------
        >>> from exo_pin.device import WristDevice
        >>> device = WristDevice.of(ep.load("prototype").mechanism)
        >>> device.accelerate("forces") is device
        True
        """
        return self

    def parameters(self, names: Iterable[Any]) -> tuple[DesignParameter, ...]:
        """Parameters of the record, which may be changed together.

        Parameters
        ----------
        names : iterable of str
            See :mod:`exo_pin.design.parameters.names`.

        Returns
        -------
        tuple of DesignParameter

        Raises
        ------
        UnknownName
            If there is none of a name.
        InvalidInput
            If the design has no such parameter, or they are of circles and of single joints both.

        Examples
        --------
        >>> device = ep.load("prototype").device
        >>> [own.kind for own in device.parameters(["r_A_mm", "payload"])]
        ['length', 'mass']
        """
        found = tuple(map(parameter, names))
        check_parameters(self, found)
        return found

    def value_of(self, named: DesignParameter) -> float | None:
        """Value of a dimension; of several limbs the mean.

        Parameters
        ----------
        named : DesignParameter
            Of :meth:`parameters`.

        Returns
        -------
        float or None
            SI; None where it is not known.

        Examples
        --------
        >>> device = ep.load("prototype").device
        >>> round(device.value_of(device.parameters(["r_B_mm"])[0]), 3)  # m
        0.119
        """
        return value_of(self, named)

    def with_values(self, values: Mapping[DesignParameter, Any], payload_at: ArrayLike | None = None) -> WristDevice:
        """The design with other values of its parameters.

        Parameters
        ----------
        values : mapping of DesignParameter to value
            SI.
        payload_at : array_like, optional
            Shape (3,), m, in the arm frame: where a ``payload`` is held.

        Returns
        -------
        WristDevice

        Examples
        --------
        >>> device = ep.load("prototype").device
        >>> (radius,) = device.parameters(["r_B_mm"])
        >>> device.with_values({radius: 0.11}).geometry.circles.r_B  # m
        0.11
        """
        return with_values(self, values, payload_at)  # type: ignore[return-value]

    def dimensions(self) -> dict[str, float]:
        """Circles of the joints, or else each joint, and what is known of lengths of actuators.

        Returns
        -------
        dict of str to float
            SI; each name ends in its unit. See :mod:`exo_pin.design.parameters.names`.

        Examples
        --------
        >>> device = ep.load("prototype").device
        >>> {name: round(value, 3) for name, value in device.dimensions().items() if name.startswith("r_")}  # m
        {'r_A_m': 0.136, 'r_B_m': 0.119}
        """
        return dimensions_of(self)

    def with_dimensions(self, **values: float) -> WristDevice:
        """The design with other values of some dimensions.

        Parameters
        ----------
        **values
            By the names of :meth:`dimensions`, or with mm and deg in the place of m and rad.

        Returns
        -------
        WristDevice

        Examples
        --------
        >>> ep.load("prototype").device.with_dimensions(r_B_mm=110.0).geometry.circles.r_B  # m
        0.11
        """
        named = self.parameters(values)
        return self.with_values({own: own.in_si(value) for own, value in zip(named, values.values(), strict=True)})

    def places(self) -> dict[str, FloatArray]:
        """Joint centres A_i in the base frame and B_i in the arm frame.

        Returns
        -------
        dict of str to ndarray
            Shape (3,) each, m, by the names ``"A[1]"``, ..., ``"B[1]"``, ...

        Examples
        --------
        >>> list(ep.load("prototype").device.places())
        ['A[1]', 'A[2]', 'A[3]', 'B[1]', 'B[2]', 'B[3]']
        """
        ends = {"A": self.geometry.base_points, "B": self.geometry.platform_points}
        return {f"{end}[{i}]": np.array(point) for end, points in ends.items() for i, point in enumerate(points, 1)}

    def with_place(self, name: str, point: FloatArray) -> WristDevice:
        """The design with one joint centre elsewhere.

        Parameters
        ----------
        name : str
            Of :meth:`places`.
        point : ndarray
            Shape (3,), m.

        Returns
        -------
        WristDevice

        Raises
        ------
        UnknownName
            If there is no such joint centre.

        Examples
        --------
        >>> device = ep.load("prototype").device
        >>> device.with_place("B[2]", np.array([0.1, 0.0, -0.2])).geometry.platform_points[1]
        array([ 0.1,  0. , -0.2])
        """
        name, point = as_choice("place", name, self.places()), as_finite("point", point, (3,))
        points = {"A": np.array(self.geometry.base_points), "B": np.array(self.geometry.platform_points)}
        points[name[0]][int(name[2:-1]) - 1] = point
        return self.replace(geometry=WristGeometry(points["A"], points["B"]))

    def stiffened(self, parts: str, more: float) -> WristDevice | None:
        """The device with some parts so many times as stiff.

        Parameters
        ----------
        parts : {"guides", "links"}
            Which.
        more : float
            Factor.

        Returns
        -------
        WristDevice or None
            None if all of them are rigid.

        Examples
        --------
        >>> print(ep.load("four-cables").device.stiffened("guides", 2.0))
        None
        """
        if parts == "links" or all(limb.guide is None for limb in self.limbs):
            return None
        limbs = (replace(limb, guide=limb.guide and limb.guide.times(more)) for limb in self.limbs)
        return self.replace(limbs=tuple(limbs))

    def moment_of_wearer(self, f: FloatArray) -> FloatArray:
        """Zero: the limbs hold the arm.

        Parameters
        ----------
        f : ndarray
            Tensions of an answer, shape (N, n).

        Returns
        -------
        ndarray
            Shape (N, 3), N m.

        Examples
        --------
        >>> from exo_pin.device import WristDevice
        >>> WristDevice.of(ep.load("prototype").mechanism).moment_of_wearer(np.ones((1, 3)))
        array([[0., 0., 0.]])
        """
        return np.zeros((len(np.atleast_1d(f)), 3))

    def gaps(
        self,
        matrices: FloatArray,
        offset: tuple[FloatArray, FloatArray] | None = None,
        placed: Any = None,
        body: BodyShape | None = None,
        radius: float | None = None,
    ) -> Gaps:
        """Gaps of the limbs to the wearer and to one another in N poses.

        Parameters
        ----------
        matrices : ndarray
            Orientations of the arm, shape (N, 3, 3).
        offset : tuple of ndarray, optional
            Where the device's centre lies from the shoulder's, held by the base and carried by the cuff, m.
        placed
            Of devices with joints of their own; none here.
        body : BodyShape, optional
            What to keep clear of; the body of who wears it if left out.
        radius : float, optional
            Of all limbs, m; that of each one's family if left out.

        Returns
        -------
        Gaps

        Examples
        --------
        >>> from exo_pin.device import WristDevice
        >>> WristDevice.of(ep.load("prototype").mechanism).gaps(np.eye(3)[None]).unknown
        ('who wears it (worn_by, --person)',)
        """
        return LimbGaps(self, matrices, offset, body, radius)


@lru_cache(maxsize=256)
def _made_once(record: Mechanism) -> WristDevice:
    """Records are compared by identity."""
    return WristDevice.made_of(**{item.name: getattr(record, item.name) for item in fields(record)})


def as_device(thing: Any) -> Any:
    """The device of a ShoulderExo, of the record of a wrist, or the device itself.

    Parameters
    ----------
    thing : ShoulderExo, Device, Mechanism or EquilibriumModel
        What is asked.

    Returns
    -------
    Device

    Raises
    ------
    InvalidInput
        If it is none.

    Examples
    --------
    >>> from exo_pin.device import as_device
    >>> as_device(ep.load("prototype")).name
    'prototype'
    """
    # A face has it as an attribute; any other object is asked for names of devices alone.
    own = vars(thing).get("device", thing) if hasattr(thing, "__dict__") else thing
    if hasattr(own, "accelerate"):
        return own
    # A robot without an arm has no device, and says why it has none.
    own = getattr(own, "device", own)
    own = getattr(own, "mechanism", own)
    if isinstance(own, Mechanism):
        return WristDevice.of(own)
    raise InvalidInput(f"expected device to be of type ShoulderExo or Device, got {type(thing).__name__}")
