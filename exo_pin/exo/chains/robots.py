"""The device that a robot is: a wrist, a wrist with more than its record can hold, or any other."""

from __future__ import annotations

from os import PathLike
from typing import Any

from ...chain import ClosedChain
from ...core.conventions import Side
from ...core.errors import NotAWrist
from ...design import Limb, WristGeometry
from ...device.chain_device import ChainDevice
from ...device.files.device_files import read_device
from ...wrist_chain import Recognised, wrist_of
from ..shoulder_exo import ShoulderExo
from .chain_exo import ChainExo


class HeavyWrist(ChainExo):
    """A wrist with masses, damping, friction or armatures that its record cannot hold, or with a device file.

    Its kinematics is a wrist's in closed form; forces are those of the chain, with all that it has.

    Attributes
    ----------
    recognised : Recognised
        The wrist, and what its record cannot hold.
    """

    recognised: Recognised

    inverse_kinematics = ShoulderExo.inverse_kinematics
    forward_kinematics = ShoulderExo.forward_kinematics
    forward_kinematics_from_base_angles = ShoulderExo.forward_kinematics_from_base_angles
    joint_motion = ShoulderExo.joint_motion
    nearest_singularity = ShoulderExo.nearest_singularity
    sensor_sensitivity = ShoulderExo.sensor_sensitivity
    jacobian = ShoulderExo.jacobian
    view = ShoulderExo.view  # type: ignore[assignment]

    @classmethod
    def of_recognised(
        cls,
        chain: ClosedChain,
        found: Recognised,
        side: str,
        urdf: str | PathLike[str] | None,
        device: ChainDevice | None = None,
    ) -> HeavyWrist:
        """The chain of a wrist that was recognised, with the drives of its device file if there is one."""
        exo = cls.of_robot(chain, side, urdf) if device is None else cls(device, urdf)
        assert isinstance(exo, HeavyWrist)
        exo.recognised = found
        return exo

    def replace(self, **changes: Any) -> ChainExo:
        """Return a new device with some fields changed; with another chain it is no wrist that was recognised."""
        if "chain" in changes:
            return ChainExo(self.device.replace(**changes), self.urdf)
        exo = super().replace(**changes)
        assert isinstance(exo, HeavyWrist)
        exo.recognised = self.recognised
        return exo

    @property
    def geometry(self) -> WristGeometry:
        """Joint centres and frames."""
        return self.recognised.mechanism.geometry

    def limbs_alone(self) -> ShoulderExo:
        """The wrist's geometry and kinds of limbs without any mass: kinematics, no forces."""
        known = self.recognised.mechanism
        return ShoulderExo.from_mechanism(known.replace(arm=None, limbs=[Limb(limb.kind) for limb in known.limbs]))


def exo_of_robot(
    chain: ClosedChain, side: Side, urdf: str | PathLike[str] | None, device_file: str | PathLike[str] | None
) -> ShoulderExo:
    """See :meth:`exo_pin.ShoulderExo.from_chain`, which asks this function."""
    device = None if device_file is None else read_device(device_file, chain, side)
    try:
        found = wrist_of(chain, side)
    except NotAWrist:
        return ChainExo.of_robot(chain, side, urdf) if device is None else ChainExo(device, urdf)
    if device is not None and (device.springs or device.soft_links or len(device.drives) > len(chain.roles.limbs)):
        return ChainExo(device, urdf)
    if device is not None or found.beyond_record:
        return HeavyWrist.of_recognised(chain, found, side, urdf, device)
    exo = ShoulderExo.from_mechanism(found.mechanism)
    exo._given_chain, exo.urdf = chain, urdf
    return exo


ShoulderExo._exo_of_robot = staticmethod(exo_of_robot)
