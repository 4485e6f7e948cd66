"""Closures files: one TOML file beside a URDF that says what closes its loops.

A URDF is a tree. Beside ``robot.urdf`` stands ``robot.closures.toml``::

    schema = 1
    name = "robot"
    left_out = []                        # optional: what the file that this one was made from had and the chain has not
    geometry_tolerance = 5e-7            # optional: half a unit of the last digit of a rounded geometry, m and rad
    [root]                               # optional: how the URDF's root link hangs in the world
    joint = "fixed"                      # fixed (default) | spherical | free_flyer | planar | translation
    name = "root_joint"                  # of that joint, if it is not fixed
    gravity_m_s2 = [0.0, 0.0, -9.81]     # default

    [[closures]]
    name = "loop"
    type = "rigid"                       # what it allows, see below
    frame_a = "hand"                     # a link or joint of the URDF, or "universe", the world
    frame_b = "universe"
    translation_a_m = [0.0, 0.0, 0.1]    # optional: where the closure's frame stands in frame_a, frame_b
    quaternion_a_xyzw = [0.0, 0.0, 0.0, 1.0]
    translation_b_m = [0.4, 0.0, 0.0]
    quaternion_b_xyzw = [0.0, 0.0, 0.0, 1.0]
    # axis = [0.0, 0.0, 1.0]             # optional, of revolute, prismatic, cylindrical: in the closure's frame
    # distance_m = 0.3                   # of distance, and only there

    [[closures]]
    name = "gear"
    type = "coupling"
    joint_a = "elbow"                    # left out: joint b is held
    joint_b = "finger"                   # a hinge or slide of the URDF, as joint a
    polynomial = [0.0, -0.5]             # up to five coefficients, m and rad
    references = [0.0, 0.0]              # optional: positions r_a, r_b of the joints

    [[joints]]                           # optional: what a URDF cannot say about a joint
    name = "elbow"
    # type = "spherical"                 # optional: of a joint that the URDF calls floating: spherical | translation
    stiffness_N_m_rad = 4.0              # of the spring in a joint that turns; stiffness_N_m (or _N_mm) if it slides
    spring_reference = [0.3]             # optional: coordinates in q where it is slack, by default the neutral ones
    armature_kg_m2 = [0.02]              # optional: of the actuator's rotor, one number for each coordinate of v;
                                         # armature_kg if the joint slides. Damping and friction: <dynamics> of URDF

    [roles]                              # optional: what the parts are for
    actuated = ["slide"]                 # joints that carry an actuator
    shoulder = "root_joint"              # the joint (or closure) whose reaction is asked for
    arm = "arm"                          # the link that it carries
    reference_point = "arm"              # frame with its origin at the shoulder centre O
    cuff = "cuff"                        # frame on the arm with its origin in the middle of the cuff

    [[roles.limbs]]
    name = "limb_1"
    kind = "UPU"                         # or SPS
    slide = "limb_1_slide"               # the limb's actuated joint
    platform_joint = "limb_1_platform_y" # its first joint after the arm
    closure = "limb_1_base"              # the closure that holds it to the torso

The types, with the rows that they cost:

* rigid (6): nothing moves;
* spherical, also called point (3): the frames' origins coincide;
* revolute (5): turning about the axis, by default the closure frame's z;
* universal (4): turning about the y axis of frame b and the x axis of frame a, which stay at right angles;
* prismatic (5): sliding along the axis; cylindrical (4): sliding along it and turning about it;
* distance (1): the frames' origins keep their distance, as the ends of a rod between two ball joints;
* coupling (1): a position follows another one, q_b - r_b = c_0 + c_1 (q_a - r_a) + ... + c_4 (q_a - r_a)⁴, as of gears,
  racks and mimic joints. It joins joints and not frames.

Lengths may also be given in mm (``translation_b_mm``). Orientations are unit quaternions, because roll, pitch and
yaw lose digits near their lock. A joint that both slides and turns, as a free flyer, has ``stiffness`` and
``armature`` without a unit: SI by the coordinate. A spring reference is in m and rad, a turn about all axes as a unit
quaternion (x, y, z, w); an endless hinge has no spring. An unknown key, type, frame, joint or closure is an error that
lists what there is; frames, joints and the units of their data are checked when a model is loaded.

The table of roles in TOML files of chains and of devices.
"""

from __future__ import annotations

from dataclasses import asdict
from os import PathLike
from typing import Any

import tomli_w

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.checked import checked
from ...core.files import write_text
from ...core.files.toml_tables import TomlTable, naming_file, read_toml
from ...core.validation import as_choice
from ..structure.closures import TYPES, Closure
from ..structure.description import Closures, JointProperties, LimbRole, Roles, Root
from ..structure.frames import Placement

