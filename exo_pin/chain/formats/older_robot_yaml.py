"""Older layouts of ``robot.yaml``, which find their parts by names that contain a text.

::

    name_closedloop: "loop"       # loop 1 joins the two frames whose names contain loop1
    closed_loop_number: 2         # optional: loops 1 and 2; all numbers for which there is a pair if left out or -1
    type: "6D"                    # of all loops: 6D, 3D or planar
    name_mot: "mot"               # joints whose names contain mot are actuated

    name_mot: mot
    rotule_name: ball             # joints whose names contain ball are spherical joints
    Lidmot: [0, 5]                # optional, checked: where the actuated joints' coordinates begin in q and in v
    Lidvmot: [0, 4]
    closed_loop: [["loop1_A", "loop1_B"]]
    type: ["6d"]

Names that contain ``frame`` are no ends of loops: exporters call the weld of a link LINK that way, ``LINK_frame``.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from ...core.errors import FileFormatError, UnknownName

__all__ = ["OLDER_KEYS", "is_older", "present_layout", "refuse_indices", "refuse_spatial"]

OLDER_KEYS = ("name_closedloop", "closed_loop_number", "rotule_name", "Lidmot", "Lidvmot")
_TYPES = ("6d", "3d", "planar")
#: Largest motion out of a loop's plane, m and rad for a unit of a coordinate: rounding of poses.
_PLANE = 1e-9


def is_older(data: dict[str, Any]) -> bool:
    """Whether a robot's data are in an older layout."""
    return any(key in data for key in OLDER_KEYS) or isinstance(data.get("name_mot"), str)


def present_layout(data: dict[str, Any], model: pin.Model, file: Path) -> dict[str, Any]:
    """The same robot in the present layout.

    Parameters
    ----------
    data : dict
        What the YAML file holds.
    model : pinocchio.Model
        The tree of the URDF, whose names are searched.
    file : Path
        For the errors.

    Raises
    ------
    FileFormatError
        If keys are missing, contradict each other or are of a wrong kind, or a loop has not two ends.
    UnknownName
        If the loops' type is not known, or no joint's name contains the text.
    """
    found = {key: value for key, value in data.items() if key not in OLDER_KEYS}
    joints = list(model.names)[1:]
    if isinstance(data.get("name_mot"), str):
        found["name_mot"] = _containing(_text(data, "name_mot", file), joints, "actuated joint", file)
    if "rotule_name" in data:
        if data.get("joint_name"):
            raise FileFormatError("expected rotule_name or joint_name, got both", file, "rotule_name")
        balls = _containing(_text(data, "rotule_name", file), joints, "spherical joint", file)
        found |= {"joint_name": balls, "joint_type": ["SPHERICAL"] * len(balls)}
    if "name_closedloop" in data:
        if "closed_loop" in data:
            raise FileFormatError("expected name_closedloop or closed_loop, got both", file, "name_closedloop")
        kind = data.get("type")
        if not isinstance(kind, str) or kind.lower() not in _TYPES:
            raise UnknownName("type of the closed loops", kind, _TYPES, where=str(file))
        pairs = _pairs(_text(data, "name_closedloop", file), data.get("closed_loop_number", -1), model, file)
        found |= {"closed_loop": pairs, "type": [kind.lower()] * len(pairs)}
    elif "closed_loop_number" in data:
        raise FileFormatError("expected name_closedloop beside it", file, "closed_loop_number")
    return found


def refuse_indices(data: dict[str, Any], actuated: list[str], model: pin.Model, file: Path) -> None:
    """Raise FileFormatError if stated indices of the actuated joints are not those of the model."""
    joints = [joint for joint, name in enumerate(model.names) if name in actuated]
    for key, places in (("Lidmot", model.idx_qs), ("Lidvmot", model.idx_vs)):
        there = [int(places[joint]) for joint in joints]
        given = data.get(key, there)
        if given != there:
            raise FileFormatError(f"expected {there}, where the actuated joints begin, got {given!r}", file, key)


def refuse_spatial(pairs: list[list[str]], model: pin.Model, file: Path) -> None:
    """Raise FileFormatError if planar loops are not plane, so that a rigid closure would hold more.

    A planar closure holds the two directions and the turn in the plane of its frames' x and y axes. Where no joint of
    the loop moves out of this plane, and the ends are in it, a rigid closure leaves the same motions.
    """
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    pin.computeJointJacobians(model, data, pin.neutral(model))
    for pair in pairs:
        here, there = (model.getFrameId(name) for name in pair)
        between = data.oMf[here].actInv(data.oMf[there])
        rates = between.action @ pin.getFrameJacobian(model, data, there, pin.ReferenceFrame.LOCAL)
        rates = rates - pin.getFrameJacobian(model, data, here, pin.ReferenceFrame.LOCAL)
        tilt = between.rotation[:2, 2]
        worst = max(np.abs(rates[[2, 3, 4]]).max(initial=0.0), abs(between.translation[2]), np.abs(tilt).max())
        if not worst <= _PLANE or between.rotation[2, 2] < 0.0:
            raise FileFormatError(
                f"the planar loop {pair[0]}-{pair[1]} leaves its plane by {worst:.1e} (m, rad): expected a plane loop; "
                "angles that are rounded are read as right angles with right_angle_tolerance",
                file,
                "type",
            )


def _text(data: dict[str, Any], key: str, file: Path) -> str:
    value = data[key]
    if not isinstance(value, str) or not value:
        raise FileFormatError(f"expected {key} to be a text, got {value!r}", file, key)
    return value


def _containing(text: str, joints: list[str], what: str, file: Path) -> list[str]:
    found = [name for name in joints if text in name]
    if not found:
        raise UnknownName(f"{what}, by a part of its name,", text, joints, where=str(file))
    return found


def _pairs(text: str, count: Any, model: pin.Model, file: Path) -> list[list[str]]:
    """The ends of every loop, by the number after the text."""
    if not isinstance(count, int) or isinstance(count, bool) or count < -1:
        raise FileFormatError(f"expected closed_loop_number to be a whole number, got {count!r}", file)
    ends: dict[int, list[str]] = {}
    for name in dict.fromkeys(frame.name for frame in model.frames):
        number = re.search(re.escape(text) + r"([0-9]{1,18})(?![0-9])", name)
        if number and "frame" not in name:
            ends.setdefault(int(number[1]), []).append(name)
    for loop in range(1, count + 1) if count >= 0 else sorted(ends):
        if len(ends.get(loop, ())) != 2:
            names = ", ".join(ends.get(loop, ())) or "none"
            raise FileFormatError(
                f"expected two frames whose names contain {text}{loop}, got {names}", file, "name_closedloop"
            )
    return [ends[loop] for loop in (range(1, count + 1) if count >= 0 else sorted(ends))]
