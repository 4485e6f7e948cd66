"""Device files: what a device has beside its links and loops, springs with laws and routed cables.

Beside ``NAME.urdf`` (or ``.xml``, ``.sdf``) may stand ``NAME.device.toml``::

    schema = 1
    name = "NAME"
    robot = "NAME.urdf"              # optional: the robot's file, by default NAME.urdf beside this one
    cuff_area_m2 = 0.012             # optional: of the cuff, seen from one side
    title = "..."                    # optional: a line of description
    side = "right"                   # optional: the shoulder that the robot was built for, "left" if left out; its
                                     # mirror image serves for the other

    [roles]                          # of a robot's MJCF or SDF, which cannot say it; of a URDF in its closures file
    arm = "upper_arm"                # the arm's link, on a ball joint of the torso: keys as in a closures file
    shoulder = "shoulder_ball"
    cuff = "cuff_middle"
    actuated = ["flexion"]           # optional: joints with a drive, by default those that the robot's file drives

    [[springs]]
    name = "strut"
    joint = "strut_slide"            # a hinge or slide of the robot; or points, as below
    law = "table"                    # see the laws
    coordinates_m = [0.0, 0.1]       # rising (coordinates_rad of a hinge)
    efforts_N = [1.0, 5.0]           # on the joint, positive towards larger coordinates (efforts_N_m of a hinge); of
                                     # a spring between points forces_N, its pull

    drives_are_complete = true       # optional: the drives of this file are all, in this order, with all their limits
    [[drives]]                       # besides the joints among the robot's roles, or in their place
    name = "cable"
    lower_N = 5.0                    # least and greatest tension, or moment (lower_N_m) of a hinge; what is left out
                                     # of a driven joint is as in the robot's file
    upper_N = 300.0
    least_m = 0.2                    # optional range of length or coordinate (least_rad of a hinge), and speed_m_s
    greatest_m = 0.6                 # (speed_rad_s of a hinge)
    [[drives.points]]                # ends and frictionless via points of a route, in order
    link = "universe"                # the torso
    point_m = [0.0, 0.2, 0.1]
    [[drives.points]]
    link = "arm"
    point_m = [0.0, 0.04, -0.2]

    [drives.actuator]                # optional, as of a limb in a design file: a pneumatic muscle with its law, say
    family = "pneumatic muscle"
    force_law = "best"
    supply_bar = 5.0
    [drives.motor]                   # optional, of a hinge, in the place of lower, upper and speed: a motor with a gear
    torque_N_m = 0.8                 # of the motor, either way
    ratio = 50.0                     # of the gear, motor to joint
    speed_rad_s = 300.0              # optional, of the motor
    [drives.stroke]                  # lengths of the route that it can take
    nominal_mm = 300.0
    shortest_ratio = 0.75
    longest_ratio = 1.0
    end_fitting_mm = 50.0            # what the route is longer than the muscle

    [[brakes]]                       # joints that are locked at rest
    name = "rail_brake"
    joint = "rail_slide"
    limit_N = 300.0                  # optional: greatest effort, either way (limit_N_m of a hinge)

    [cuff]                           # optional: how the cuff gives way against the arm; [harness] against the torso
    translational_N_m = [3700.0, 3150.0, 2250.0]
    rotational_N_m_rad = [10.6, 12.0, 2.0]
    at_m = [0.0, 0.0, -0.19]         # the point meant, in the arm's frame (the base frame of a harness)

    [[soft_links]]                   # a link that gives way where its joint carries it, in the same keys
    link = "fork"
    stiffness_N_m = [[...], ...]     # or by 3 x 3 blocks, with rotational_stiffness_N_m_rad and coupling_N
    rotational_stiffness_N_m_rad = [[...], ...]
    at_m = [0.0, 0.0, 0.0]           # axes and point are those of the link

    [[guided_slides]]                # a telescopic limb between two universal joints whose guide bends and twists
    slide = "limb_1_slide"
    [guided_slides.guide]            # as of a limb in a design file; left out, the limb carries no side force
    bending_rigidity_N_m2 = 65.0
    torsional_rigidity_N_m2 = 50.0

    [arm]                            # optional: what of the arm's link is whose, as in a design file; it weighs what
    body_mass_kg = 75.0              # the robot's file says. Without it, the link is the person's and what is welded
    [[arm.parts]]                    # to it the device's
    mass_kg = 3.7
    centre_of_mass_m = [0.0, 0.0, -0.3]
    [[arm.parts]]
    device = true
    mass_kg = 0.66
    centre_of_mass_m = [0.0, 0.02, -0.19]

    [shoulder]                       # stiffness of the joint at O, 3 x 3
    stiffness_N_m = [[20000.0, 0.0, 0.0], [0.0, 20000.0, 0.0], [0.0, 0.0, 20000.0]]

    [sources]                        # optional: what each part was taken from
    cuff = "..."

Beside the file of a wrist may stand its design in the place of all these tables, as ``[design]`` with the keys of a
design file; it has to be the one of the robot's file. What else a device file may say of its robot's file:
:mod:`exo_pin.device.files.robot_files`.

Laws: ``constant`` (force_N of a spring between points; effort_N or effort_N_m of one on a joint), ``linear``
(stiffness_N_m and slack_m, or stiffness_N_m_rad and slack_rad; only_pulls = true for a spring that goes slack), ``gas``
(extended_force_N, extended_length_m, gas_height_m, exponent) and ``table``. Between points a spring's force is its
pull, as that of a tendon. On a joint it is the joint's effort: positive turns or pushes towards larger coordinates, as
efforts of URDF, MuJoCo and OpenSim do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ...chain import ClosedChain
from ...chain.formats.closures_file import read_roles
from ...core.conventions import Side, as_side
from ...core.files.toml_tables import TomlTable, naming_file, read_toml
from ...design import Actuator, Interface, Interfaces, LimbGuide, Mechanism, Shoulder, Stroke
from ...design.io.mechanism_files import SCHEMA as DESIGN_SCHEMA
from ...design.io.mechanism_reading import read_arm, read_interface, read_record, read_root
from ..chain_device import ChainDevice
from ..chain_roles import is_same_arm
from ..parts.drives import Brake, Drive, Spring
from ..parts.laws import ConstantForce, GasSpring, LinearSpring, SpringLaw, TableLaw
from ..parts.routes import Route, RoutePoint
from ..parts.soft_parts import GuidedSlide, SoftLink

#: What the name of a device file ends in.
ENDING = ".device.toml"
SCHEMA = 1
#: Keys that :mod:`.robot_files` reads.
OF_ROBOT = ("geometry_tolerance", "left_out", "closures", "joints", "in_file", "rest")
INTERFACES = ("harness", "cuff")
#: What a robot's file says of its driven joints, too.
LIMITS = ("lower", "upper", "least", "greatest", "speed_limit")
#: Kinds of unit of coordinates and of efforts, of what slides and of what turns.
_LENGTH, _EFFORT = ("length", "angle"), ("force", "couple")


def device_file_of(robot: str | PathLike[str]) -> Path | None:
    """The device file beside a robot's file; None if there is none."""
    found = Path(robot).with_suffix(ENDING)
    return found if found.is_file() else None