_SCHEMA = 1
#: Roles of single parts.
_PARTS = ("shoulder", "arm", "reference_point", "cuff")
#: Keys of stiffness and armature by the unit of the joint's coordinates, and their kinds in the table of units.
_JOINT_KEYS = {
    "m": (("stiffness", "stiffness", "_N_m"), ("mass", "armature", "_kg")),
    "rad": (("twist stiffness", "stiffness", "_N_m_rad"), ("inertia", "armature", "_kg_m2")),
    None: (("number", "stiffness", ""), ("number", "armature", "")),
}


def read_roles(table: TomlTable) -> Roles:
    """The table ``[roles]``."""
    actuated, limbs = table.texts("actuated"), []
    parts = {key: table.text(key, required=False) for key in _PARTS}
    for limb in table.tables("limbs"):
        texts = [limb.text(key) for key in ("name", "kind", "slide", "platform_joint", "closure")]
        limb.finish()
        limbs.append(LimbRole(*texts))  # type: ignore[arg-type]
    table.finish()
    return Roles(actuated, limbs=tuple(limbs), **parts)


def read_closures(path: str | PathLike[str]) -> Closures:
    """Load a closures file.

    Parameters
    ----------
    path : str or path-like
        A TOML file.

    Returns
    -------
    Closures
        As written: lengths in m, angles in rad.

    Raises
    ------
    FileFormatError
        If the file is not TOML, or a key is unknown, missing or has a wrong value; the key is named.
    UnknownName
        If a closure type, root joint or closure name is not known; the message lists those there are.

    Examples
    --------
    >>> from exo_pin.chain import read_closures
    >>> path = ep.load("scenario-one").chain_with_masses().to_urdf("robot")
    >>> closures = read_closures(path.with_suffix(".closures.toml"))
    >>> closures.root.joint, [closure.type for closure in closures.closures]
    ('spherical', ['rigid', 'rigid', 'rigid'])
    """
    table = read_toml(path)
    table.require_schema(_SCHEMA)
    try:
        with naming_file(path):
            return _read_root_table(table)
    except UnknownName as error:
        raise UnknownName(error.kind, error.name, error.available, where=str(path)) from error


@checked
def write_closures(closures: Closures, path: str | PathLike[str], comment: str = "") -> None:
    """Save a closures file, so that it loads back bit for bit. It appears whole or not at all.

    Parameters
    ----------
    closures : Closures
        What to save.
    path : path-like
        The file.
    comment : str
        Lines for the head of the file.

    Examples
    --------
    >>> from exo_pin.chain import read_closures, write_closures
    >>> closures = ep.load("appendix-d").chain.description
    >>> write_closures(closures, "mine.closures.toml", "As in Appendix D.")
    >>> read_closures("mine.closures.toml").closures == closures.closures
    True
    """
    write_text(path, closures_text(closures, comment))


def closures_text(closures: Closures, comment: str = "") -> str:
    """The text of a closures file."""
    root, roles = closures.root, closures.roles
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    head = {"schema": _SCHEMA, "name": closures.name, "left_out": closures.left_out or None}
    lines += _pairs(head | {"geometry_tolerance": closures.tolerance or None})
    lines += ["", "[root]", *_pairs({"joint": root.joint, "name": root.name, "gravity_m_s2": root.gravity})]
    for closure in closures.closures:
        lines += ["", "[[closures]]", *_pairs(closure_values(closure))]
    for joint in closures.joints:
        lines += ["", "[[joints]]", *_pairs(joint_values(joint))]
    if roles != Roles():
        lines += ["", "[roles]", *_pairs({key: getattr(roles, key) for key in ("actuated", *_PARTS)})]
    for limb in roles.limbs:
        lines += ["", "[[roles.limbs]]", *_pairs(asdict(limb))]
    return "\n".join(lines) + "\n"


def closure_values(closure: Closure) -> dict[str, Any]:
    """The table of a closure."""
    found: dict[str, Any] = {"name": closure.name, "type": closure.type}
    if closure.polynomial is not None:
        found |= {"joint_a": None if closure.frame_a == "universe" else closure.frame_a, "joint_b": closure.frame_b}
        references = closure.references if any(closure.references) else None
        return found | {"polynomial": closure.polynomial, "references": references}
    found |= {"frame_a": closure.frame_a, "frame_b": closure.frame_b}
    for end, placement in (("a", closure.placement_a), ("b", closure.placement_b)):
        if placement != Placement():
            found |= {f"translation_{end}_m": placement.translation, f"quaternion_{end}_xyzw": placement.quaternion}
    return found | {"axis": closure.axis, "distance_m": closure.distance}


