"""Writing device files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...core.errors import InvalidInput
from ...core.files.toml_tables import toml_text
from ...design import Arm, Mechanism
from ...design.io.mechanism_files import arm_table, interface_table, mechanism_table
from ...design.io.mechanism_reading import record_table
from ..chain_device import ChainDevice
from ..chain_roles import SAME_ARM
from ..parts.drives import Brake, Drive, Spring
from ..parts.laws import ConstantForce, GasSpring, LinearSpring, TableLaw
from .device_files import INTERFACES, SCHEMA, with_drives


def device_text(device: ChainDevice, robot: str, of_robot: Mapping[str, Any] | None = None) -> str:
    """The device file of a device, for a robot's file of a name; empty where its robot says everything.

    Parameters
    ----------
    device : ChainDevice
        The device.
    robot : str
        Name of its robot's file.
    of_robot : mapping, optional
        What that file says otherwise (:func:`.robot_files.robot_tables`). Roles among it say that the robot's file has
        none; the drives are then written with all that is known of them.

    Raises
    ------
    InvalidInput
        If a spring has a law of its own kind, which is no part of the file.
    """
    plain, of_robot = ChainDevice.from_chain(device.chain, device.side), of_robot or {}
    drives = [drive for drive in device.drives if drive not in plain.drives or _is_one_sided(drive)]
    is_complete = "roles" in of_robot or with_drives(plain.drives, drives) != device.drives
    content = device_tables(device.replace(drives=device.drives if is_complete else drives))
    if not _says_more(device.arm, plain.arm):
        content.pop("arm", None)
    named = (device.name, device.title, device.side) != (plain.name, plain.title, "left")
    if not (of_robot or is_complete or named or content.keys() - {"name", "title", "side"}):
        return ""
    if is_complete:
        content["drives_are_complete"] = True
    plainly = {key: value for key, value in content.items() if not isinstance(value, dict | list)}
    tables = {key: value for key, value in content.items() if key not in plainly}
    return toml_text({"schema": SCHEMA, "robot": robot} | plainly | dict(of_robot) | tables)


def device_tables(device: ChainDevice) -> dict[str, Any]:
    """All that a device file says of a device beside its robot."""
    soft = {key: value for key in INTERFACES if (value := getattr(device.interfaces, key)) is not None}
    content: dict[str, Any] = {"name": device.name, "title": device.title}
    content |= {"side": device.side} if device.side != "left" else {}
    content["cuff_area_m2"] = "" if device.interfaces.cuff_area is None else device.interfaces.cuff_area
    content["arm"] = {} if device.arm is None else arm_table(device.arm)
    content["springs"] = [_place_table(spring) | _law_table(device, spring) for spring in device.springs]
    content["drives"] = [_place_table(drive) | _drive_table(device, drive) for drive in device.drives]
    content["brakes"] = [_brake_table(device, brake) for brake in device.brakes]
    content["soft_links"] = [{"link": own.link} | interface_table(own.spring) for own in device.soft_links]
    content["guided_slides"] = [
        {"slide": own.slide} | ({} if own.guide is None else {"guide": record_table(own.guide)})
        for own in device.guided_slides
    ]
    content["shoulder"] = record_table(device.shoulder)
    content |= {key: interface_table(value) for key, value in soft.items()}
    content["sources"] = dict(device.sources)
    return {key: value for key, value in content.items() if value not in ([], "", {})}


def design_text(design: Mechanism, robot: str, of_robot: Mapping[str, Any]) -> str:
    """The device file of a wrist, which holds its design."""
    head = {"schema": SCHEMA, "name": design.name, "robot": robot, "side": design.side}
    return toml_text(head | dict(of_robot) | {"design": mechanism_table(design)})


def side_text(name: str, robot: str, side: str) -> str:
    """The device file of a robot that has nothing to say but which shoulder it is for; empty for a left one."""
    return "" if side == "left" else toml_text({"schema": SCHEMA, "name": name, "robot": robot, "side": side})


def _says_more(arm: Arm | None, plain: Arm | None) -> bool:
    """Whether a robot's file cannot say whose arm it is, or what of it is the device's."""
    if arm is None or plain is None:
        return False

    if (arm.inertia is None) or any(part.inertia is None for part in arm.parts):
        return True

    def own(whole: Arm) -> float:
        return sum(part.mass for part in whole.parts if not part.device)

    return (arm.body_mass, arm.wearer) != (None, None) or abs(own(arm) - own(plain)) > SAME_ARM * arm.mass


def _is_one_sided(drive: Drive) -> bool:
    """Whether a robot's file cannot hold the limits of the effort: it has one number for both directions."""
    low, high = drive.lower, drive.upper
    return (low, high) != (None, None) and (low is None or high is None or low != -high)


def _place_table(part: Drive | Spring) -> dict[str, Any]:
    if part.route is None:
        return {"name": part.name, "joint": part.joint}
    points = [{"link": point.link, "point_m": list(point.point)} for point in part.route.points]
    return {"name": part.name, "points": points}


def _brake_table(device: ChainDevice, brake: Brake) -> dict[str, Any]:
    own = {} if brake.limit is None else {f"limit_{device.unit_of(brake.as_drive).replace(' ', '_')}": brake.limit}
    return {"name": brake.name, "joint": brake.joint, **own}


def _law_table(device: ChainDevice, spring: Spring) -> dict[str, Any]:
    law, turns = spring.law, device.unit_of(spring) == "N m"
    at = "rad" if turns else "m"
    # A law is the pull; the file of a spring on a joint holds the effort on it.
    key, sign = ("force_N", 1.0) if spring.joint is None else ("effort_N_m" if turns else "effort_N", -1.0)
    match law:
        case ConstantForce():
            return {"law": "constant", key: sign * law.value}
        case LinearSpring():
            stiffness = {"stiffness_N_m_rad" if turns else "stiffness_N_m": law.stiffness}
            return {"law": "linear", **stiffness, f"slack_{at}": law.slack, "only_pulls": law.only_pulls}
        case GasSpring():
            lengths = {"extended_length_m": law.extended_length, "gas_height_m": law.gas_height}
            return {"law": "gas", "extended_force_N": law.extended_force, **lengths, "exponent": law.exponent}
        case TableLaw():
            forces = {key.replace("_", "s_", 1): [sign * force for force in law.forces]}
            return {"law": "table", f"coordinates_{at}": list(law.coordinates), **forces}
    raise InvalidInput(f"a device file holds no law of the kind {type(law).__name__}")


def _drive_table(device: ChainDevice, drive: Drive) -> dict[str, Any]:
    own = {key: record_table(part) for key in ("actuator", "stroke") if (part := getattr(drive, key)) is not None}
    if drive.actuator is not None and drive.actuator.pulls_only:
        del own["actuator"]["push_limit_N"]  # zero, as its family says
    turns = device.unit_of(drive) == "N m"
    effort, at, rate = ("N_m", "rad", "_rad_s") if turns else ("N", "m", "_m_s")
    named = {
        f"lower_{effort}": drive.lower, f"upper_{effort}": drive.upper, f"least_{at}": drive.least,
        f"greatest_{at}": drive.greatest, f"speed{rate}": drive.speed_limit, "power_W": drive.power_limit,
        f"play_{at}": drive.play,
        f"resolution_{at}": drive.resolution, "pulls": drive.pulls or None, "zero_length_m": drive.zero_length or None,
    }  # fmt: skip
    return {key: value for key, value in named.items() if value is not None} | own
