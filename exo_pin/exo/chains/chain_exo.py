"""A device that is not a wrist: the questions of :class:`exo_pin.ShoulderExo` for any closed chain with an arm."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...chain import ClosedChain
from ...consistency import Report
from ...core.conventions import as_side
from ...core.errors import AbsentAttribute, InvalidInput
from ...core.files import write_text
from ...core.validation import FloatArray, as_choice, require_type
from ...design import Arm, Wearer
from ...device.chain_device import ChainDevice
from ...device.chain_roles import with_arm
from ...device.device_singularity import DeviceSingularity, device_jacobian, device_singularity
from ...device.files.device_files import ENDING
from ...device.files.device_writing import device_text
from ...device.postures import assembly_modes, configurations_of
from ..shoulder_exo import ShoulderExo

if TYPE_CHECKING:
    from ...view import ChainScene
    from ...wrist_chain import AssumedMasses
    from .device_report import DevicePoseReport


#: What a wrist has and other devices have not, and what serves in its place.
_OF_WRISTS = {
    "geometry": "",
    "mechanism": "its record is .device; sweeps and searches change wrists, and compare takes any device",
    "limbs": "its drives are .device.drives",
    "from_mechanism": "",
    "mirrored": "the other side needs a file of its own",
    "inverse_kinematics": "configurations(poses) gives its joints",
    "forward_kinematics": "chain.close and chain.forward_kinematics serve any chain",
    "forward_kinematics_from_base_angles": "",
    "nearest_singularity": "singularity(poses) gives the margin of each pose",
    "sensor_sensitivity": "",
    "track": "its controllers drive limbs of wrists; chain.simulate moves any chain",
    "joint_contact_of_run": "",
    "save": "export writes its files",
}


class _Absent:
    """A name that is no attribute, although a base class has it."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: type) -> Any:
        raise AbsentAttribute(self._name, _OF_WRISTS[self._name])


