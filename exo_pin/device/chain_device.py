"""A device as a closed chain that carries an arm: the record that stands beside :class:`exo_pin.Mechanism`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..chain import ClosedChain
from ..core.conventions import Side, as_side
from ..core.errors import InvalidInput, MissingData, UnknownName
from ..core.errors.checked import checked
from ..core.fields import set_fields
from ..core.records import Record
from ..core.tables import enumerated
from ..core.validation import FloatArray, frozen, require_type
from ..design import Arm, Interfaces, Shoulder
from .parts.drives import Drive, Spring

__all__ = ["WEARER", "ChainDevice"]

#: Placement of the arm's joint or link, m and rad, that is rounding.
_SAME = 1e-9
#: What a device without drives about some axis needs of its wearer, in the order of the base frame's axes.
WEARER = ("wearer about x", "wearer about y", "wearer about z")


@checked
@dataclass(frozen=True, eq=False)
class ChainDevice(Record):
    """A closed chain with an arm in it, the drives that hold it, and its springs.

    The arm is a link that hangs on the torso by a spherical joint at the shoulder's centre O. Its axes are {O_B}: at
    zero of that joint the arm hangs, and the world's axes are {O_A}. O is where that joint is; forces and moments are
    about it. Everything else is the device, whatever its joints and loops are.

    Attributes
    ----------
    chain : ClosedChain
        The device on the arm, loops closed at some configuration. Its roles name the arm and the shoulder's joint.
    drives : tuple of Drive
        Those that hold the arm.
    springs : tuple of Spring
        Springs with laws of their own; those of the chain's joints count besides.
    arm : Arm or None
        What the arm's link weighs, in the place of the chain's data; None where it has no mass.
    side : {"left", "right"}
        Shoulder that it is for.
    name, title : str
        Short name and a line of description.
    sources : mapping of str to str
        What each part was taken from.
    shoulder : Shoulder
        The ball joint at O.
    interfaces : Interfaces
        Stiffness of harness and cuff; rigid if left out. They give way in the split "elastic".

    Raises
    ------
    InvalidInput
        If the arm does not hang on a spherical joint, or its axes are others.
    UnknownName
        If a drive or spring names a joint or link that the chain has not.
    """

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

    #: No limit of a drive is an estimate.
    estimated = ()

    def __post_init__(self) -> None:
        require_type("chain", self.chain, ClosedChain)
        require_type("arm", self.arm, Arm | None)
        require_type("shoulder", self.shoulder, Shoulder)
        for key, kind in (("drives", Drive), ("springs", Spring)):
            items = tuple(getattr(self, key))
            for item in items:
                require_type(key, item, kind)
                if item.joint is not None and self.chain.velocity_indices([item.joint]).size != 1:
                    raise InvalidInput(f"expected {item.name!r} on a joint of one coordinate, got {item.joint!r}")
            set_fields(self, **{key: items})
        names = [drive.name for drive in self.drives]
        if len(set(names)) != len(names):
            raise InvalidInput(f"expected drives of different names, got {', '.join(names)}")
        set_fields(self, side=as_side(self.side), sources=MappingProxyType(dict(self.sources)))
        _check_arm(self.chain)

    @classmethod
    def from_chain(cls, chain: ClosedChain, side: str = "left") -> ChainDevice:
        """The device that the roles of a chain describe; limits of its drives are those of the model's joints.

        Raises
        ------
        InvalidInput
            If its roles name no arm, or :class:`ChainDevice` does not take it.
        """
        require_type("chain", chain, ClosedChain)
        model, roles = chain.model, chain.roles
        if roles.arm is None:
            raise InvalidInput(f"robot {chain.description.name!r} names no arm among its roles: [roles] arm = LINK")
        slides = {limb.slide for limb in roles.limbs}
        actuated = dict.fromkeys((*roles.actuated, *(limb.slide for limb in roles.limbs)))
        drives = tuple(_drive_of(model, joint, joint in slides) for joint in actuated)
        names = {"side": as_side(side), "name": chain.description.name}
        return cls(chain, drives, arm=_arm_of(chain), **names)  # type: ignore[arg-type]

    # What the reaction room asks of any device

    @property
    def gravity(self) -> FloatArray:
        """Shape (3,), m/s², base frame."""
        return np.array(self.chain.model.gravity.linear)

    @property
    def limbs(self) -> tuple[Drive, ...]:
        """The drives, and for a device that does not hold the arm by itself the wearer's moments besides."""
        if self.holds_alone:
            return self.drives
        own = (Drive(name, joint=self.arm_joint, lower=0.0, upper=0.0) for name in WEARER)
        return (*self.drives, *own)

    @property
    def limb_count(self) -> int:
        """Number of efforts p that an answer lists."""
        return len(self.drives) if self.holds_alone else len(self.drives) + len(WEARER)

    @cached_property
    def structure(self) -> Structure:
        """What the chain can do in general, away from singular poses."""
        from .equilibrium import structure_of

        return structure_of(self)

    @property
    def holds_alone(self) -> bool:
        """Whether its drives can make every moment about O; else the wearer has to make what is left."""
        return self.structure.moments == 3

    @cached_property
    def is_upu(self) -> NDArray[np.bool_]:
        """Shape (p,): true for as many entries as F_s has directions that equilibrium does not determine."""
        return frozen(np.arange(self.limb_count) < self.structure.open_directions)

    @property
    def limbs_are_massless(self) -> bool:
        """False: links have the masses of the chain."""
        return False

    @property
    def radius(self) -> float:
        """Length by which moments are divided, m: the chain's characteristic one."""
        return self.chain.characteristic_length

    @property
    def drive_units(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of the effort of each entry of f."""
        own = [(drive.name, self.unit_of(drive)) for drive in self.drives]
        return (*own, *((name, "N m") for name in (() if self.holds_alone else WEARER)))

    @cached_property
    def hash(self) -> str:
        """SHA-256 of model, loops, drives, springs and arm: the same device has the same."""
        own = {
            "model": self.chain.model.saveToString(),
            "loops": repr(replace(self.chain.description, shapes=())),
            "parts": repr((self.drives, self.springs, self.side)),
            "arm": repr(self.arm),
        }
        return hashlib.sha256(json.dumps(own).encode()).hexdigest()

    @property
    def force_words(self) -> tuple[str, str]:
        """What f and g are."""
        return "efforts of the drives f", "forces of the structure g"

    def unit_of(self, drive: Drive) -> str:
        """Unit of a drive's effort: "N m" in a hinge, else "N"."""
        if drive.joint is None:
            return "N"
        return "N" if self.chain.metres[self.chain.velocity_slice(drive.joint)][0] else "N m"

    def moment_of_wearer(self, f: FloatArray) -> FloatArray:
        """Moment that the wearer makes about O, shape (N, 3), N m, base frame; zero where the drives hold the arm."""
        return np.zeros((len(f), 3)) if self.holds_alone else f[:, len(self.drives) :]

    def limb_words(self, numbers: Sequence[int]) -> str:
        """Drives of these numbers, counted from 1, by their names."""
        return enumerated(self.limbs[number - 1].name for number in numbers)

    @property
    def arm_joint(self) -> str:
        """Name of the arm's joint."""
        return str(self.chain.model.names[self.arm_index])

    @property
    def arm_index(self) -> int:
        """Index of the arm's joint in the model."""
        return _arm_index(self.chain)

    def require_arm(self, needed_for: str, inertia: bool = False) -> Arm:
        """Return the arm.

        Raises
        ------
        MissingData
            If there is none, or if its inertia is needed and not known.
        """
        if self.arm is None:
            raise MissingData(["arm mass"], needed_for, self.name, "give it a person who wears it (worn_by)")
        if inertia and self.arm.inertia is None:
            raise MissingData(["arm inertia"], needed_for, self.name)
        return self.arm

    def replace(self, **changes: Any) -> ChainDevice:
        """A new device with some fields changed.

        Raises
        ------
        UnknownName
            If a name is no field.
        """
        known = set(self.__dataclass_fields__)
        for name in changes:
            if name not in known:
                raise UnknownName("field", name, known)
        return replace(self, **changes)


@dataclass(frozen=True)
class Structure:
    """What a device can do in general.

    Attributes
    ----------
    moments : int
        Independent moments about O that its drives make, 0 to 3.
    open_directions : int
        Directions of F_s that equilibrium does not determine, 0 to 3.
    self_stresses : int
        All reactions that equilibrium does not determine, forces within the device among them.
    idle : int
        Freedoms of the chain that leave the arm where it is.
    """

    moments: int
    open_directions: int
    self_stresses: int
    idle: int


def _arm_index(chain: ClosedChain) -> int:
    return int(chain.model.frames[chain._state.frame_index(str(chain.roles.arm))].parentJoint)


def _check_arm(chain: ClosedChain) -> None:
    """Raise unless the arm hangs on the torso by a spherical joint, with the arm's axes."""
    name, model = chain.description.name, chain.model
    if chain.roles.arm is None:
        raise InvalidInput(f"robot {name!r} names no arm among its roles: [roles] arm = LINK")
    index = _arm_index(chain)
    kind = model.joints[index].shortname() if index else "none"
    if kind != "JointModelSpherical" or model.parents[index] != 0:
        raise InvalidInput(
            f"expected the arm {chain.roles.arm!r} of robot {name!r} on a spherical joint of the torso at the "
            f"shoulder's centre, got joint {model.names[index]!r} ({kind}): in a URDF the arm is the root link, with "
            '[root] joint = "spherical"'
        )
    frame = model.frames[chain._state.frame_index(chain.roles.arm)]
    for what, place in (("joint", model.jointPlacements[index].rotation), ("link", frame.placement.rotation)):
        if np.abs(place - np.eye(3)).max() > _SAME:
            raise InvalidInput(f"expected the axes of the arm's {what} along those of the world at rest, got {place}")


def _arm_of(chain: ClosedChain) -> Arm | None:
    """The arm's mass properties: the arm's own link is the person's, links that are welded to it are the device's."""
    model, index = chain.model, _arm_index(chain)
    whole = model.inertias[index]
    if whole.mass <= 0.0:
        return None
    own, welded = pin.Inertia(whole), list[Arm]()
    for frame in model.frames:
        # Pinocchio keeps the inertia of a welded link in the frame of its weld.
        if frame.parentJoint == index and frame.type == pin.FrameType.FIXED_JOINT and frame.inertia.mass > 0.0:
            part = frame.placement.act(frame.inertia)
            welded.append(Arm(part.mass, part.lever, part.inertia, device=True))
            own = own - part
    if own.mass <= 1e-9 * whole.mass:
        return Arm(whole.mass, whole.lever, whole.inertia)
    return sum(welded, Arm(own.mass, own.lever, own.inertia))


def _drive_of(model: pin.Model, joint: str, pulls: bool) -> Drive:
    """The drive of a joint, with the limits that the model has for it."""
    index = model.getJointId(joint)
    if model.nvs[index] != 1:
        raise InvalidInput(f"expected a drive in a joint of one coordinate, got {joint!r} with {model.nvs[index]}")
    q, v = model.idx_qs[index], model.idx_vs[index]
    low, high = float(model.lowerEffortLimit[v]), float(model.upperEffortLimit[v])
    lower, upper = (-high, -low) if pulls else (low, high)
    ends = float(model.lowerPositionLimit[q]), float(model.upperPositionLimit[q])
    if model.nqs[index] != 1:
        ends = -np.inf, np.inf
    speed = float(model.upperVelocityLimit[v])

    def known(value: float, is_told: bool = True) -> float | None:
        return value if np.isfinite(value) and is_told else None

    # A robot's file that states no limit, or zero, says nothing about the drive.
    return Drive(
        joint,
        joint,
        pulls=pulls,
        lower=known(lower, low < high),
        upper=known(upper, low < high),
        least=known(ends[0]),
        greatest=known(ends[1]),
        speed_limit=known(speed, speed > 0.0),
    )
