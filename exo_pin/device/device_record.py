"""The record of a device: a closed chain that carries an arm, its drives and its springs."""

from __future__ import annotations

import hashlib
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from ..chain import ClosedChain
from ..core.conventions import Side, as_side, other_side, refuse_other_side
from ..core.errors import InvalidInput, MissingData, UnknownName
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, as_finite, as_mapping, as_parts, frozen, require_types, set_fields
from ..design import Arm, Interfaces, Shoulder
from .parts.drives import Brake, Drive, Spring
from .parts.soft_parts import GuidedSlide, SoftLink

#: Placement of the arm's joint or link, m and rad, that is rounding.
_SAME = 1e-9


@checked
@dataclass(frozen=True, eq=False)
class DeviceRecord(Record, ABC):
    """What a :class:`.ChainDevice` is made of; its attributes are described there."""

    chain: ClosedChain
    drives: tuple[Drive, ...] = ()
    springs: tuple[Spring, ...] = ()
    arm: Arm | None = None
    side: Side = "left"
    name: str = "unnamed"
    title: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    shoulder: Shoulder = field(default_factory=Shoulder)
    interfaces: Interfaces = field(default_factory=Interfaces)
    soft_links: tuple[SoftLink, ...] = ()
    brakes: tuple[Brake, ...] = ()
    guided_slides: tuple[GuidedSlide, ...] = ()

    #: No limit of a drive is an estimate.
    estimated = ()
    #: Joints in which limbs turn that resist it with side forces; see :func:`.twisting_device`.
    twists = ()

    @property
    def doubts(self) -> tuple[str, ...]:
        """What was left out of the robot's file and may change forces, in sentences."""
        return self.chain.description.doubts

    def __post_init__(self) -> None:
        require_types(self, chain=ClosedChain, arm=Arm | None, shoulder=Shoulder, interfaces=Interfaces)
        for key, kind in (("drives", Drive), ("brakes", Brake), ("springs", Spring)):
            items = as_parts(key, getattr(self, key), kind)
            for item in items:
                if item.joint is not None and self.chain.velocity_indices([item.joint]).size != 1:
                    raise InvalidInput(f"expected {item.name!r} on a joint of one coordinate, got {item.joint!r}")
            set_fields(self, **{key: items})
        set_fields(self, soft_links=as_parts("soft_links", self.soft_links, SoftLink))
        set_fields(self, guided_slides=as_parts("guided_slides", self.guided_slides, GuidedSlide))
        names = [part.name for part in self.efforts]
        if len(set(names)) != len(names):
            raise InvalidInput(f"expected drives and brakes of different names, got {', '.join(names)}")
        sources = as_mapping("sources", self.sources, "texts")
        set_fields(self, side=as_side(self.side), sources=MappingProxyType(dict(sources)))
        _check_arm(self.chain)
        soft_bodies(self)

    @property
    @abstractmethod
    def holds_alone(self) -> bool:
        """Whether its drives can make every moment about O."""

    @cached_property
    def efforts(self) -> tuple[Drive, ...]:
        """What holds the device: its drives, then its brakes."""
        return (*self.drives, *(brake.as_drive for brake in self.brakes))

    @cached_property
    def gravity(self) -> FloatArray:
        """Shape (3,), m/s², base frame."""
        return frozen(np.array(self.chain.model.gravity.linear))

    @property
    def limbs_are_massless(self) -> bool:
        """False: links have the masses of the chain."""
        return False

    @cached_property
    def radius(self) -> float:
        """Length by which moments are divided, m: the chain's characteristic one."""
        return self.chain.characteristic_length

    @cached_property
    def hash(self) -> str:
        """SHA-256 of model, loops, drives, springs and arm: the same device has the same."""
        own = {
            "model": self.chain.model.saveToString(),
            "loops": repr(replace(self.chain.description, shapes=())),
            "parts": repr((self.drives, self.springs, self.side, *self.brakes)),
            "stiffness": repr((self.interfaces, self.soft_links, self.guided_slides, self.shoulder)),
            "arm": repr(self.arm),
        }
        return hashlib.sha256(json.dumps(own).encode()).hexdigest()

    def unit_of(self, drive: Drive) -> str:
        """Unit of a drive's effort: "N m" in a hinge, else "N".

        Parameters
        ----------
        drive : Drive
            Of this device.

        Returns
        -------
        str

        Examples
        --------
        >>> from exo_pin.device import ChainDevice
        >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
        >>> device.unit_of(device.drives[0])  # of a slide
        'N'
        """
        if drive.joint is None:
            return "N"
        return "N" if self.chain.metres[self.chain.velocity_slice(drive.joint)][0] else "N m"

    @property
    def arm_joint(self) -> str:
        """Name of the arm's joint."""
        return str(self.chain.model.names[self.arm_index])

    @property
    def arm_index(self) -> int:
        """Index of the arm's joint in the model."""
        return arm_index_of(self.chain)

    @property
    def links_mass(self) -> float:
        """Mass of the links that are not welded to the arm, kg."""
        model = self.chain.model
        return math.fsum(model.inertias[i].mass for i in range(1, model.njoints) if i != self.arm_index)

    def require_arm(self, needed_for: str, inertia: bool = False) -> Arm:
        """Return the arm.

        Parameters
        ----------
        needed_for : str
            What for, in the message.
        inertia : bool
            Whether its inertia is needed.

        Returns
        -------
        Arm

        Raises
        ------
        MissingData
            If there is none, or if its inertia is needed and not known.

        Examples
        --------
        >>> from exo_pin.device import ChainDevice
        >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
        >>> round(1e3 * float(device.require_arm("its weight").mass), 2)  # g; Table 5-4
        656.56
        """
        if self.arm is None:
            raise MissingData(
                ["arm mass"], needed_for, self.name, "give a person who wears it (--person 1.75,75,male, or worn_by)"
            )
        if inertia and self.arm.inertia is None:
            raise MissingData(["arm inertia"], needed_for, self.name)
        return self.arm

    def replace(self, **changes: Any) -> Self:
        """A new device with some fields changed.

        Parameters
        ----------
        **changes
            Fields of the class, or ``gravity``, shape (3,), m/s².

        Returns
        -------
        ChainDevice

        Raises
        ------
        UnknownName
            If a name is no field.
        InvalidInput
            If it is another ``side``, which mirrors nothing: see :meth:`mirrored`.

        Examples
        --------
        >>> from exo_pin.device import ChainDevice
        >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
        >>> lost = device.replace(drives=[device.drives[0].idle(), *device.drives[1:]])
        >>> lost.drives[0].upper, lost.limb_count  # N
        (0.0, 3)
        """
        known = {*self.__dataclass_fields__, "gravity"}
        for name in changes:
            if name not in known:
                raise UnknownName("field", name, known)
        refuse_other_side(changes, self.side)
        gravity = changes.pop("gravity", None)
        if gravity is not None:
            changes["chain"] = _with_gravity(changes.get("chain", self.chain), as_finite("gravity", gravity, (3,)))
        return replace(self, **changes)

    def mirrored(self) -> Self:
        """The mirror image in the x-z plane, for the other shoulder.

        Chain, arm, drives, springs, routes, and stiffness of shoulder, links, harness and cuff go with it; all names
        stay. In the same clinical angles the coordinates of drives and springs, efforts and |F_s| are the same, and
        F_s has the other y. Mirrored twice it is the same device.

        Returns
        -------
        ChainDevice

        Raises
        ------
        InvalidInput
            If the chain has a joint whose mirror image is not known; see :meth:`ClosedChain.mirrored`.

        Examples
        --------
        >>> from exo_pin.device import ChainDevice
        >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
        >>> right = device.mirrored()
        >>> right.side, (1e3 * right.arm.centre_of_mass).round(1)  # mm; of the left one at y = 22.7
        ('right', array([  -2.6,  -22.7, -189.7]))
        """
        return replace(
            self,
            chain=self.chain.mirrored(),
            drives=tuple(drive.mirrored() for drive in self.drives),
            springs=tuple(spring.mirrored() for spring in self.springs),
            arm=None if self.arm is None else self.arm.mirrored(),
            side=other_side(self.side),
            shoulder=self.shoulder.mirrored(),
            interfaces=self.interfaces.mirrored(),
            soft_links=tuple(soft.mirrored() for soft in self.soft_links),
        )


