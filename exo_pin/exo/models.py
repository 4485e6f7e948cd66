"""A design as files, as a chain in Pinocchio, and as a picture.

What a robot is: a wrist, a wrist with more than its record can hold, any other device, or a chain without an arm.
"""

from __future__ import annotations

from dataclasses import fields, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..chain import ClosedChain
from ..chain.formats.urdf.urdf_writing import urdf_text
from ..core.conventions import Side, as_side
from ..core.errors import FileFormatError, InvalidInput, NotAWrist
from ..core.errors.checked import checked
from ..core.files import require_ending, require_writable, write_text
from ..core.validation import as_choice
from ..design import Mechanism
from ..design.io.mechanism_files import write_mechanism
from ..device import ChainDevice, Device, Drive, WristDevice
from ..device.chain_roles import carries_arm
from ..device.files.device_export import (
    DeviceFiles,
    Exported,
    different_part,
    files_of_design,
    files_of_device,
    files_of_robot,
    save_device,
)
from ..device.files.device_files import ENDING, design_of, read_device, side_alone
from ..device.files.device_writing import device_text, side_text
from ..reaction.constraints.actuator_limits import stroke_limits
from ..wrist_chain import AssumedMasses, mechanism_urdf, wrist_of
from ..wrist_chain.wrist_urdf import closures_beside, write_urdf
from .wrist import Wrist

if TYPE_CHECKING:
    from ..design import Wearer
    from ..person import Person
    from ..report import DesignReport
    from ..view import ChainScene, Scene
    from .shoulder_exo import ShoulderExo

#: Endings that :meth:`exo_pin.ShoulderExo.export` writes, and what each format holds of a closed chain.
EXPORTS = {
    ".urdf": "URDF has no loops: they are in the closures file, which ClosedChain.from_urdf reads. Other programs see "
    "an open tree.",
    ".xml": "The loops are equality constraints. The keyframe closed is the configuration to start from. Controls are "
    "tensions in N, within what the design's actuators can do: cables and muscles only pull.",
    ".sdf": "Every loop is closed by one more joint. All joints read zero at rest.",
}

#: What of a wrist the chain holds and the record does not.
BEYOND = "what it has besides limbs and their actuators"

_ASSUMED = AssumedMasses()


def _is_record(exo: ShoulderExo) -> bool:
    """Whether it is a wrist whose record holds all of it, so that its design is its file."""
    return exo.wrist is not None and not exo.wrist.beyond_record


def mirrored_looks(urdf: str | PathLike[str] | None, image: ClosedChain | None) -> str | None:
    """The URDF of the mirror image of a chain that was read from one, with its mirrored visuals, or None.

    None where the image cannot be written as URDF: its links are then drawn by their joints.
    """
    try:
        return None if urdf is None or image is None else urdf_text(image._state)[0]
    except InvalidInput:
        return None


@checked
def save(self: ShoulderExo, path: str | PathLike[str]) -> None:
    """Write the design as a TOML file that :func:`load` reads back bit for bit.

    Sources are written beside what they speak of; comments of a file that was loaded are not kept. Of a device that is
    no wrist's record ``mine.toml`` names ``mine.device.toml``, and this ``mine.urdf`` with its closures file, or
    ``mine.xml`` (MJCF) where a URDF cannot hold it; all of them are written.

    Parameters
    ----------
    path : path-like
        Where to, a ``.toml`` file.

    Raises
    ------
    InvalidInput
        If no format holds the device, or a file beside it is there that was not saved with it.

    Examples
    --------
    >>> ep.load("four-cables").save("mine.toml")
    >>> (1e3 * ep.load("mine.toml").geometry.base_points[0]).round(3)  # mm
    array([ 33., 164., 185.])
    """
    if _is_record(self):
        write_mechanism(self.mechanism, path)
    else:
        save_device(self.chain_device, self.chain, path)


