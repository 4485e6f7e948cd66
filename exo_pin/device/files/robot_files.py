"""The robot of a device: its file, and what its device file says otherwise.

Beside an MJCF or SDF that this package has written, a device file has these tables besides, because the format has no
words for them; what they say is in the device's own names::

    geometry_tolerance = 5e-7        # as in a closures file, as are the tables of closures and joints
    gravity_m_s2 = [0.0, 3.0, -9.0]  # optional, in the place of that of the robot's file
    left_out = []
    [[closures]]                     # all of them, in the place of those that the robot's file has
    [[joints]]                       # springs and armatures of joints, likewise

    [in_file]                        # how the robot's file says it
    helpers = ["loop_helper_0"]      # joints of bodies that only stand for a closure
    closing = ["loop"]               # joints that are closures here
    [in_file.frames]                 # links and sites that are called otherwise there
    arm = "arm_link"
    [[in_file.joints]]
    name = "strut"
    called = "strut_joint"           # optional: its name there
    zero = [0.1]                     # optional: its coordinates where it reads zero there, m, rad, (x, y, z, w)
    inertia = [...]                  # optional: of its link, which has another there because simulators need some: mass
                                     # kg, centre m, moments xx, xy, yy, xz, yz, zz about it kg m², in the joint's frame
    damping = [0.5]                  # optional, SI, and likewise friction, armature, lower_effort, upper_effort, speed,
                                     # lower_position, upper_position

    [[rest]]                         # optional, of any robot: where the arm hangs, coordinates of joints that say in
    name = "elbow"                   # which of its assembly modes the device is
    coordinates = [0.4]
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ...chain import ClosedChain, Roles
from ...chain.formats.closures_file import closure_values, joint_values, read_closure, read_joint, read_roles
from ...chain.formats.joint_data import FIELDS
from ...chain.formats.mjcf.mjcf_reading import read_mjcf
from ...chain.formats.restated import JointRestated, Restated, as_read, restored
from ...chain.formats.sdf.sdf_reading import read_sdf
from ...chain.structure.description import Closures
from ...core.conventions import GRAVITY
from ...core.files.toml_tables import TomlTable, naming_file, read_toml
from ...core.validation import FloatArray


def read_robot(
    robot: str | PathLike[str], device_file: str | PathLike[str] | None, leave_out: Iterable[str] = ()
) -> ClosedChain:
    """The robot of a device.

    Parameters
    ----------
    robot : path-like
        The robot's file.
    device_file : path-like or None
        The device file, which may say more of it; None where there is none.
    leave_out : iterable of str
        As for :meth:`ClosedChain.from_urdf`.

    Returns
    -------
    ClosedChain
        With the roles of either file.

    Raises
    ------
    FileFormatError
        If a file is wrong, or the device file names an arm although the robot's file does.
    UnknownName
        If the device file names a part that the robot has not.
    """
    ending = Path(robot).suffix.lower()
    if device_file is None:
        reader: Any = {".xml": ClosedChain.from_mjcf, ".sdf": ClosedChain.from_sdf}.get(ending, ClosedChain.from_urdf)
        found: ClosedChain = reader(robot, leave_out=leave_out)
        return found
    table = read_toml(device_file)
    with naming_file(device_file):
        return _read(robot, table, leave_out, ending)


def _read(robot: str | PathLike[str], table: TomlTable, leave_out: Iterable[str], ending: str) -> ClosedChain:
    # The tables of :func:`robot_tables`.
    given, in_file = table.table("roles"), table.table("in_file")
    own = Closures(
        "device",
        closures=tuple(read_closure(item) for item in table.tables("closures")),
        joints=tuple(read_joint(item) for item in table.tables("joints")),
        left_out=table.texts("left_out"),
        tolerance=table.quantity("number", "geometry_tolerance", (), required=False) or 0.0,
    )
    gravity = table.quantity("acceleration", "gravity", (3,), required=False)
    rest = {str(item.text("name")): _numbers(item, "coordinates") for item in table.tables("rest")}
    restated = None if in_file is None else _restated(in_file)
    roles = None if given is None else read_roles(given)
    if ending == ".xml":
        model, read = read_mjcf(robot, leave_out)
    elif ending == ".sdf":
        first = None if roles is None or restated is not None else roles.shoulder
        model, read = read_sdf(robot, None, 0.0, leave_out, first, restated.closing if restated else ())
    else:
        chain = ClosedChain.from_urdf(robot, leave_out=leave_out)
        model, read = chain.model, chain.description
    if roles is not None and read.roles.arm is not None:
        raise table.error("given twice: the robot's closures file names the arm", "roles.arm")
    if restated is None:
        roles = roles and replace(roles, actuated=roles.actuated or read.roles.actuated)
        description = read if roles is None else replace(read, roles=roles)
    elif ending == ".urdf":
        model, description = restored(model, read, restated, read)
    else:
        own = replace(own, name=read.name, roles=roles or Roles())
        model, description = restored(model, read, restated, own)
        if ending == ".sdf":
            _free_passive(model, own)
    if gravity is not None:
        model.gravity.linear = gravity
        description = replace(description, root=replace(description.root, gravity=tuple(gravity.tolist())))
    if rest:
        chain = ClosedChain(model, description)
        q = chain.neutral()
        for name, values in rest.items():
            q[chain.configuration_slice(name)] = as_read(model, model.getJointId(name), np.asarray(values))
        model.referenceConfigurations["qpos0"] = q
    return ClosedChain(model, description)


def robot_tables(chain: ClosedChain, restated: Restated, ending: str, rest: dict[str, FloatArray]) -> dict[str, Any]:
    """The tables of a device file that say what its robot's file says otherwise."""
    content: dict[str, Any] = {}
    own = chain.description
    if ending != ".urdf":
        if own.tolerance:
            content["geometry_tolerance"] = own.tolerance
        gravity = np.asarray(chain.model.gravity.linear)
        if ending == ".sdf" and not np.array_equal(gravity, GRAVITY):
            content["gravity_m_s2"] = gravity.tolist()
        content["left_out"] = list(own.left_out)
        content["closures"] = [_plain(closure_values(item)) for item in own.closures]
        content["joints"] = [_plain(joint_values(item)) for item in own.joints]
        content["roles"] = _plain(asdict(own.roles) | {"limbs": tuple(map(asdict, own.roles.limbs)) or None})
    content["rest"] = [{"name": name, "coordinates": q.tolist()} for name, q in rest.items()]
    if ending != ".urdf" or not restated.is_empty:
        in_file: dict[str, Any] = {key: list(getattr(restated, key)) for key in ("helpers", "closing")}
        in_file |= {"frames": dict(restated.frames), "joints": [_joint(*item) for item in restated.joints.items()]}
        content["in_file"] = {key: value for key, value in in_file.items() if value}
    return {key: value for key, value in content.items() if value not in ([], "")}