def robot_of(path: str | PathLike[str]) -> Path:
    """The robot's file that a device file names.

    Raises
    ------
    FileFormatError
        If the file is none.
    """
    named = read_toml(path).text("robot", required=False)
    own = Path(path)
    return own.with_name(own.name.removesuffix(ENDING) + ".urdf") if named is None else own.parent / named


def is_device_file(path: str | PathLike[str]) -> bool:
    """Whether a TOML file is that of a device beside a robot's, and no design file."""
    return Path(path).name.endswith(ENDING) or read_toml(path).is_text("device")


def device_file_at(path: str | PathLike[str]) -> Path:
    """The device file that a path names: itself, or the one that the file of a saved device points to."""
    if Path(path).name.endswith(ENDING):
        return Path(path)
    table = read_toml(path)
    table.require_schema(SCHEMA)
    found = Path(path).parent / str(table.text("device"))
    table.finish()
    return found


def design_of(path: str | PathLike[str]) -> Mechanism | None:
    """The design of the wrist that a device file is of; None where it is of no wrist, or leaves it to the robot's file.

    Raises
    ------
    FileFormatError
        If the design has an unknown, missing or wrong key, or the file says more of the device.
    """
    whole = read_toml(path)
    table = whole.table("design")
    if table is None:
        return None
    whole.skip("schema", "name", "robot", "side", "title", "roles", *OF_ROBOT)
    for key in whole.content:
        raise whole.error("no effect beside [design], which says all; [[springs]] may stand in a design file", key)
    table.require_schema(DESIGN_SCHEMA)
    with naming_file(path):
        return read_root(table)


def read_design(path: str | PathLike[str]) -> tuple[Mechanism, tuple[Spring, ...]]:
    """The wrist of a design file, and the springs between torso and arm that it has besides limbs.

    Raises
    ------
    FileFormatError
        If the file has an unknown, missing or wrong key.
    """
    table = read_toml(path)
    table.require_schema(DESIGN_SCHEMA)
    with naming_file(path):
        springs = tuple(_spring(item) for item in table.tables("springs"))
        return read_root(table), springs


def side_alone(path: str | PathLike[str]) -> Side | None:
    """The side that a device file states if it says nothing else of the robot; None if it says more, or no side."""
    table = read_toml(path)
    table.require_schema(SCHEMA)
    table.skip("name", "robot", "title")
    side = table.text("side", required=False, choices=("left", "right"))
    return None if side is None or not table.is_used_up else as_side(side)


