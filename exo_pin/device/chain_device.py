"""A device as a closed chain that carries an arm: the record that stands beside :class:`exo_pin.Mechanism`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..chain import ClosedChain
from ..core.conventions import as_side
from ..core.errors import InvalidInput
from ..core.tables import enumerated, limb_list
from ..core.validation import FloatArray, as_real, frozen, require_type
from ..design import Mechanism
from ..design.parameters.names import DesignParameter
from ..wrist.clearance.clearance import BodyShape
from .chain_roles import arm_of, drives_of, springs_of
from .clearance import LinkGaps
from .device_record import DeviceRecord
from .device_structure import Structure, structure_of
from .dimensions import chain_parameters, chain_places, chain_value, dimensions, with_chain_place, with_chain_values
from .parts.drives import Drive

#: What a device without drives about some axis needs of its wearer, in the order of the base frame's axes.
WEARER = ("wearer about x", "wearer about y", "wearer about z")


class ChainDevice(DeviceRecord):
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
    def _are_limbs(self) -> bool:
        """Whether its efforts are the tensions of limbs, which are told by their numbers, as those of a wrist."""
        pull = all(drive.pulls or drive.joint is None for drive in self.drives)
        numbered = [f"limb_{i}_slide" for i in range(1, 1 + len(self.drives))]
        return self.holds_alone and pull and [own.name for own in self.efforts] == numbered

    @property
    def drive_units(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of the effort of each entry of f; empty of limbs, which have numbers, and tensions in N."""
        if self._are_limbs:
            return ()
        own = [(drive.name, self.unit_of(drive)) for drive in self.efforts]
        return (*own, *((name, "N m") for name in (() if self.holds_alone else WEARER)))

    @property
    def summary(self) -> str:
        """Numbers of its drives and springs."""
        return f"{len(self.drives)} drives" + (f", {len(self.springs)} springs" if self.springs else "")

    @property
    def force_words(self) -> tuple[str, str]:
        """What f and g are."""
        return "limb forces f" if self._are_limbs else "efforts of the drives f", "forces of the structure g"

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

    def dimensions(self) -> dict[str, float]:
        """Places and axes of joints, ends of closures, anchors and laws by name.

        Returns
        -------
        dict of str to float
            SI; each name ends in its unit. See :mod:`exo_pin.device.dimensions`.

        Examples
        --------
        >>> round(ep.load("four-cables").device.as_chain().dimensions()["joint[limb_1_slide].x_m"], 3)
        -0.107
        """
        return dimensions(self)

    def with_dimensions(self, **values: float) -> ChainDevice:
        """The device with other values of some dimensions.

        Parameters
        ----------
        **values
            By the names of :meth:`dimensions`, or with mm and deg in the place of m and rad.

        Returns
        -------
        ChainDevice

        Examples
        --------
        >>> device = ep.load("four-cables").device.as_chain()
        >>> device.with_dimensions(**{"end_b[limb_1_base].z_mm": 250.0}).dimensions()["end_b[limb_1_base].z_m"]
        0.25
        """
        named = self.parameters(values)
        return self.with_values({own: own.in_si(value) for own, value in zip(named, values.values(), strict=True)})

    def parameters(self, names: Iterable[Any]) -> tuple[DesignParameter, ...]:
        """Dimensions in any of their units, and whom and what the device carries.

        Parameters
        ----------
        names : iterable of str
            Of :meth:`dimensions`, and ``arm``, ``person``, ``payload``, ``gravity``, ``lean_forward``, ``lean_left``.

        Returns
        -------
        tuple of DesignParameter

        Examples
        --------
        >>> device = ep.load("four-cables").device.as_chain()
        >>> [own.kind for own in device.parameters(["joint[limb_1_slide].z_mm", "payload"])]
        ['length', 'mass']
        """
        return chain_parameters(self, names)

    def value_of(self, named: DesignParameter) -> float | None:
        """Value of a dimension.

        Parameters
        ----------
        named : DesignParameter
            Of :meth:`parameters`.

        Returns
        -------
        float
            SI.

        Examples
        --------
        >>> device = ep.load("four-cables").device.as_chain()
        >>> round(device.value_of(device.parameters(["joint[limb_1_slide].x_mm"])[0]), 3)  # m
        -0.107
        """
        return chain_value(self, named)

    def with_values(self, values: Mapping[DesignParameter, Any], payload_at: ArrayLike | None = None) -> ChainDevice:
        """The device with other values of its parameters.

        Parameters
        ----------
        values : mapping of DesignParameter to value
            SI.
        payload_at : array_like, optional
            Shape (3,), m, in the arm frame: where a ``payload`` is held.

        Returns
        -------
        ChainDevice

        Examples
        --------
        >>> device = ep.load("four-cables").device.as_chain()
        >>> (payload,) = device.parameters(["payload_kg"])
        >>> round(float(device.with_values({payload: 2.0}, [0.0, 0.0, -0.6]).arm.mass - device.arm.mass), 9)
        2.0
        """
        return with_chain_values(self, values, payload_at)

    def places(self) -> dict[str, FloatArray]:
        """Places of joints, ends of closures and points of routes, by the names of their dimensions.

        Joints and closures count where the rows of the loops are independent: links of a device with redundant ones fit
        together as they are drawn, and not otherwise. Of a closure the second end counts, and of a limb among the roles
        its ends, ``"A[1]"``, ... on the torso and ``"B[1]"``, ... on the arm.

        Returns
        -------
        dict of str to ndarray
            Shape (3,) each, m.

        Examples
        --------
        >>> device = ep.load("four-cables").device.as_chain()
        >>> list(device.places())[:2]
        ['B[1]', 'B[2]']
        """
        return chain_places(self)

    def with_place(self, name: str, point: FloatArray) -> ChainDevice:
        """The device with one of these points elsewhere.

        Parameters
        ----------
        name : str
            Of :meth:`places`.
        point : ndarray
            Shape (3,), m.

        Returns
        -------
        ChainDevice

        Examples
        --------
        >>> device = ep.load("four-cables").device.as_chain()
        >>> device.with_place("A[1]", np.array([0.1, 0.0, -0.2])).places()["A[1]"]
        array([ 0.1,  0. , -0.2])
        """
        return with_chain_place(self, name, point)

    def stiffened(self, parts: str, more: float) -> ChainDevice | None:
        """The device with some parts so many times as stiff.

        Parameters
        ----------
        parts : {"guides", "links"}
            Which.
        more : float
            Factor.

        Returns
        -------
        ChainDevice or None
            None if all of them are rigid.

        Examples
        --------
        >>> print(ep.load("four-cables").device.as_chain().stiffened("guides", 2.0))
        None
        """
        if parts == "links":
            springs = (replace(own.spring, stiffness=more * own.spring.stiffness) for own in self.soft_links)
            links = tuple(replace(own, spring=spring) for own, spring in zip(self.soft_links, springs, strict=True))
            return self.replace(soft_links=links) if links else None
        if all(limb.guide is None for limb in self.guided_slides):
            return None
        limbs = (replace(limb, guide=limb.guide and limb.guide.times(more)) for limb in self.guided_slides)
        return self.replace(guided_slides=tuple(limbs))

    def limb_words(self, numbers: Sequence[int]) -> str:
        """Drives and brakes of these numbers, counted from 1, by their names; limbs by their numbers.

        Parameters
        ----------
        numbers : sequence of int
            From 1.

        Returns
        -------
        str

        Examples
        --------
        >>> ep.load("scenario-one").device.as_chain().limb_words([1, 3])
        'limbs 1 and 3'
        """
        if self._are_limbs:
            return limb_list(numbers)
        return enumerated(self.limbs[number - 1].name for number in numbers)