class ChainExo(ShoulderExo):
    """A shoulder exoskeleton of any kind: a closed chain, the arm in it, its drives and springs.

    :func:`exo_pin.load` makes it of a URDF whose closures file names arm and drives, and of an MJCF or SDF whose device
    file does. Questions, arguments and answers are those of :class:`exo_pin.ShoulderExo`; what needs limbs
    between two joint centres is no attribute. In an answer ``actuator_forces`` are the drives' efforts, N m in a hinge
    and N elsewhere, and ``limb_wrenches`` those of the device's attachments to the arm.

    Parameters
    ----------
    device : ChainDevice
        The device.
    urdf : path-like or str, optional
        The URDF that it was read from, for its looks.
    """

    _why_not: str = ""

    def __init__(self, device: ChainDevice, urdf: str | PathLike[str] | None = None) -> None:
        require_type("device", device, ChainDevice)
        self._device: ChainDevice | None = device
        self._robot, self._given_side, self.urdf = device.chain, device.side, urdf

    @classmethod
    def of_robot(cls, chain: ClosedChain, side: str = "left", urdf: str | PathLike[str] | None = None) -> ChainExo:
        """A robot as a device; one whose roles name no arm has its :attr:`chain` alone."""
        exo = cls.__new__(cls)
        exo._robot, exo._given_side, exo.urdf = chain, as_side(side), urdf
        exo._device = None
        try:
            exo._device = ChainDevice.from_chain(chain, side)
        except InvalidInput as error:
            exo._why_not = str(error)
        return exo

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            # Python asks here after an attribute has said that it is absent.
            if name in _OF_WRISTS:
                raise AbsentAttribute(name, _OF_WRISTS[name])
            return super().__getattr__(name)

    def __dir__(self) -> Iterable[str]:
        return sorted(name for name in super().__dir__() if name not in _OF_WRISTS or hasattr(self, name))

    @property
    def device(self) -> ChainDevice:  # type: ignore[override]
        """Its record.

        Raises
        ------
        InvalidInput
            If it is a robot without an arm: its :attr:`chain` answers all the same.
        """
        if self._device is None:
            raise InvalidInput(self._why_not)
        return self._device

    @property
    def name(self) -> str:
        """Short name."""
        return self.chain.description.name if self._device is None else self._device.name

    @property
    def side(self) -> str:
        """Side of the body."""
        return self._given_side if self._device is None else self._device.side

    @property
    def arm(self) -> Arm | None:
        """The moving part."""
        return self.device.arm

    @property
    def is_wrist(self) -> bool:
        """False."""
        return False

    def __repr__(self) -> str:
        if self._device is None:
            return f"<ChainExo {self.name!r}: {self.chain!r}>"
        own = self._device
        arm = "no arm" if own.arm is None else f"arm {own.arm.mass:.3g} kg"
        springs = f", {len(own.springs)} springs" if own.springs else ""
        return f"<ChainExo {own.name!r}: {len(own.drives)} drives{springs}, {own.side} shoulder, {arm}>"

    def replace(self, **changes: Any) -> ChainExo:
        """Return a new device with some fields of its record changed (``drives=``, ``springs=``, ``arm=``, ...)."""
        return type(self)(self.device.replace(**changes), self.urdf)

    def worn_by(self, person: Arm | Wearer) -> ChainExo:
        """The device on a person's arm: links of the device on the arm stay, another person's arm does not."""
        require_type("person", person, Arm | Wearer)
        own = person if isinstance(person, Arm) else Arm.of_wearer(person)
        return self.replace(arm=(own if self.side == "left" else own.mirrored()).with_device_of(self.device.arm))

    @cached_property
    def chain(self) -> ClosedChain:
        """The closed kinematic chain in Pinocchio, with the arm of who wears it."""
        return self._robot if self._device is None else with_arm(self._robot, self._device.arm)

    def chain_with_masses(self, part: str = "whole", assumed: AssumedMasses | None = None) -> ClosedChain:
        """The chain as it is: its file says what its links weigh.

        Parameters
        ----------
        part, assumed
            Of wrists: "whole" and None.
        """
        as_choice("part", part, ("whole",))
        return self.chain

    def to_urdf(self, folder: str | PathLike[str], part: str = "whole", assumed: AssumedMasses | None = None) -> Path:
        """Write the chain as URDF with a closures file beside it, as it is.

        Raises
        ------
        InvalidInput
            If URDF cannot hold a joint, such as a ball joint in the tree, or its data.
        """
        written = Path(self.chain_with_masses(part, assumed).to_urdf(folder))
        text = "" if self._device is None else device_text(self._device, written.name)
        if text:
            write_text(written.with_suffix(ENDING), text)
        return written

    def view(  # type: ignore[override]
        self, *, q: ArrayLike | None = None, labels: bool | None = None
    ) -> ChainScene:
        """The device in three dimensions, at rest with its forces; its ``show_pose`` draws others.

        Parameters
        ----------
        q : array_like, optional
            A configuration of the chain, which is drawn without forces.
        labels : bool, optional
            As for :class:`exo_pin.view.ChainScene`.

        Returns
        -------
        DeviceScene or ChainScene
            Of a robot without an arm, or with ``q``, the latter.
        """
        from ...view import ChainScene, DeviceScene

        if self._device is None or q is not None:
            return ChainScene(self.chain, self.urdf, q, labels)
        return DeviceScene(self, labels)

    def _report(self, *parts: Any) -> DevicePoseReport:
        from .device_report import DevicePoseReport

        return DevicePoseReport(*parts)

    def check(self) -> Report:
        """Kinematic consistency of the chain: loops, Jacobian, mobility, limits and inertia."""
        from ...consistency import check_chain

        return check_chain(self.chain)

    def configurations(self, poses: Rotation) -> FloatArray:
        """Joints of the chain in poses of the arm, on the assembly mode that continues from rest.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).

        Returns
        -------
        ndarray
            q, shape (..., nq), as Pinocchio orders it; NaN where a pose is out of reach.
        """
        return configurations_of(self.device, poses)

    def assembly_modes(self, poses: Rotation, starts: int = 64, seed: int = 0) -> FloatArray:
        """All closed configurations of the chain that were found in one pose of the arm.

        Parameters
        ----------
        poses : Rotation
            Single.
        starts : int
            Random configurations to close from.
        seed : int
            Of the random numbers.

        Returns
        -------
        ndarray
            Shape (k, nq); the first is the one that continues from rest, where it reaches the pose.
        """
        return assembly_modes(self.device, poses, starts, seed)

    def jacobian(self, poses: Rotation) -> FloatArray:
        """Rates of the drives' coordinates for an angular velocity of the arm, shape (..., n, 3), base frame.

        m/rad, or rad/rad in a hinge; of a routed drive that of its shortening.
        """
        return device_jacobian(self.device, poses)

    def singularity(self, poses: Rotation) -> DeviceSingularity:  # type: ignore[override]
        """Singularities of the drives and of the device's own loops; see :class:`.DeviceSingularity`."""
        return device_singularity(self.device, poses)


for _name in _OF_WRISTS:
    _there = _Absent()
    _there.__set_name__(ChainExo, _name)
    setattr(ChainExo, _name, _there)
