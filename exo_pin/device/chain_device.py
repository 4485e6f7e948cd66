"""A device as a closed chain that carries an arm: the record that stands beside :class:`exo_pin.Mechanism`."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..chain import ClosedChain
from ..core.conventions import Side, as_side
from ..core.errors import InvalidInput, MissingData
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, as_mapping, as_parts, as_real, frozen, require_type, require_types, set_fields
from ..design import Arm, Interfaces, Mechanism, Shoulder
from ..wrist.clearance.clearance import BodyShape
from . import device_changes as changes
from . import dimensions as sizes
from .chain_roles import arm_index_of, arm_of, check_arm, drives_of, soft_bodies, springs_of
from .clearance import LinkGaps
from .device_structure import Structure, structure_of
from .parts.drives import Brake, Drive, Spring
from .parts.soft_parts import GuidedSlide, SoftLink

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
    brakes : tuple of Brake
        Joints that are locked at rest. A brake holds what drives do not.
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
    soft_links : tuple of SoftLink
        Links that give way where their joints carry them; rigid if left out.
    guided_slides : tuple of GuidedSlide
        Telescopic limbs with a guide that bends and twists, or without one; rigid if left out.

    Raises
    ------
    InvalidInput
        If the arm does not hang on a spherical joint, or its axes are others.
    UnknownName
        If a drive, brake or spring names a joint or link that the chain has not.

    Examples
    --------
    >>> from exo_pin.device import ChainDevice
    >>> device = ChainDevice.from_chain(ep.load("prototype").chain)  # as any chain with an arm among its roles
    >>> device.limb_count, device.holds_alone  # three drives hold the arm about three axes
    (3, True)
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
    soft_links: tuple[SoftLink, ...] = ()
    brakes: tuple[Brake, ...] = ()
    guided_slides: tuple[GuidedSlide, ...] = ()

    #: No limit of a drive is an estimate.
    estimated = ()
    #: Joints in which limbs turn that resist it with side forces; see ``twisting_device``.
    twists = ()

    replace = changes.changed
    mirrored = changes.mirrored
    stiffened = changes.stiffened
    dimensions = sizes.dimensions
    with_dimensions = sizes.with_dimensions
    parameters = sizes.parameters
    value_of = sizes.value_of
    with_values = sizes.with_values
    places = sizes.places
    with_place = sizes.with_place

    def __post_init__(self) -> None:
        require_types(self, chain=ClosedChain, arm=Arm | None, shoulder=Shoulder, interfaces=Interfaces)
        for key, kind in (("drives", Drive), ("brakes", Brake), ("springs", Spring)):
            items = as_parts(key, getattr(self, key), kind)
            for item in items:
                if item.joint is not None and self.chain.velocity_indices([item.joint]).size != 1:
                    raise InvalidInput(f"expected {item.name!r} on a joint of one coordinate, got {item.joint!r}")
                for point in () if item.joint is not None else item.route.points:
                    self.chain._state.frame_index(point.link)
            set_fields(self, **{key: items})
        set_fields(self, soft_links=as_parts("soft_links", self.soft_links, SoftLink))
        set_fields(self, guided_slides=as_parts("guided_slides", self.guided_slides, GuidedSlide))
        names = [part.name for part in self.efforts]
        if len(set(names)) != len(names):
            raise InvalidInput(f"expected drives and brakes of different names, got {', '.join(names)}")
        sources = as_mapping("sources", self.sources, "texts")
        set_fields(self, side=as_side(self.side), sources=MappingProxyType(dict(sources)))
        check_arm(self.chain)
        soft_bodies(self)

    @classmethod
    def from_chain(cls, chain: ClosedChain, side: str = "left") -> ChainDevice:
        """The device that the roles of a chain describe; limits of its drives are those of the model's joints.

        Parameters
        ----------
        chain : ClosedChain
            With an arm among its roles.
        side : {"left", "right"}
            Side of the body.

        Returns
        -------
        ChainDevice

        Raises
        ------
        InvalidInput
            If its roles name no arm, or :class:`ChainDevice` does not take it.

        Examples
        --------
        >>> from exo_pin.device import ChainDevice
        >>> device = ChainDevice.from_chain(ep.load("four-cables").chain_with_masses())
        >>> [drive.upper for drive in device.drives]  # N, greatest tensions of the cables
        [400.0, 400.0, 400.0, 400.0]
        """
        require_type("chain", chain, ClosedChain)
        return cls(
            chain, drives_of(chain), springs_of(chain), arm=arm_of(chain), side=as_side(side),
            name=chain.description.name,
        )  # fmt: skip

    @property
    def limbs(self) -> tuple[Drive, ...]:
        """Drives, then brakes, and for a device that does not hold the arm by itself the wearer's moments besides."""
        if self.holds_alone:
            return self.efforts
        own = (Drive(name, joint=self.arm_joint, lower=0.0, upper=0.0) for name in WEARER)
        return (*self.efforts, *own)

    @property
    def limb_count(self) -> int:
        """Number of efforts p that an answer lists."""
        return len(self.drives) + len(self.brakes) + (0 if self.holds_alone else len(WEARER))

    @cached_property
    def structure(self) -> Structure:
        """What the chain can do in general, away from singular poses."""
        return structure_of(self)

    @property
    def driven_moments(self) -> int:
        """Independent moments about O that the drives make in general, 0 to 3."""
        return self.structure.moments

    @property
    def holds_alone(self) -> bool:
        """Whether drives and brakes can make every moment about O while they hold the device's own motions.

        Else the wearer has to make what is left.
        """
        return self.driven_moments == 3

    @cached_property
    def is_upu(self) -> NDArray[np.bool_]:
        """Shape (p,): true for as many entries as F_s has directions that equilibrium does not determine."""
        return frozen(np.arange(self.limb_count) < self.structure.open_directions)

    @cached_property
    def has_limbs(self) -> bool:
        """Whether its efforts are the tensions of limbs, which have numbers, as those of a wrist."""
        pull = all(drive.pulls or drive.joint is None for drive in self.drives)
        numbered = [f"limb_{i}_slide" for i in range(1, 1 + len(self.drives))]
        return self.holds_alone and pull and [own.name for own in self.efforts] == numbered

    @property
    def drive_units(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of the effort of each entry of f, at every door: "limb 1" and on of limbs."""
        names = [f"limb {i}" if self.has_limbs else own.name for i, own in enumerate(self.efforts, 1)]
        own = zip(names, map(self.unit_of, self.efforts), strict=True)
        return (*own, *((name, "N m") for name in (() if self.holds_alone else WEARER)))

    @property
    def summary(self) -> str:
        """Numbers of its drives and springs."""
        return f"{len(self.drives)} drives" + (f", {len(self.springs)} springs" if self.springs else "")

    @property
    def force_words(self) -> tuple[str, str]:
        """What f and g are."""
        return "limb forces f" if self.has_limbs else "efforts of the drives f", "forces of the structure g"

    def gaps(
        self,
        matrices: FloatArray,
        offset: tuple[FloatArray, FloatArray] | None = None,
        placed: Any = None,
        body: BodyShape | None = None,
        radius: float | None = None,
    ) -> LinkGaps:
        """Gaps to the wearer and between cables in N poses.

        Parameters
        ----------
        matrices : ndarray
            Orientations of the arm, shape (N, 3, 3).
        offset : tuple of ndarray, optional
            Where the device's centre lies from the shoulder's, held by the base and carried by the cuff, shape (N, 3)
            or (1, 3) each, m.
        placed : DeviceEquilibrium or Postures, optional
            Its configurations in these poses, where they are known already; followed from rest if left out.
        body : BodyShape, optional
            What to keep clear of; the body of who wears it if left out.
        radius : float, optional
            Of the limbs of a wrist; shapes of links have their own.

        Returns
        -------
        Gaps

        Examples
        --------
        >>> ep.load("prototype").device.as_chain().gaps(np.eye(3)[None]).unknown  # nobody wears it
        ('who wears it (worn_by, --person)',)
        """
        return LinkGaps(self, matrices, offset, placed, body)

    @property
    def cuff_is_known(self) -> bool:
        """Whether the roles of the chain say where the cuff is."""
        return self.chain.roles.cuff is not None

    def as_chain(self) -> ChainDevice:
        """Itself: it is any closed chain with drives.

        Returns
        -------
        ChainDevice

        Examples
        --------
        >>> device = ep.load("prototype").device.as_chain()
        >>> device.as_chain() is device
        True
        """
        return self

    def accelerate(self, question: str) -> Mechanism | None:
        """None: a chain has no closed forms.

        Parameters
        ----------
        question : str
            What is asked.

        Returns
        -------
        Mechanism or None

        Examples
        --------
        >>> print(ep.load("prototype").device.as_chain().accelerate("forces"))
        None
        """
        return None

    def moment_of_wearer(self, f: FloatArray) -> FloatArray:
        """Moment that the wearer makes about O, shape (N, 3), N m, base frame; zero where the drives hold the arm.

        Parameters
        ----------
        f : ndarray
            Efforts of an answer, shape (N, p).

        Returns
        -------
        ndarray
            Shape (N, 3).

        Examples
        --------
        >>> device = ep.load("prototype").device.as_chain()
        >>> two = device.replace(drives=device.drives[:2])  # one drive too few
        >>> two.moment_of_wearer(np.array([[10.0, 20.0, 0.1, 0.2, 0.3]]))  # N m, after two efforts
        array([[0.1, 0.2, 0.3]])
        """
        f = as_real("f", f)
        if f.ndim != 2:
            raise InvalidInput(f"expected f of shape (N, p), got {f.shape}")
        return np.zeros((len(f), 3)) if self.holds_alone else f[:, len(self.efforts) :]

    @property
    def doubts(self) -> tuple[str, ...]:
        """What was left out of the robot's file and may change forces, in sentences."""
        return self.chain.description.doubts

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

    def unit_of(self, drive: Drive | Spring) -> str:
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