def _with_gravity(chain: ClosedChain, gravity: FloatArray) -> ClosedChain:
    """The chain in another field of gravity, shape (3,), m/s²."""
    model, described = chain.model.copy(), chain.description
    model.gravity.linear = gravity
    root = replace(described.root, gravity=tuple(gravity.tolist()))
    return type(chain)(model, replace(described, root=root))


def soft_bodies(device: DeviceRecord) -> dict[int, str]:
    """Joints whose bodies give way, with the names of the links.

    Raises
    ------
    InvalidInput
        If a link that gives way is part of the arm or of the torso, or two are one body.
    """
    state, found = device.chain._state, dict[int, str]()
    for soft in device.soft_links:
        joint = int(state.model.frames[state.frame_index(soft.link)].parentJoint)
        if joint in (0, device.arm_index):
            body = "torso" if joint == 0 else "arm"
            raise InvalidInput(f"expected a link that moves on its own, got {soft.link!r}, which is part of the {body}")
        if joint in found:
            raise InvalidInput(f"{soft.link!r} and {found[joint]!r} are one body: give it one spring")
        found[joint] = soft.link
    return found


def arm_index_of(chain: ClosedChain) -> int:
    """Index of the joint that the arm hangs on, in the model.

    Raises
    ------
    InvalidInput
        If the roles name no arm.
    """
    arm = chain.roles.arm
    if arm is None:
        raise InvalidInput(f"robot {chain.description.name!r} names no arm among its roles: [roles] arm = LINK")
    return int(chain.model.frames[chain._state.frame_index(arm)].parentJoint)


def carries_arm(chain: ClosedChain) -> bool:
    """Whether a device can be made of a chain."""
    try:
        _check_arm(chain)
    except InvalidInput:
        return False
    return True


def _check_arm(chain: ClosedChain) -> None:
    """Raise unless the arm hangs on the torso by a spherical joint, with the arm's axes."""
    name, model = chain.description.name, chain.model
    index = arm_index_of(chain)
    kind = model.joints[index].shortname() if index else "none"
    if kind != "JointModelSpherical" or model.parents[index] != 0:
        raise InvalidInput(
            f"expected the arm {chain.roles.arm!r} of robot {name!r} on a spherical joint of the torso at the "
            f"shoulder's centre, got joint {model.names[index]!r} ({kind}): in a URDF the arm is the root link, with "
            '[root] joint = "spherical"'
        )
    frame = model.frames[chain._state.frame_index(str(chain.roles.arm))]
    for what, place in (("joint", model.jointPlacements[index].rotation), ("link", frame.placement.rotation)):
        if np.abs(place - np.eye(3)).max() > _SAME:
            raise InvalidInput(f"expected the axes of the arm's {what} along those of the world at rest, got {place}")