def to_urdf(
    self: ShoulderExo, folder: str | PathLike[str], part: str = "whole", assumed: AssumedMasses | None = _ASSUMED
) -> Path:
    """Write the design as URDF with a closures file beside it, and the whole device with its drives' limits.

    Each file appears whole or not at all, first the URDF, then the closures, then the device file with limits that
    a URDF has no place for: of cables and muscles, which only pull, and of strokes, with guides and the stiffness of
    shoulder, harness and cuff. Angles that joints allow, and which data are estimates, stay in the design file
    (:meth:`save`).

    Parameters
    ----------
    folder : path-like
        Where to; made if it is not there.
    part : {"whole", "wrist", "shoulder", "floating"}
        Limbs and ball joint; the limbs alone; the ball joint with the arm alone; or limbs and a free arm whose
        ball joint is a closure.
    assumed : AssumedMasses or None
        Masses for links that have none, because simulators need them; the file says that they are assumed.
        None leaves such links without mass.

    Returns
    -------
    Path
        The URDF.

    Examples
    --------
    >>> path = ep.load("prototype").to_urdf("robot")
    >>> path.name, sorted(file.name for file in path.parent.iterdir())
    ('prototype.urdf', ['prototype.closures.toml', 'prototype.device.toml', 'prototype.urdf'])
    """
    if _is_record(self):
        written, is_whole = write_urdf(self.mechanism, folder, part, assumed), part == "whole"
    else:
        written, is_whole = Path(chain_with_masses(self, part).to_urdf(folder)), self.has_arm
    robot = written.name
    text = device_text(self.chain_device, robot) if is_whole else side_text(self.name, robot, self.side)
    if text:
        write_text(written.with_suffix(ENDING), text)
    return written


def export(self: ShoulderExo, path: str | PathLike[str], part: str = "whole") -> Exported:
    """Write the design for other programs, in the format of a file's ending.

    Beside the robot's file stands a device file with all that its format cannot say: which part is what, springs,
    cables, limits, stiffnesses, and which masses are assumed, because simulators need some. :func:`load` reads the
    same device from either of the two, while both are in one folder.

    Parameters
    ----------
    path : path-like
        ``.urdf``, with the closures file beside it; ``.xml`` (MJCF); or ``.sdf``. What each holds of the loops:
        :data:`EXPORTS`.
    part : {"whole", "wrist", "shoulder", "floating"}
        How much of a wrist; see :meth:`to_urdf`. A part has no device file.

    Returns
    -------
    Exported
        A list of what was written, the robot's file first. ``beside`` says what that file alone cannot say and the
        device file beside it does, ``lost`` what no file says, ``statement`` both in sentences.

    Raises
    ------
    InvalidInput
        If the ending is another, the format cannot hold the robot, or a file cannot be written.

    Examples
    --------
    >>> ep.load("prototype").export("robot.xml")
    [PosixPath('robot.xml'), PosixPath('robot.device.toml')]
    >>> len(ep.ClosedChain.from_mjcf("robot.xml").closures)
    3
    """
    require_ending("the file", path, tuple(EXPORTS))
    target = Path(path)
    require_writable(target)
    return _files(self, target, target.suffix.lower(), part).write(target)


def _files(exo: ShoulderExo, target: Path, ending: str, part: str) -> DeviceFiles:
    """Texts of the files of an export."""
    heavy = chain_with_masses(exo, part)
    if _is_record(exo):
        urdf, closures = mechanism_urdf(exo.mechanism, part, _ASSUMED)
        texts = {".urdf": urdf, ".closures.toml": closures_beside(closures, target.stem)}
        if part == "whole":
            return files_of_design(exo.mechanism, exo.chain, heavy, target, ending, texts)
        return DeviceFiles(texts) if ending == ".urdf" else DeviceFiles(files_of_robot(heavy, ending).texts)
    if exo.has_arm:
        return files_of_device(exo.chain_device, heavy, target, ending)
    files, side = files_of_robot(heavy, ending), side_text(exo.name, target.name, exo.side)
    return replace(files, texts=files.texts | {ENDING: side}) if side and ending == ".urdf" else files


def chain_with_masses(self: ShoulderExo, part: str = "whole", assumed: AssumedMasses | None = _ASSUMED) -> ClosedChain:
    """The closed chain with assumed masses for links that have none, for simulators.

    Effort limits of the slides are those of the design's actuators, of a muscle the greatest pull of its stroke: a
    slide that only pulls has an upper limit of zero. They are infinite where the design does not have them.

    Parameters
    ----------
    part : {"whole", "wrist", "shoulder", "floating"}
        How much of a wrist; see :meth:`to_urdf`.
    assumed : AssumedMasses
        The masses.

    Returns
    -------
    ClosedChain

    Examples
    --------
    >>> chain = ep.load("prototype").chain_with_masses()
    >>> chain.mobility(chain.close(chain.neutral())).degrees_of_freedom
    3
    """
    if not _is_record(self):
        as_choice("part", part, ("whole",))
        return self.chain
    xml, closures = mechanism_urdf(self.mechanism, part, assumed)
    # Named as the files of to_urdf are.
    chain = ClosedChain.from_urdf(xml, replace(closures, name=closures.name.removesuffix("-whole")))
    least, greatest = stroke_limits(self.mechanism)
    for limb, role in enumerate(chain.roles.limbs):
        # A slide grows with its limb, which tension shortens. No -0.0, which would be printed.
        own = chain.velocity_slice(role.slide)
        chain.model.lowerEffortLimit[own] = 0.0 - greatest[limb]
        chain.model.upperEffortLimit[own] = 0.0 - least[limb]
    return chain


