"""The one object a user holds: a device, and the questions it answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

from ..chain import ClosedChain
from ..consistency import Report, check, check_chain
from ..core.conventions import as_side, other_side
from ..core.errors import AbsentAttribute, InvalidInput
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import require_type
from ..design import Arm, Limb, Mechanism, Shoulder, WristGeometry
from ..design.parameters.changes import worn_by as record_worn_by
from ..device import ChainDevice, Device, WristDevice, as_device
from ..device.chain_roles import with_arm
from ..person.on_person import export_on_person
from . import contact, forces, kinematics, models
from .models import BEYOND, drives_limbs, mirrored_looks, parts_beyond_record, robot_parts
from .wrist import INSTEAD, Partly, Wrist, has_record

if TYPE_CHECKING:
    from ..design import Wearer


@checked
class ShoulderExo(Record):
    """A parallel shoulder exoskeleton, or any other device that holds a person's arm.

    Frozen: :meth:`replace` makes a new design. One design may be used from several threads at once: its answers are the
    same as from one thread, bit for bit as long as kernels run in one form. In mode "auto"
    (:mod:`exo_pin.core.compiled`) they change from plain to compiled once, and the two agree to rounding.

    The constructor makes a wrist of limbs between torso and arm. :func:`exo_pin.load` and :meth:`from_chain` make
    devices of any kind: a closed chain, the arm in it, its drives and springs. Questions, arguments and answers are the
    same; in the answers of other devices ``actuator_forces`` are the drives' efforts, N m in a hinge and N elsewhere,
    and ``limb_wrenches`` those of the device's attachments to the arm. What only a wrist has stands in :attr:`wrist`;
    its names are attributes of this object where there is one, and of no other device.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    arm : Arm, optional
        What moves about the shoulder, person and device together.
    limbs : sequence of Limb, optional
        One per joint pair; massless UPU limbs if left out.
    shoulder : Shoulder, optional
        The ball joint.
    **details
        Further fields of :class:`exo_pin.Mechanism` (``gravity``, ``side``, ``name``, ...).

    Attributes
    ----------
    device : Device
        What is asked (:class:`exo_pin.device.Device`): a :class:`exo_pin.device.WristDevice`, a
        :class:`exo_pin.device.ChainDevice`, or one of another kind. Of a robot without an arm access raises
        :class:`exo_pin.InvalidInput`, which says what is missing.
    wrist : Wrist or None
        What a wrist has: joint centres, forward kinematics, singular surface. Also where a chain gives the forces.
    urdf : path-like, str or None
        The URDF that it was loaded from, or its XML; None for all others.

    Examples
    --------
    >>> geometry = ep.WristGeometry.from_circles(0.14, 0.12, 0.08, 0.20, np.radians([30, 60, 120]))
    >>> exo = ep.ShoulderExo(geometry, ep.Arm(3.7, [0.0, 0.0, -0.3]))
    >>> exo.reaction(exo.pose()).shoulder_force.round(2) + 0.0  # N; a hanging arm: its weight, 3.7 × 9.81
    array([ 0. ,  0. , 36.3])
    """

    device: Any
    wrist: Wrist | None
    urdf: str | PathLike[str] | None
    _robot: ClosedChain | None
    _given_side: str
    _why_not: str

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name == "device":
                raise InvalidInput(vars(self).get("_why_not", "this design is not made yet"))
            # Python asks here after an attribute has said that it is absent.
            if name in INSTEAD:
                raise AbsentAttribute(name, INSTEAD[name])
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}", name=name, obj=self)

    def __init__(
        self,
        geometry: WristGeometry,
        arm: Arm | None = None,
        limbs: Sequence[Limb] | None = None,
        shoulder: Shoulder | None = None,
        **details: Any,
    ) -> None:
        record = Mechanism(
            geometry,
            arm=arm,
            limbs=() if limbs is None else limbs,  # type: ignore[arg-type]
            shoulder=Shoulder() if shoulder is None else shoulder,
            **details,
        )
        device = WristDevice.of(record)
        self._set(device, Wrist(device))

    def _set(
        self,
        device: Device | None,
        wrist: Wrist | None,
        robot: ClosedChain | None = None,
        urdf: str | PathLike[str] | None = None,
        side: str = "left",
        why_not: str = "",
    ) -> None:
        if device is not None:
            self.device = device
        self.wrist, self._robot, self.urdf = wrist, robot, urdf
        self._given_side, self._why_not = side, why_not

    @classmethod
    def from_device(cls, device: Device | Mechanism) -> ShoulderExo:
        """Wrap a device of any kind.

        Parameters
        ----------
        device : Device or Mechanism
            The device, of one of the kinds of :mod:`exo_pin.device` or of your own; or the record of a wrist.

        Returns
        -------
        ShoulderExo

        Raises
        ------
        InvalidInput
            If it is no device.

        Examples
        --------
        >>> from exo_pin.device import ChainDevice
        >>> chain = ep.load("prototype").chain
        >>> exo = ep.ShoulderExo.from_device(ChainDevice.from_chain(chain))
        >>> round(float(exo.reaction(exo.pose(30, 30)).magnitude), 2)  # N
        12.52
        """
        own, exo = as_device(device), cls.__new__(cls)
        record = own.accelerate("forces")
        if record is None:
            exo._set(own, None, own.chain)
        else:
            exo._set(own, Wrist(record))
        return exo

    @classmethod
    def from_mechanism(cls, mechanism: Mechanism) -> ShoulderExo:
        """Wrap the record of a wrist.

        Parameters
        ----------
        mechanism : Mechanism
            The record of a design.

        Returns
        -------
        ShoulderExo

        Raises
        ------
        InvalidInput
            If it is no Mechanism.

        Examples
        --------
        >>> record = ep.Mechanism(ep.load("prototype").geometry, arm=ep.Arm(2.0, [0.0, 0.0, -0.25]))
        >>> exo = ep.ShoulderExo.from_mechanism(record)
        >>> round(float(np.linalg.norm(exo.reaction(exo.pose(30, 30)).residual)), 9)  # of the balance, N and N m
        0.0
        """
        require_type("mechanism", mechanism, Mechanism)
        return cls.from_device(mechanism)

    @classmethod
    def from_chain(
        cls,
        chain: ClosedChain,
        side: str | None = None,
        urdf: str | PathLike[str] | None = None,
        device_file: str | PathLike[str] | None = None,
    ) -> ShoulderExo:
        """Wrap a robot that is given as a closed chain.

        If the chain is a wrist as :meth:`to_urdf` writes them, with its limbs among the roles, it has a :attr:`wrist`,
        and the closed forms give its forces as far as a wrist's record holds its masses. A robot whose roles name no
        arm has its :attr:`chain`, :meth:`check` and :meth:`view` alone.

        Parameters
        ----------
        chain : ClosedChain
            The robot.
        side : {"left", "right"}, optional
            The shoulder that the chain was built for; nothing is mirrored (:meth:`mirrored` does that). That of the
            device file if left out, else left.
        urdf : path-like or str, optional
            The URDF that it was read from, or its XML, for its looks, which a chain does not have.
        device_file : path-like, optional
            Springs and drives of the device (:mod:`exo_pin.device.files.device_files`).

        Returns
        -------
        ShoulderExo

        Examples
        --------
        >>> chain = ep.load("prototype").chain  # or one that a file holds
        >>> exo = ep.ShoulderExo.from_chain(chain)
        >>> round(float(exo.singularity(exo.pose(abduction=40)).determinant), 4)
        0.0185
        """
        parts = robot_parts(chain, None if side is None else as_side(side), device_file)
        exo = cls.__new__(cls)
        exo._set(parts.device, parts.wrist, chain, urdf, parts.side, parts.why_not)
        return exo

    @property
    def has_arm(self) -> bool:
        """Whether an arm hangs in it: a robot without one has no :attr:`device` and no forces."""
        return not self._why_not

    mechanism = Partly(Wrist.mechanism, of_record=True)
    geometry = Partly(Wrist.geometry)
    limbs = Partly(Wrist.limbs, of_record=True)

    @property
    def moved_record(self) -> Mechanism | Device:
        """What a plant moves: the record of a wrist that holds all of it, or the device."""
        return self.wrist.record if self.wrist and has_record(self) else self.device

    @cached_property
    def chain_device(self) -> ChainDevice:
        """The device as a closed chain with drives, of a wrist its whole chain."""
        return self.device.as_chain()

    @property
    def name(self) -> str:
        """Short name."""
        return self.device.name if self.has_arm else self.chain.description.name

    @property
    def arm(self) -> Arm | None:
        """The moving part."""
        return self.device.arm

    @property
    def side(self) -> str:
        """Side of the body."""
        return self.device.side if self.has_arm else self._given_side

    @cached_property
    def chain(self) -> ClosedChain:
        """The closed kinematic chain in Pinocchio, with the ball joint and the arm of who wears it."""
        if self._robot is None:
            return self.device.chain
        fixed = not self.has_arm or has_record(self)
        return self._robot if fixed else with_arm(self._robot, self.device.arm)

    def __repr__(self) -> str:
        if not self.has_arm:
            return f"<ShoulderExo {self.name!r}: {self.chain!r}>"
        own = self.device
        arm = "no arm" if own.arm is None else f"arm {own.arm.mass:.3g} kg"
        return f"<ShoulderExo {own.name!r}: {own.summary}, {own.side} shoulder, {arm}>"

    def replace(self, **changes: Any) -> ShoulderExo:
        """Return a new design with some fields of its record changed (``geometry=``, ``arm=``, ``limbs=``, ...).

        Parameters
        ----------
        **changes
            Fields of :class:`exo_pin.Mechanism`, or of :class:`exo_pin.device.ChainDevice` (``drives=``, ...). Of a
            wrist what only the latter has (``springs=``, ``brakes=``) makes the answers those of its chain.

        Returns
        -------
        ShoulderExo

        Raises
        ------
        UnknownName
            If a name is no field.
        InvalidInput
            If it is another ``side``, which mirrors nothing: see :meth:`mirrored`; or parts that a wrist has not and
            ``estimated`` or ``measures``, which its chain cannot say.

        Examples
        --------
        >>> earth = ep.load("prototype")
        >>> moon = earth.replace(gravity=[0.0, 0.0, -1.62])
        >>> pose = earth.pose(30, 30)
        >>> forces = [exo.reaction(pose, limits="none").actuator_forces for exo in (moon, earth)]
        >>> (forces[0] / forces[1]).round(4)  # 1.62 / 9.81
        array([0.1651, 0.1651, 0.1651])
        """
        parts = {name: changes.pop(name) for name in parts_beyond_record(self.device) & set(changes)}
        exo = self._with(self.device.replace(**changes), keeps_chain="chain" not in changes)
        if not parts:
            return exo
        for key in ("estimated", "measures"):
            if getattr(exo.device, key):
                raise InvalidInput(f"{', '.join(parts)}: such a device has no {key!r}; take it out ({key}=())")
        found = type(self).from_device(exo.chain_device.replace(**parts))
        found.wrist = Wrist(exo.device, BEYOND) if drives_limbs(found.device) else None
        return found

    def _with(self, device: Device, keeps_chain: bool = True) -> ShoulderExo:
        """The same exoskeleton with another record of its device."""
        exo = type(self).from_device(device)
        if exo.wrist is None:
            exo.urdf = self.urdf
            # With another chain or other drives it is not the wrist that was recognised.
            exo.wrist = self.wrist if self.wrist and keeps_chain and drives_limbs(device) else None
        return exo

    def worn_by(self, person: Arm | Wearer) -> ShoulderExo:
        """The design on a person's arm: what the device itself moves is kept, another person's arm is not.

        Parameters
        ----------
        person : Arm or Wearer
            A left arm, which is mirrored for a right-sided design; or whose it is, a :class:`exo_pin.Person` too: then
            answers say where limbs would pass through the body, and workspaces keep clear of it.

        Returns
        -------
        ShoulderExo

        Examples
        --------
        >>> exo = ep.load("prototype").worn_by(ep.Wearer(1.60, 55, "female"))
        >>> round(float(exo.arm.mass), 2)  # kg, of her arm and the moving part of the device
        3.13
        """
        return self._with(record_worn_by(self.device, person))

    def mirrored(self) -> ShoulderExo:
        """The same device on the other shoulder.

        Returns
        -------
        ShoulderExo
            Its mirror image in the x-z plane. In the same clinical angles coordinates and efforts of the drives and
            |F_s| are the same; the side forces g of a wrist change their sign.

        Raises
        ------
        InvalidInput
            If the chain has a joint whose mirror image is not known; see :meth:`ClosedChain.mirrored`.

        Examples
        --------
        >>> left = ep.load("four-linear-actuators")
        >>> right = left.mirrored()
        >>> there, here = (exo.reaction(exo.pose(40, 20, 10)).shoulder_force for exo in (right, left))
        >>> (there / here).round(6)  # to the other side, else the same
        array([ 1., -1.,  1.])
        """
        device = self.device.mirrored() if self.has_arm else None
        if device is not None and self._robot is None:
            return type(self).from_device(device)
        wrist = None if self.wrist is None else replace(self.wrist, record=self.wrist.record.mirrored())
        robot = None if self._robot is None else self._robot.mirrored()
        exo = type(self).__new__(type(self))
        exo._set(device, wrist, robot, mirrored_looks(self.urdf, robot), other_side(self.side), self._why_not)
        return exo

    def check(self) -> Report:
        """Kinematic consistency: loops, Jacobian, mobility with locked drives and brakes, joint limits and inertia.

        Of a device with springs also the elevations that their laws cover; of a wrist its closed forms, conditions and
        neutral pose.

        Returns
        -------
        Report
            Prints as a table; ``passed`` is true if nothing failed.

        Examples
        --------
        >>> report = ep.load("four-linear-actuators").check()
        >>> print(report.passed)
        True
        """
        return check(self.device, self.chain) if self.has_arm else check_chain(self.chain)

    # The questions: functions of their modules

    reaction = forces.reaction
    remedy = forces.remedy
    follow = forces.follow
    reaction_map = forces.reaction_map
    compare = forces.compare
    uncertainty = forces.uncertainty
    total_uncertainty = contact.total_uncertainty
    joint_contact = contact.joint_contact
    contact_range = contact.contact_range
    joint_contact_of_run = contact.joint_contact_of_run
    pose = kinematics.pose
    inverse_kinematics = kinematics.inverse_kinematics
    jacobian = kinematics.jacobian
    singularity = kinematics.singularity
    accuracy = kinematics.accuracy
    configurations = kinematics.configurations
    assembly_modes = kinematics.assembly_modes
    workspace = kinematics.workspace
    forward_kinematics = Partly(Wrist.forward_kinematics)
    forward_kinematics_from_base_angles = Partly(Wrist.forward_kinematics_from_base_angles)
    nearest_singularity = Partly(Wrist.nearest_singularity)
    track = kinematics.track
    save = models.save
    to_urdf = models.to_urdf
    export = models.export
    export_on_person = export_on_person
    chain_with_masses = models.chain_with_masses
    view = models.view
    report = models.report

    def __dir__(self) -> list[str]:
        partly = {name for name, member in vars(ShoulderExo).items() if isinstance(member, Partly)}
        return sorted(name for name in super().__dir__() if name not in partly or hasattr(self, name))