def _joint(name: str, item: JointRestated) -> dict[str, Any]:
    given = {"called": item.called, "zero": item.zero, "inertia": item.inertia}
    data = {key: value for key, value in item.data.items() if np.isfinite(value).all()}
    return {"name": name} | _plain(given | data)


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {key: list(item) if isinstance(item, tuple) else item for key, item in values.items() if item is not None}


def _restated(table: TomlTable) -> Restated:
    joints = {}
    for item in table.tables("joints"):
        name, called = str(item.text("name")), item.text("called", required=False)
        zero = _numbers(item, "zero", required=False)
        inertia = item.quantity("number", "inertia", (10,), required=False)
        data = {key: value for key in FIELDS if (value := _numbers(item, key, required=False)) is not None}
        item.finish()
        body = None if inertia is None else tuple(inertia.tolist())
        joints[name] = JointRestated(called, zero, body, data)
    found = Restated(joints, table.mapping("frames"), table.texts("helpers"), table.texts("closing"))
    table.finish()
    return found


def _numbers(table: TomlTable, key: str, required: bool = True) -> tuple[float, ...] | None:
    found = table.quantity("number", key, (None,), required=required)
    if key == "coordinates":
        table.finish()
    return None if found is None else tuple(found.tolist())


def _free_passive(model: Any, own: Closures) -> None:
    """Take away the limits of zero by which an SDF says that a joint has no motor."""
    for index in range(1, model.njoints):
        v = model.idx_vs[index]
        low, high = model.lowerEffortLimit, model.upperEffortLimit
        if model.names[index] not in own.roles.actuated and low[v] == high[v] == 0.0:
            low[v], high[v] = -np.inf, np.inf