def joint_values(joint: JointProperties) -> dict[str, Any]:
    """The table of a joint's spring, armature and type."""
    (_, stiffness, per_unit), (_, armature, suffix) = _JOINT_KEYS[joint.unit]
    found: dict[str, Any] = {"name": joint.joint, "type": joint.type}
    if joint.type is None or joint.stiffness:
        found[stiffness + per_unit] = joint.stiffness
    return found | {"spring_reference": joint.spring_reference, armature + suffix: joint.armature}


def _pairs(values: dict[str, Any]) -> list[str]:
    """A line for each value that is given."""
    return [_pair(key, value) for key, value in values.items() if value is not None]


def _pair(key: str, value: Any) -> str:
    """One ``key = value`` line; a list stays on its line, which tomli_w would break."""
    if isinstance(value, tuple):
        return f"{key} = [{', '.join(_pair('x', item)[4:] for item in value)}]"
    return tomli_w.dumps({key: value}).rstrip("\n")


def _read_root_table(table: TomlTable) -> Closures:
    name, left_out = table.text("name"), table.texts("left_out")
    tolerance = table.quantity("number", "geometry_tolerance", (), required=False)
    root_table, roles_table = table.table("root"), table.table("roles")
    closure_tables, joint_tables = table.tables("closures"), table.tables("joints")
    table.finish()
    assert name is not None
    return Closures(
        name,
        Root() if root_table is None else _read_root(root_table),
        tuple(map(read_closure, closure_tables)),
        Roles() if roles_table is None else read_roles(roles_table),
        tuple(map(read_joint, joint_tables)),
        left_out,
        0.0 if tolerance is None else tolerance,
    )


def _given(**values: Any) -> dict[str, Any]:
    """Those that a file states, the others to be left to the defaults."""
    return {key: value for key, value in values.items() if value is not None}


def _read_root(table: TomlTable) -> Root:
    joint, name = table.text("joint", required=False), table.text("name", required=False)
    gravity = table.quantity("acceleration", "gravity", (3,), required=False)
    table.finish()
    return Root(**_given(joint=joint, name=name, gravity=gravity))


def read_closure(table: TomlTable) -> Closure:
    """The closure of a table."""
    name, kind = str(table.text("name")), str(table.text("type"))
    as_choice("closure type", kind, TYPES, f"closure {name!r}")
    if TYPES[kind].is_coupling:
        return _read_coupling(table, name, kind)
    frame_a, frame_b = (str(table.text(key)) for key in ("frame_a", "frame_b"))
    places: dict[str, Any] = {}
    for end in ("a", "b"):
        translation = table.quantity("length", f"translation_{end}", (3,), required=False)
        quaternion = table.quantity("number", f"quaternion_{end}_xyzw", (4,), required=False)
        try:
            places[f"placement_{end}"] = Placement(**_given(translation=translation, quaternion=quaternion))
        except InvalidInput as error:
            raise table.error(str(error), f"quaternion_{end}_xyzw") from error
    axis = table.quantity("number", "axis", (3,), required=False)
    distance = table.quantity("length", "distance", (), required=False)
    table.finish()
    return Closure(name, kind, frame_a, frame_b, **places, **_given(axis=axis, distance=distance))


def _read_coupling(table: TomlTable, name: str, kind: str) -> Closure:
    joint_a, joint_b = table.text("joint_a", required=False), table.text("joint_b")
    polynomial = table.quantity("number", "polynomial", (None,))
    references = table.quantity("number", "references", (2,), required=False)
    table.finish()
    joint_a = "universe" if joint_a is None else joint_a
    return Closure(name, kind, joint_a, str(joint_b), polynomial=polynomial, **_given(references=references))


def read_joint(table: TomlTable) -> JointProperties:
    """The spring, armature and type of a joint from a table."""
    name, type_ = table.text("name"), table.text("type", required=False)
    reference = table.quantity("number", "spring_reference", (None,), required=False)
    found: dict[str, tuple[str | None, Any]] = {}
    for unit, keys in _JOINT_KEYS.items():
        for (kind, key, _), shape in zip(keys, ((), (None,)), strict=True):
            value = table.quantity(kind, key, shape, required=False)
            if value is not None and key in found:
                raise table.error("given in two units", key)
            if value is not None:
                found[key] = (unit, value)
    table.finish()
    units = {unit for unit, _ in found.values()}
    if len(units) > 1:
        raise table.error("stiffness and armature are of joints that move in different units", "armature")
    given = {key: value for key, (_, value) in found.items()}
    try:
        return JointProperties(name, spring_reference=reference, **given, unit=next(iter(units), None), type=type_)  # type: ignore[arg-type]
    except InvalidInput as error:
        raise table.error(str(error), "name") from error