def read_device(path: str | PathLike[str], chain: ClosedChain, side: str | None) -> ChainDevice:
    """A device of a robot with the springs and drives of its device file, for its side of the body or a given one.

    Raises
    ------
    FileFormatError
        If the file has an unknown, missing or wrong key, or is for the other side than asked.
    InvalidInput, UnknownName
        If the robot names no arm, or a spring or drive names a joint or link that it has not.
    """
    table = read_toml(path)
    table.require_schema(SCHEMA)
    name, title = str(table.text("name")), table.text("title", required=False) or ""
    roles = table.table("roles")
    table.skip("robot", "roles", "design", *OF_ROBOT)
    own = table.text("side", required=False, choices=("left", "right"))
    if side is not None and own is not None and side != own:
        raise table.error(
            f"this robot was built for the {own} shoulder, not the {side}: leave the side out, and use mirrored() then",
            "side",
        )
    with naming_file(path):
        springs = tuple(_spring(item) for item in table.tables("springs"))
        drives = [_drive(item) for item in table.tables("drives")]
        brakes = tuple(_brake(item) for item in table.tables("brakes"))
        parts: dict[str, Any] = {key: _interface(item) for key in INTERFACES if (item := table.table(key)) is not None}
        parts["cuff_area"] = table.quantity("area", "cuff_area", required=False)
        guided = tuple(_guided(item) for item in table.tables("guided_slides"))
        soft = tuple(SoftLink(str(item.text("link")), _interface(item)) for item in table.tables("soft_links"))
        arm_given = table.table("arm")
        arm = None if arm_given is None else read_arm(arm_given, {})
        shoulder = read_record(Shoulder, table.table("shoulder"), {}) or Shoulder()
        is_complete, sources = table.flag("drives_are_complete"), table.mapping("sources")
        table.finish()
        if roles is not None and chain.roles.arm is None:
            of_device = read_roles(roles)
            of_device = replace(of_device, actuated=of_device.actuated or chain.roles.actuated)
            chain = type(chain)(chain.model, replace(chain.description, roles=of_device))
        device = ChainDevice.from_chain(chain, side or own or "left")
        if arm is None:
            arm = device.arm
        elif not is_same_arm(arm, device.arm):
            told = "nothing" if device.arm is None else f"{device.arm.mass:.6g} kg about {device.arm.centre_of_mass} m"
            own = f"{arm.mass:.6g} kg about {arm.centre_of_mass} m"
            cure = "leave [arm] out, or write the robot's file with more decimals where it rounds them"
            raise table.error(f"this arm, {own}, is not the one of the robot's file, {told}: {cure}", "arm")
        stated = {spring.name for spring in springs}
        springs = (*(own for own in device.springs if own.name not in stated), *springs)
        return device.replace(
            drives=tuple(drives) if is_complete else with_drives(device.drives, drives), springs=springs, name=name,
            title=title, interfaces=Interfaces(**parts), soft_links=soft, guided_slides=guided, shoulder=shoulder,
            arm=arm, sources=sources, brakes=brakes,
        )  # fmt: skip


def with_drives(of_robot: Sequence[Drive], stated: Sequence[Drive]) -> tuple[Drive, ...]:
    """The drives of a robot's file with those that a device file states: what it leaves out is as in the robot's."""
    named = {drive.name: drive for drive in stated}
    kept = [_completed(named.pop(own.name, own), own) for own in of_robot]
    return (*kept, *named.values())


def _completed(drive: Drive, own: Drive) -> Drive:
    """A drive of the file with what it leaves out and the robot's own joint says; a limb's file says all of it."""
    if drive.joint != own.joint or drive.pulls:
        return drive
    missing = {key: getattr(own, key) for key in LIMITS if getattr(drive, key) is None}
    return replace(drive, **missing)


def _either(table: TomlTable, kinds: tuple[str, str], key: str, shape: Any = (), required: bool = False) -> Any:
    """A value in one of two kinds of unit, of a length or of an angle; None if it is absent."""
    values = [table.quantity(kind, key, shape, required=False) for kind in kinds]
    given = [value for value in values if value is not None]
    if len(given) == 2:
        raise table.error("given twice, with two units", key)
    if not given and required:
        return table.quantity(kinds[0], key, shape)
    return given[0] if given else None


def _guided(table: TomlTable) -> GuidedSlide:
    slide, guide = str(table.text("slide")), read_record(LimbGuide, table.table("guide"), {})
    table.finish()
    return GuidedSlide(slide, guide)


