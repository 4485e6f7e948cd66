"""The device that a robot is: a wrist, a wrist with more than its record can hold, or any other."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from ...chain import ClosedChain
from ...core.conventions import Side
from ...core.errors import NotAWrist
from ...design import Actuator, Interfaces, Limb, Mechanism, Stroke, WristGeometry
from ...device.chain_device import ChainDevice
from ...device.files.device_files import read_device
from ...wrist_chain import Recognised, wrist_of
from ..shoulder_exo import ShoulderExo
from .chain_exo import ChainExo

#: Shortest length of a limb, over its longest, whose slide has no end that a limb could not pass.
_SHORT = 1e-6


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


def _drives_limbs_alone(device: ChainDevice) -> bool:
    """Whether a device file says no more than what the actuators of a wrist's limbs can do."""
    slides = [limb.slide for limb in device.chain.roles.limbs]
    more = device.springs or device.soft_links or device.shoulder.stiffness is not None
    return not more and device.interfaces == Interfaces() and [own.joint for own in device.drives] == slides


def _with_drives(mechanism: Mechanism, device: ChainDevice) -> Mechanism:
    """A wrist whose limbs have the limits of the drives of a device file."""
    geometry, limbs = mechanism.geometry, []
    # Slides are zero in the neutral pose.
    ends = geometry.platform_points @ geometry.neutral.as_matrix().T
    zeros = np.linalg.norm(ends - geometry.base_points, axis=1)
    for limb, drive, zero in zip(mechanism.limbs, device.drives, zeros.tolist(), strict=True):
        actuator, stroke = drive.actuator, drive.stroke
        if actuator is None and (drive.lower, drive.upper) != (None, None):
            pulls = drive.lower is not None and drive.lower >= 0.0
            actuator = Actuator(
                "cable" if pulls else "linear",
                pull_limit=drive.upper,
                push_limit=None if pulls or drive.lower is None else -drive.lower,
                speed_limit=drive.speed_limit,
                power_limit=drive.power_limit,
                least_tension=drive.lower or None if pulls else None,
            )
        if stroke is None and drive.least is not None and drive.greatest is not None:
            longest = drive.greatest + zero
            stroke = Stroke(longest, max(drive.least + zero, _SHORT * longest) / longest, 1.0, end_fitting=0.0)
        limbs.append(replace(limb, actuator=actuator, stroke=stroke))
    return mechanism.replace(limbs=limbs)


def exo_of_robot(
    chain: ClosedChain, side: Side, urdf: str | PathLike[str] | None, device_file: str | PathLike[str] | None
) -> ShoulderExo:
    """See :meth:`exo_pin.ShoulderExo.from_chain`, which asks this function."""
    device = None if device_file is None else read_device(device_file, chain, side)
    try:
        found = wrist_of(chain, side)
    except NotAWrist:
        return ChainExo.of_robot(chain, side, urdf) if device is None else ChainExo(device, urdf)
    if device is not None and not _drives_limbs_alone(device):
        return ChainExo(device, urdf)
    if found.beyond_record:
        return HeavyWrist.of_recognised(chain, found, side, urdf, device)
    exo = ShoulderExo.from_mechanism(found.mechanism if device is None else _with_drives(found.mechanism, device))
    exo._given_chain, exo.urdf = chain, urdf
    return exo


ShoulderExo._exo_of_robot = staticmethod(exo_of_robot)