def view(
    self: ShoulderExo,
    *,
    human: bool | None = None,
    limbs: str | None = None,
    metres_per_newton: float | None = None,
    person: Person | None = None,
    device: bool | None = None,
    q: ArrayLike | None = None,
    labels: bool | None = None,
) -> Scene | ChainScene:
    """The device in three dimensions, on a person, at rest with its forces; its ``show`` draws other poses.

    Parameters
    ----------
    human, limbs, metres_per_newton, person, device
        As for :class:`exo_pin.view.Scene`, which has its own defaults for what is left out.
    q : array_like, optional
        A configuration of the chain, which is drawn as it is, without person and forces.
    labels : bool, optional
        As for :class:`exo_pin.view.ChainScene`.

    Returns
    -------
    Scene or ChainScene
        The second of a robot without an arm, or with ``q``. ``serve`` opens a page, ``save_html`` and ``save_png``
        write files.

    Raises
    ------
    InvalidInput
        If an option is for a person or for forces, and there are none; or limbs are to be muscles that are none.

    Examples
    --------
    >>> scene = ep.load("prototype").view(human=False)
    >>> type(scene).__name__
    'Scene'
    """
    from ..view import ChainScene, Scene  # here, because few queries need them

    given = {
        "human": human, "limbs": limbs, "metres_per_newton": metres_per_newton, "person": person, "device": device,
    }  # fmt: skip
    looks: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if q is None and (self.has_arm or self.wrist is not None):
        if labels is not None:
            raise InvalidInput("labels name joints where there are no forces, whose labels name them here")
        return Scene(self, **looks)
    if looks:
        why = "a configuration q is drawn" if self.has_arm else f"{self.name!r} has no arm: it is drawn"
        raise InvalidInput(f"{why} without person and forces, so there is no option {', '.join(looks)}")
    return ChainScene(self.chain, self.urdf, q, labels)


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
    return _any_device(chain, device, Wrist(found.mechanism, found.beyond_record or BEYOND), side)


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
    try:
        device = ChainDevice.from_chain(chain, side) if device is None else device
    except InvalidInput as error:
        return RobotParts(None, wrist, side, str(error))
    return RobotParts(device, wrist if drives_limbs(device) else None, side)


def parts_beyond_record(device: Device) -> set[str]:
    """Fields that a chain has and the record of a device's closed forms has not; none without these."""
    own = {item.name for item in fields(ChainDevice)} - {item.name for item in fields(Mechanism)} - {"chain"}
    return set() if device.accelerate("forces") is None else own


def drives_limbs(device: Device) -> bool:
    """Whether the drives are the limbs of a wrist, in order: then its closed forms are of the drives' positions."""
    return [drive.joint for drive in device.drives] == [limb.slide for limb in device.chain.roles.limbs]


def _of_limbs(mechanism: Mechanism, device: ChainDevice) -> Mechanism | None:
    """A wrist with what a device file says of it; None if its record does not hold all of that."""
    slides = [limb.slide for limb in device.chain.roles.limbs]
    guides = {own.slide: own.guide for own in device.guided_slides}
    guided = {slide for slide, limb in zip(slides, mechanism.limbs, strict=True) if limb.kind == "UPU"}
    if device.springs or device.soft_links or device.brakes or set(guides) not in (set(), guided):
        return None
    if not drives_limbs(device):
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


def report(
    self: ShoulderExo,
    person: Person | Wearer | None = None,
    arm_speed: float = 30.0,
    file: str | PathLike[str] | None = None,
) -> DesignReport:
    """What the device does for a person over the range of daily life, in one record that can be written as two pages.

    Parameters
    ----------
    person, arm_speed, file
        Who wears it, the speed of the arm for the drives (degrees/s), and the design's file, whose hash then stands in
        the report.

    Returns
    -------
    DesignReport
        Its ``save`` writes ``.pdf`` or ``.html``.

    Examples
    --------
    >>> report = ep.load("urdf/spring-support.urdf").report(ep.Person(1.75, 75, "male"))
    >>> round(report.postures[1].joint_without_N), len(report.hazards)  # N, arm forward at 60°
    (278, 13)
    """
    from ..report.design_report import design_report  # here, because few queries need it

    return design_report(self, person, arm_speed, file)
