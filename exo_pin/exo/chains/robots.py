"""The device that a robot is: a wrist, a wrist with more than its record can hold, or any other."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from ...chain import ClosedChain
from ...core.conventions import Side, as_side
from ...core.errors import NotAWrist
from ...design import Interfaces, Limb, Mechanism, WristGeometry
from ...device import ChainDevice, Drive
from ...device.files.device_files import read_device
from ...wrist_chain import Recognised, wrist_of
from ..shoulder_exo import ShoulderExo
from .chain_exo import ChainExo


class HeavyWrist(ChainExo):
    """A wrist with masses, damping, friction, armatures or springs that its record cannot hold.

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
        """Return a new device with some fields changed; with another chain it is not a wrist that was recognised."""
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


def _drives_limbs_alone(device: ChainDevice) -> bool:
    """Whether a device file says no more than what the actuators of a wrist's limbs can do."""
    slides = [limb.slide for limb in device.chain.roles.limbs]
    more = device.springs or device.soft_links or device.shoulder.stiffness is not None
    return not more and device.interfaces == Interfaces() and [own.joint for own in device.drives] == slides


def _of_limbs(mechanism: Mechanism, device: ChainDevice) -> Mechanism | None:
    """A wrist with the actuators and strokes of the drives; None if their limits are none of a limb's."""
    ends = mechanism.geometry.platform_points @ mechanism.geometry.neutral.as_matrix().T
    # Slides are zero in the neutral pose.
    lengths = np.linalg.norm(ends - mechanism.geometry.base_points, axis=1)
    limbs = []
    for limb, drive, length in zip(mechanism.limbs, device.drives, lengths.tolist(), strict=True):
        if drive != Drive(
            drive.name, drive.joint, pulls=True, actuator=drive.actuator, stroke=drive.stroke,
            zero_length=drive.zero_length,
        ) or abs(drive.zero_length - length) > 1e-9 * length:  # fmt: skip
            return None
        limbs.append(replace(limb, actuator=drive.actuator, stroke=drive.stroke))
    return mechanism.replace(limbs=limbs, name=device.name, title=device.title, arm=device.arm)


def exo_of_robot(
    chain: ClosedChain, given: Side | None, urdf: str | PathLike[str] | None, device_file: str | PathLike[str] | None
) -> ShoulderExo:
    """See :meth:`exo_pin.ShoulderExo.from_chain`, which asks this function."""
    device = None if device_file is None else read_device(device_file, chain, given)
    side = as_side(given or "left" if device is None else device.side)
    try:
        found = wrist_of(chain, side)
    except NotAWrist:
        return ChainExo.of_robot(chain, side, urdf) if device is None else ChainExo(device, urdf)
    if device is not None and not _drives_limbs_alone(device):
        return ChainExo(device, urdf)
    if found.beyond_record:
        return HeavyWrist.of_recognised(chain, found, side, urdf, device)
    mechanism = found.mechanism
    if device is not None:
        limited = _of_limbs(mechanism, device)
        if limited is None:
            return ChainExo(device, urdf)
        mechanism = limited
    exo = ShoulderExo.from_mechanism(mechanism)
    exo._given_chain, exo.urdf = chain, urdf
    return exo


ShoulderExo._exo_of_robot = staticmethod(exo_of_robot)
