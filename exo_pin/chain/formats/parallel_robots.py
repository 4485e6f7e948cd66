"""The ``robot.yaml`` layout of toolbox-parallel-robots: a URDF, and beside it its loops and motors.

::

    closed_loop: [["loop1_A", "loop1_B"], ["loop2_A", "loop2_B"]]   # pairs of frames of the URDF
    type: ["6d", "3d"]                                              # rigid, or only the origins
    name_mot: ["motor1", "motor2"]                                  # actuated joints
    joint_name: ["ball1", "cross1", "weld1"]                        # optional: joints of the URDF that are others
    joint_type: ["SPHERICAL", "UJOINT_XY", "FIXED"]

A joint that is changed to SPHERICAL turns about all its axes; UJOINT with any two different axes becomes two hinges,
of UJOINT_XY ``cross1_X`` and then ``cross1_Y``; CARDAN, of older files, is UJOINT_XY; FIXED does not move. A changed
joint has no limits: those of the URDF are the hinge's that it was. Its damping and friction have to be zero in the
URDF, because they are no longer about one axis. All other joints are as in the URDF. The keys of older layouts, which
find parts by texts in their names, are errors that name the present ones.

The part of YAML that a robot's file needs: lists and mappings of texts and nothing.

The nodes that PyYAML composes become values: a file can make no other type (numbers, dates, sets, objects), and no
work beyond its own length. Aliases, which stand for the value of an anchor and may be nested to any size, and tags are
errors; a merge key is a key like others. A plain scalar is None if it is empty, ``~`` or ``null``, else a text.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from itertools import permutations
from os import PathLike
from pathlib import Path
from typing import Any

import pinocchio as pin

from ...core.errors import FileFormatError, UnknownName
from ...core.files.atomic import read_text
from ...core.files.toml_tables import naming_file
from ...core.optional_packages import optional
from ...core.validation import as_choice
from ..structure.closures import Closure
from ..structure.description import Closures, Roles
from .bodies import rebuilt
from .joint_data import joint_data, refuse_data, repair_limits
from .urdf.urdf_loading import load_model

#: Lists and mappings within each other.
_DEEPEST = 32
_NOTHING = ("", "~", "null", "Null", "NULL")


_TYPES = {"6d": "rigid", "3d": "spherical"}
_KEYS = ("closed_loop", "type", "name_mot", "joint_name", "joint_type")
#: Keys of older layouts, and what says the same now.
_OLDER_KEYS = {
    "name_closedloop": "closed_loop, pairs of frames",
    "closed_loop_number": "closed_loop, pairs of frames",
    "rotule_name": "joint_name, with SPHERICAL in joint_type",
    "Lidmot": "name_mot, names of joints",
    "Lidvmot": "name_mot, names of joints",
}
_HINGES = {"X": pin.JointModelRX(), "Y": pin.JointModelRY(), "Z": pin.JointModelRZ()}
#: What joints become, one after the other, by what is added to their names; a fixed one is none.
_JOINT_TYPES: dict[str, dict[str, pin.JointModel]] = {"SPHERICAL": {"": pin.JointModelSpherical()}, "FIXED": {}}
_JOINT_TYPES |= {
    f"UJOINT_{one}{other}": {f"_{one}": _HINGES[one], f"_{other}": _HINGES[other]}
    for one, other in permutations("XYZ", 2)
}
_JOINT_TYPES["CARDAN"] = _JOINT_TYPES["UJOINT_XY"]


def parse_yaml(text: str) -> Any:
    """The value of a YAML text.

    Raises
    ------
    FileFormatError
        If it is not YAML, has an alias, a tag, a second document, a key that is no text or is given twice in a mapping,
        or is nested deeper than 32 levels. The message names the line.
    MissingExtra
        If PyYAML is not installed.
    """
    yaml = optional("robots", "yaml")
    depth = 0
    try:
        # Before nodes are composed, which calls itself once a level.
        for event in yaml.parse(text, yaml.BaseLoader):
            line = event.start_mark.line + 1
            if isinstance(event, yaml.AliasEvent):
                raise FileFormatError(f"line {line}: the alias *{event.anchor} is not read: write the value itself")
            if isinstance(event, yaml.NodeEvent) and event.tag is not None:
                raise FileFormatError(f"line {line}: the tag {event.tag} is not read: leave it out")
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST:
                raise FileFormatError(f"line {line}: nested deeper than {_DEEPEST} levels")
        node = yaml.compose(text, yaml.BaseLoader)
    except FileFormatError:
        raise
    except yaml.composer.ComposerError:
        raise FileFormatError("expected one YAML document, there are more") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # a number in a directive or an escape that is none
        raise FileFormatError(f"not YAML: {error}") from None
    return None if node is None else _value(node)


def _value(node: Any) -> Any:
    if node.id == "scalar":
        return None if node.style is None and node.value in _NOTHING else node.value
    if node.id == "sequence":
        return [_value(item) for item in node.value]
    found: dict[str, Any] = {}
    for key, value in node.value:
        line = key.start_mark.line + 1
        if key.id != "scalar":
            raise FileFormatError(f"line {line}: expected a text as a key, got a list or mapping")
        if key.value in found:
            raise FileFormatError(f"line {line}: {key.value!r} is given twice")
        found[key.value] = _value(value)
    return found


def read_parallel_robot(
    path: str | PathLike[str],
    urdf: str | PathLike[str] | None = None,
    root_joint: str | None = None,
    right_angle_tolerance: float = 0.0,
    leave_out: Iterable[str] = (),
) -> tuple[pin.Model, Closures]:
    """Load a robot in the ``robot.yaml`` layout of toolbox-parallel-robots.

    See :mod:`exo_pin.chain.formats.parallel_robots`.

    Parameters
    ----------
    path : path-like
        The YAML file, or the folder of a ``robot.yaml``.
    urdf : path-like, optional
        The URDF; by default the file beside it with the same stem.
    root_joint : str, optional
        How the root link hangs in the world, one of :data:`exo_pin.chain.ROOT_JOINTS`, which the layout does not say;
        fixed by default.
    right_angle_tolerance : float
    leave_out : iterable of str
        As for :meth:`exo_pin.ClosedChain.from_urdf`.

    Returns
    -------
    pinocchio.Model
        The tree.
    Closures
        Its loops, roles and springs; of both ``ClosedChain.from_parallel_robot`` makes the chain.

    Raises
    ------
    FileFormatError
        If the file is not YAML, has an alias or tag, or a key is unknown, missing, of a wrong kind or of an older
        layout.
    UnknownName
        If a loop's or a joint's type is not known, or a frame or joint is not in the URDF.
    InvalidInput
        If a joint that is changed has damping or friction in the URDF.
    MissingExtra
        If PyYAML is not installed.

    Examples
    --------
    >>> from pathlib import Path
    >>> arms = '<body name="{0}"><joint name="{0}_hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 1"/></body>'
    >>> bodies = arms.format("left") + arms.format("right")
    >>> urdf = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>").to_urdf("robot")
    >>> loops = '{closed_loop: [["left", "right"]], type: ["6d"], name_mot: ["left_hinge"]}'
    >>> size = Path("robot/robot.yaml").write_text(loops)
    >>> chain = ep.ClosedChain.from_parallel_robot("robot", urdf)
    >>> chain.mobility([0.0, 0.0]).degrees_of_freedom  # the two arms move as one
    1
    """
    if isinstance(path, (str, PathLike)) and os.path.isdir(path):
        path = Path(path) / "robot.yaml"
    text = read_text(path)
    file = Path(path)
    with naming_file(file):
        data = parse_yaml(text)
    if not isinstance(data, dict):
        raise FileFormatError("expected keys with values", file)
    for key in data:
        if key in _OLDER_KEYS:
            raise FileFormatError(f"{key} is of an older layout: write {_OLDER_KEYS[key]}", file, key)
        if key not in _KEYS:
            raise FileFormatError(str(UnknownName("key", key, _KEYS)), file, str(key))
    source = urdf if urdf is not None else file.with_suffix(".urdf")
    described, changes = _described(data, file)
    model, described = load_model(source, described, root_joint, right_angle_tolerance, leave_out)
    for joint in changes:
        if joint not in model.names:
            raise UnknownName("joint", joint, list(model.names)[1:], where=str(file))
    return _changed(model, changes) if changes else model, described


def _described(data: dict[str, Any], file: Path) -> tuple[Closures, dict[str, str]]:
    """The loops and actuated joints, and joints of another type."""
    loops, kinds, motors = (_listed(data, key, file, required=True) for key in _KEYS[:3])
    names, others = (_listed(data, key, file, required=False) for key in _KEYS[3:])
    _same_length(file, closed_loop=loops, type=kinds)
    _same_length(file, joint_name=names, joint_type=others)
    for pair, kind in zip(loops, kinds, strict=True):
        if not isinstance(pair, list) or len(pair) != 2 or not all(isinstance(name, str) for name in pair):
            raise FileFormatError(f"expected pairs of frames, got {pair!r}", file, "closed_loop")
        if not isinstance(kind, str) or kind.lower() not in _TYPES:
            raise UnknownName("type of a closed loop", kind, _TYPES, where=str(file))
    for name in (*motors, *names):
        if not isinstance(name, str):
            raise FileFormatError(f"expected names of joints, got {name!r}", file, "name_mot")
    for kind in others:
        as_choice("type of a joint", kind, _JOINT_TYPES, str(file))
    closures = tuple(Closure(f"{a}-{b}", _TYPES[kind.lower()], a, b) for (a, b), kind in zip(loops, kinds, strict=True))
    described = Closures(file.parent.name or file.stem, closures=closures, roles=Roles(tuple(motors)))
    return described, dict(zip(names, others, strict=True))


def _listed(data: dict[str, Any], key: str, file: Path, required: bool) -> list[Any]:
    if key not in data and required:
        raise FileFormatError(f"missing key {key!r}", file, key)
    value = data.get(key)
    if value is None and (key not in data or key.startswith("joint")):
        return []
    if not isinstance(value, list):
        raise FileFormatError(f"expected {key} to be a list, got {value!r}", file, key)
    return value


def _same_length(file: Path, **lists: list[Any]) -> None:
    (one, first), (other, second) = lists.items()
    if len(first) != len(second):
        raise FileFormatError(f"{one} has {len(first)} entries, {other} has {len(second)}", file, other)


def _changed(model: pin.Model, changes: dict[str, str]) -> pin.Model:
    """The same tree with some joints of another type.

    Raises
    ------
    InvalidInput
        If a joint of another type had damping or friction.
    """
    data, kinds = joint_data(model, ()), {}
    for joint, name in enumerate(model.names):
        if name in changes:
            lost = [what for what in data[joint].present if what in ("damping", "friction")]
            refuse_data(f"the joint type {changes[name]}", name, lost)
            kinds[joint] = _JOINT_TYPES[changes[name]]
    new = rebuilt(model, {joint: kind for joint, kind in kinds.items() if kind})
    welded = [new.getJointId(model.names[joint]) for joint, kind in kinds.items() if not kind]
    if welded:
        new = pin.buildReducedModel(new, welded, pin.neutral(new))
        repair_limits(new)
    return new