def _interface(table: TomlTable) -> Interface:
    """A spring of six freedoms by its axes, or by blocks as in a design file."""
    translational = table.quantity("stiffness", "translational", (3,), required=False)
    if translational is None:
        return read_interface(table)
    rotational = table.quantity("twist stiffness", "rotational", (3,))
    at = table.quantity("length", "at", (3,))
    table.finish()
    return Interface.of(translational, rotational, at)


def _place(table: TomlTable) -> dict[str, Any]:
    points = []
    for item in table.tables("points"):
        link, point = str(item.text("link")), item.quantity("length", "point", (3,))
        item.finish()
        points.append(RoutePoint(link, tuple(np.asarray(point).tolist())))
    route = Route(tuple(points)) if points else None
    return {"name": str(table.text("name")), "joint": table.text("joint", required=False), "route": route}


def _brake(table: TomlTable) -> Brake:
    found = Brake(str(table.text("name")), str(table.text("joint")), _either(table, _EFFORT, "limit"))
    table.finish()
    return found


def _spring(table: TomlTable) -> Spring:
    place, kind = _place(table), str(table.text("law", choices=_LAWS))
    law = _LAWS[kind](table, place["joint"] is not None)
    table.finish()
    return Spring(law=law, **place)


def _pull(table: TomlTable, on_joint: bool, plural: str = "") -> Any:
    """What a law pulls with: of a spring between points as stated, of one on a joint against the effort."""
    shape: tuple[None, ...] = (None,) if plural else ()
    if not on_joint:
        return table.quantity("force", f"force{plural}", shape)
    for old in (f"force{plural}_N", f"moment{plural}_N_m"):
        if old in table:
            new = old.replace("force", "effort").replace("moment", "effort")
            raise table.error(f"of a spring on a joint write {new} with the opposite sign: positive efforts turn or "
                              "push towards larger coordinates", old)  # fmt: skip
    return -np.asarray(_either(table, _EFFORT, f"effort{plural}", shape, required=True))


def _constant(table: TomlTable, on_joint: bool) -> SpringLaw:
    return ConstantForce(float(_pull(table, on_joint)))


def _linear(table: TomlTable, _: bool) -> SpringLaw:
    stiffness = _either(table, ("stiffness", "twist stiffness"), "stiffness", required=True)
    slack = _either(table, _LENGTH, "slack")
    return LinearSpring(stiffness, 0.0 if slack is None else slack, table.flag("only_pulls"))


def _gas(table: TomlTable, _: bool) -> SpringLaw:
    exponent = table.quantity("number", "exponent", required=False)
    force, length = table.quantity("force", "extended_force"), table.quantity("length", "extended_length")
    return GasSpring(force, length, table.quantity("length", "gas_height"), 1.0 if exponent is None else exponent)


def _table(table: TomlTable, on_joint: bool) -> SpringLaw:
    at = _either(table, _LENGTH, "coordinates", (None,), required=True)
    return TableLaw(tuple(np.asarray(at).tolist()), tuple(_pull(table, on_joint, "s").tolist()))


_LAWS = {"constant": _constant, "linear": _linear, "gas": _gas, "table": _table}


def _drive(table: TomlTable) -> Drive:
    place = _place(table)
    limits = {key: _either(table, _EFFORT, key) for key in ("lower", "upper")}
    limits |= {key: _either(table, _LENGTH, key) for key in ("least", "greatest", "play", "resolution")}
    limits["speed_limit"] = _either(table, ("speed", "rate"), "speed")
    limits["power_limit"] = table.quantity("power", "power", required=False)
    own = {key: read_record(kind, table.table(key), {}) for key, kind in (("actuator", Actuator), ("stroke", Stroke))}
    pulls, zero = table.flag("pulls"), table.quantity("length", "zero_length", required=False)
    motor = table.table("motor")
    if motor is not None:
        limits |= _geared(table, motor, place, limits)
    table.finish()
    return Drive(pulls=pulls, zero_length=0.0 if zero is None else zero, **place, **limits, **own)


def _geared(table: TomlTable, motor: TomlTable, place: dict[str, Any], limits: dict[str, Any]) -> dict[str, Any]:
    """Limits at the joint of a motor with a gear, which stand in the place of those that the joint states itself."""
    if place["joint"] is None:
        raise table.error("expected a joint, which a motor turns", "joint")
    if any(limits[key] is not None for key in ("lower", "upper", "speed_limit")):
        raise table.error("expected either a motor, or lower, upper and speed of the joint", "motor")
    torque, speed = motor.quantity("couple", "torque"), motor.quantity("rate", "speed", required=False)
    ratio = motor.quantity("number", "ratio")
    motor.finish()
    drive = Drive.geared(place["name"], place["joint"], torque, ratio, speed)
    return {"lower": drive.lower, "upper": drive.upper, "speed_limit": drive.speed_limit}
