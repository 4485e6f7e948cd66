"""What a robot is: a wrist, a wrist with more than its record can hold, any other device, or a chain without an arm."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from typing import NamedTuple

import numpy as np

from ..chain import ClosedChain
from ..core.conventions import Side, as_side
from ..core.errors import FileFormatError, InvalidInput, NotAWrist
from ..design import Mechanism
from ..device import ChainDevice, Device, Drive, WristDevice
from ..device.device_record import carries_arm
from ..device.files.device_export import different_part
from ..device.files.device_files import design_of, read_device, side_alone
from ..wrist_chain import mechanism_urdf, wrist_of
from .wrist import Wrist


class RobotParts(NamedTuple):
    """A robot as a device.

    Attributes
    ----------
    device : Device or None
        None of a robot without an arm.
    wrist : Wrist or None
        Of a wrist.
    side : {"left", "right"}
        Side of the body.
    why_not : str
        Why it is no device; empty if it is one.
    """

    device: Device | None
    wrist: Wrist | None
    side: Side
    why_not: str = ""


def robot_parts(chain: ClosedChain, given: Side | None, device_file: str | PathLike[str] | None) -> RobotParts:
    """See :meth:`exo_pin.ShoulderExo.from_chain`."""
    design = None if device_file is None else design_of(device_file)
    if design is not None:
        return _of_design(design, chain, given, device_file)
    device = None
    if device_file is not None and (carries_arm(chain) or side_alone(device_file) is None):
        device = read_device(device_file, chain, given)
    own = None if device_file is None else side_alone(device_file)
    side = as_side(given or own or "left") if device is None else device.side
    try:
        found = wrist_of(chain, side)
    except NotAWrist:
        return _any_device(chain, device, None, side)
    limited = found.mechanism if device is None else _of_limbs(found.mechanism, device)
    if limited is not None and not found.beyond_record:
        return _of_record(limited)
    beyond = found.beyond_record or "what its device file adds to limbs and their actuators"
    return _any_device(chain, device, Wrist(found.mechanism, beyond), side)


def _of_design(
    design: Mechanism, chain: ClosedChain, given: Side | None, device_file: str | PathLike[str] | None
) -> RobotParts:
    """The wrist whose design a device file holds, if it is that of the robot's file."""
    if given is not None and given != design.side:
        raise FileFormatError(
            f"this robot is for the {design.side} shoulder, and a robot is not mirrored: export its design for the "
            "other one", device_file, "design.side"
        )  # fmt: skip
    other = different_part(chain, ClosedChain.from_urdf(*mechanism_urdf(design)))
    if other is not None:
        raise FileFormatError(
            f"the robot's file and this design differ in {other}: mend one, or take [design] away",
            device_file,
            "design",
        )
    return _of_record(design)


def _of_record(record: Mechanism) -> RobotParts:
    device = WristDevice.of(record)
    return RobotParts(device, Wrist(device), device.side)


def _any_device(chain: ClosedChain, device: ChainDevice | None, wrist: Wrist | None, side: Side) -> RobotParts:
    if device is not None:
        return RobotParts(device, wrist, side)
    try:
        return RobotParts(ChainDevice.from_chain(chain, side), wrist, side)
    except InvalidInput as error:
        return RobotParts(None, wrist, side, str(error))


def _of_limbs(mechanism: Mechanism, device: ChainDevice) -> Mechanism | None:
    """A wrist with what a device file says of it; None if its record does not hold all of that."""
    slides = [limb.slide for limb in device.chain.roles.limbs]
    guides = {own.slide: own.guide for own in device.guided_slides}
    guided = {slide for slide, limb in zip(slides, mechanism.limbs, strict=True) if limb.kind == "UPU"}
    if device.springs or device.soft_links or device.brakes or set(guides) not in (set(), guided):
        return None
    if [own.joint for own in device.drives] != slides:
        return None
    ends = mechanism.geometry.platform_points @ mechanism.geometry.neutral.as_matrix().T
    # Slides are zero in the neutral pose.
    lengths = np.linalg.norm(ends - mechanism.geometry.base_points, axis=1)
    limbs = []
    for slide, limb, drive, length in zip(slides, mechanism.limbs, device.drives, lengths.tolist(), strict=True):
        if drive != Drive(
            drive.name, drive.joint, pulls=True, actuator=drive.actuator, stroke=drive.stroke,
            zero_length=drive.zero_length,
        ) or abs(drive.zero_length - length) > 1e-9 * length:  # fmt: skip
            return None
        limbs.append(replace(limb, actuator=drive.actuator, stroke=drive.stroke, guide=guides.get(slide)))
    return mechanism.replace(
        limbs=limbs, name=device.name, title=device.title, arm=device.arm, shoulder=device.shoulder,
        interfaces=device.interfaces, sources=device.sources,
    )  # fmt: skip
