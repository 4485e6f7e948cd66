"""A wrist of limbs as a device: its record, its own chain, and the closed forms that answer faster."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from ..chain import ClosedChain
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import FloatArray
from ..design import Limb, Mechanism
from ..design.io.mechanism_files import mechanism_hash
from ..wrist.clearance.clearance import BodyShape
from ..wrist.clearance.gaps import Gaps, LimbGaps
from ..wrist_chain import mechanism_urdf
from .chain_device import ChainDevice
from .parts.brakes import Brake
from .parts.drives import Drive
from .parts.guided_slides import GuidedSlide

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
        return np.zeros((len(f), 3))

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
