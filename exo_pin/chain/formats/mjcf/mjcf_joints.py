"""Writing the joints of a body as MJCF, with what they have besides their motion, and its inertia.

============== =======================================================================================================
data           MJCF
============== =======================================================================================================
damping        ``damping``; friction ``frictionloss``; armature ``armature``: of a hinge, slide or translation as they
               are, of a ball joint if they are the same about its three axes
spring         ``stiffness`` and ``springref``; a ball joint's spring is slack in its neutral configuration only
limits         position ``range``; effort ``actuatorfrcrange``. MJCF has no limit of velocity: they are left out
============== =======================================================================================================

An effort limit of zero is written as the smallest range that MuJoCo accepts, of 2.2e-308 N or N m. A planar or free
joint moves in other coordinates in MuJoCo; it may have damping, the same in all directions, and nothing else.

A body of MJCF may have several hinges and slides, and a ball. In a Pinocchio tree they are joints with bodies without
mass between them, as of a universal joint; :func:`exo_pin.chain.formats.bodies.joined_bodies` puts them on one body
again.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from ....core.errors import InvalidInput
from ....core.errors.base import warn
from ....core.validation import FloatArray
from ..bodies import LEAST_MOMENT, TreeBody, lawful_moments
from ..joint_data import NO_LIMIT, JointData, refuse_data
from ..xml_elements import as_numbers

#: Share of a moment of inertia that is rounding.
_THIN = 1e-12
#: Share of a moment of inertia that printed digits leave open.
_MENDED = 0.1
_TINY = float(np.finfo(np.float64).tiny)
_FORMAT = "MJCF"
#: Data that a free or planar joint cannot have.
_LOST = ("friction", "armature", "spring", "effort limits", "position limits")


def write_joints(element: ET.Element, body: TreeBody, own: FloatArray, place: pin.SE3 | None = None) -> list[float]:
    """Add a body's joints to its element.

    Parameters
    ----------
    element : Element
        The body.
    body : TreeBody
        The body and its joint.
    own : ndarray
        Shape (nq of the joint,), its coordinates.
    place : pinocchio.SE3, optional
        Of a hinge, slide or ball in the frame of the element's body; by default it is that frame.

    Returns
    -------
    list of float
        Its coordinates as MuJoCo orders them.

    Raises
    ------
    InvalidInput
        If the joint has data that MJCF cannot hold.
    """
    if body.kind == "free":
        return _free(element, body, own)
    if body.kind == "ball":
        return _ball(element, body, own, place)
    if body.axis is not None:
        given = {"name": body.joint, "type": body.kind, "axis": as_numbers(body.axis)}
        if place is not None:
            given |= {"pos": as_numbers(place.translation), "axis": as_numbers(place.rotation @ body.axis)}
        ET.SubElement(element, "joint", {**given, **_scalar(body.data, 0)})
        return [float(np.arctan2(own[1], own[0])) if len(own) == 2 else float(own[0])]
    return _three(element, body, own)


def _free(element: ET.Element, body: TreeBody, own: FloatArray) -> list[float]:
    if body.parent != 0:
        raise InvalidInput(f"MJCF has free joints on the world only; joint {body.joint!r} is on another body")
    body.refuse(_FORMAT, _LOST)
    damping = _one_number(body, "damping", body.data.damping)
    if damping == 0.0:
        ET.SubElement(element, "freejoint", name=body.joint)
    else:
        ET.SubElement(element, "joint", name=body.joint, type="free", damping=as_numbers(damping))
    # MuJoCo counts a free body's coordinates from the world, not from where the file puts the body.
    pose = pin.SE3ToXYZQUAT(body.placement * pin.XYZQUATToSE3(own))
    return [*pose[:3], pose[6], *pose[3:6]]


def _ball(element: ET.Element, body: TreeBody, own: FloatArray, place: pin.SE3 | None) -> list[float]:
    data = body.data
    body.refuse(_FORMAT, ("effort limits", "position limits"))
    if data.stiffness != 0.0 and data.reference is not None and data.reference[:3].any():
        refuse_data(_FORMAT, body.joint, ["spring reference"])
    values = {
        "damping": _one_number(body, "damping", data.damping),
        "frictionloss": _one_number(body, "friction", data.friction),
        "armature": _one_number(body, "armature", data.armature),
        "stiffness": data.stiffness,
    }
    at = {} if place is None else {"pos": as_numbers(place.translation)}
    ET.SubElement(element, "joint", {"name": body.joint, "type": "ball", **at, **_not_zero(values)})
    return [own[3], *own[:3]]


def _three(element: ET.Element, body: TreeBody, own: FloatArray) -> list[float]:
    """A planar joint or a translation, as three joints along and about the axes of its frame."""
    planar = body.kind == "planar"
    if planar:
        body.refuse(_FORMAT, _LOST)
        _one_number(body, "damping", body.data.damping[:2])
    for k, (axis, letter) in enumerate(zip(np.eye(3), "xyz", strict=True)):
        kind = "hinge" if planar and letter == "z" else "slide"
        given = {"name": f"{body.joint}_{letter}", "type": kind, "axis": as_numbers(axis)}
        more = _not_zero({"damping": body.data.damping[k]}) if planar else _scalar(body.data, k)
        ET.SubElement(element, "joint", {**given, **more})
    return [own[0], own[1], float(np.arctan2(own[3], own[2])) if planar else own[2]]


def _scalar(data: JointData, k: int) -> dict[str, str]:
    """Attributes of the k-th coordinate, of a joint whose coordinates are hinges or slides."""
    values = {
        "damping": data.damping[k],
        "frictionloss": data.friction[k],
        "armature": data.armature[k],
        "stiffness": data.stiffness,
        "springref": data.rest(k),
    }
    written = _not_zero(values)
    if np.isfinite(data.ends(k)).any():
        written["range"] = as_numbers(np.clip(data.ends(k), -NO_LIMIT, NO_LIMIT))
    effort = data.effort[k]
    if np.isfinite(effort).any():
        low, high = np.clip(effort, -NO_LIMIT, NO_LIMIT)
        written["actuatorfrcrange"] = as_numbers([min(low, -_TINY), max(high, _TINY)])
    return written


def _one_number(body: TreeBody, what: str, values: FloatArray) -> float:
    """The number that all values are."""
    found = set(values.tolist())
    if len(found) > 1:
        refuse_data(_FORMAT, body.joint, [f"{what} that differs between the axes"])
    return float(found.pop())


def _not_zero(values: dict[str, float]) -> dict[str, str]:
    return {key: as_numbers(value) for key, value in values.items() if value != 0.0}


def write_inertial(element: ET.Element, name: str, inertia: pin.Inertia) -> None:
    """Principal moments and axes, which MuJoCo reads only if the largest moment is no more than the others' sum.

    Moments that miss it, as printed digits make them, are mended, and a comment has them before and after. Of a thin
    body it is the last digit.

    Warns
    -----
    RuntimeWarning
        If moments are mended.

    Raises
    ------
    InvalidInput
        If one of them would change by more than a tenth of the largest.
    """
    given, axes = np.linalg.eigh(inertia.inertia)
    moments = lawful_moments(given)
    # Their sum rounds.
    moments[2] = min(moments[2], moments[0] + moments[1])
    change = float(np.abs(moments - given).max())
    if change > _THIN * moments[2]:
        before, after = (", ".join(f"{moment:.6g}" for moment in each) for each in (given, moments))
        if change > _MENDED * moments[2]:
            raise InvalidInput(
                "MuJoCo reads no body with a principal moment of inertia larger than the sum of the others; those of "
                f"{name} are {before} kg m²: mend its inertia"
            )
        said = f"Principal moments of inertia mended: {before} kg m² before, {after} kg m² after."
        element.append(ET.Comment(f" {said} "))
        warn(f"body {name}: {said}", RuntimeWarning)
    place = pin.SE3(axes if np.linalg.det(axes) > 0.0 else -axes, inertia.lever)
    written = {"mass": as_numbers(inertia.mass), "diaginertia": as_numbers(np.maximum(moments, LEAST_MOMENT))}
    ET.SubElement(element, "inertial", written | pose_of(place))


def pose_of(place: pin.SE3) -> dict[str, str]:
    """Its attributes ``pos`` and ``quat``."""
    x, y, z, w = pin.Quaternion(place.rotation).normalized().coeffs()
    return {"pos": as_numbers(place.translation), "quat": as_numbers([w, x, y, z])}
