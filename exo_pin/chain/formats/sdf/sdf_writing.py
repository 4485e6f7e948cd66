"""Writing a chain as SDF: every closure is one more joint, a linear coupling a <mimic> of joint b.

SDF holds poses of links, not positions of joints: all joints are zero in the file's configuration, which is closed.
Root joints: a free robot is not joined to the world, a ball root is a ball joint on it.

A hinge or slide has its damping, friction and spring, and its limits of position, effort and velocity. A joint
without a limit of effort that is not among the actuated ones gets a limit of zero, so that it is passive. SDF has no
armature, and no data of a ball joint.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from ....core.errors import InvalidInput
from ....core.validation import FloatArray
from ...structure.chain_state import ChainState
from ..bodies import TreeBody, link_name, refuse_massless, tree_bodies
from ..joint_data import refuse_data
from ..urdf.urdf_mimic import linear

__all__ = ["sdf_text"]

_VERSION, _VERSION_WITH_MIMICS = "1.9", "1.11"
#: Data of a hinge or slide that SDF has a place for.
_HELD = ("damping", "friction", "spring", "effort limits", "velocity limits", "position limits")
_TREE = {"hinge": "revolute", "slide": "prismatic", "ball": "ball"}
_CLOSURES = {
    "rigid": "fixed",
    "spherical": "ball",
    "revolute": "revolute",
    "universal": "universal",
    "prismatic": "prismatic",
}


def sdf_text(chain: ChainState, q: FloatArray) -> str:
    """The XML of a chain at a closed configuration.

    Parameters
    ----------
    chain : ChainState
        The chain; every body needs mass and inertia.
    q : ndarray
        Shape (nq,), closed: the poses of the links in the file, where joints are zero.

    Raises
    ------
    InvalidInput
        If a body has no mass, a joint or closure is of a kind that SDF does not have (cylindrical, distance, a
        coupling that is not linear, or a second one of the same joint b), or a joint has data that SDF cannot hold.
    """
    bodies = tree_bodies(chain)
    refuse_massless(bodies, "SDF")
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    mimics = _mimics(chain)
    root = ET.Element("sdf", version=_VERSION_WITH_MIMICS if mimics else _VERSION)
    model = ET.SubElement(root, "model", name=chain.description.name)
    taken = {body.name for body in bodies}
    for body in bodies:
        link = ET.SubElement(model, "link", name=body.name)
        _pose(link, data.oMi[body.index])
        inertial = ET.SubElement(link, "inertial")
        _pose(inertial, pin.SE3(np.eye(3), body.inertia.lever))
        ET.SubElement(inertial, "mass").text = _number(body.inertia.mass)
        moments = ET.SubElement(inertial, "inertia")
        for entry, (row, column) in _MOMENTS.items():
            ET.SubElement(moments, entry).text = _number(body.inertia.inertia[row, column])
    names: dict[str, str] = {}
    for body in bodies:
        _tree_joint(chain, model, body, link_name(bodies, body.parent), q, taken, names)
    _add_mimics(model, mimics, names)
    for c, closure in enumerate(chain.closures):
        if closure.type == "coupling":
            continue
        if closure.type not in _CLOSURES:
            raise InvalidInput(f"SDF has no joint for the {closure.type} closure {closure.name!r}")
        ends = [link_name(bodies, int(joint)) for joint in chain.topology.joints[c]]
        element = _joint(model, _free_name(closure.name, "closure", taken), _CLOSURES[closure.type])
        # A joint's frame is on its child, and the world cannot be a child.
        child = 1 if ends[0] == "world" else 0
        local = chain.topology.local[c, child]
        _pose(element, pin.SE3(local[:3].T.copy(), local[3].copy()))
        ET.SubElement(element, "parent").text = ends[1 - child]
        ET.SubElement(element, "child").text = ends[child]
        if closure.type in ("revolute", "prismatic"):
            _axis(element, "axis", np.array([0.0, 0.0, 1.0]))
        elif closure.type == "universal":
            _universal(chain, c, child, element, q)
    ET.indent(root)
    note = "<!-- Written by exo_pin. Joints read zero where the loops are closed. -->"
    return "\n".join(['<?xml version="1.0"?>', note, ET.tostring(root, encoding="unicode"), ""])


_MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def _mimics(chain: ChainState) -> dict[str, tuple[str, float]]:
    """Of joints b of couplings joint a and the multiplier; positions count from the closed configuration."""
    found: dict[str, tuple[str, float]] = {}
    for closure in chain.closures:
        if closure.type == "coupling":
            numbers = linear(closure)
            if numbers is None or closure.frame_b in found:
                raise InvalidInput(
                    f"SDF has no joint for the coupling closure {closure.name!r}: expected a linear coupling of two "
                    "joints, one for each joint b"
                )
            found[closure.frame_b] = (closure.frame_a, numbers[1])
    return found


def _add_mimics(model: ET.Element, mimics: dict[str, tuple[str, float]], names: dict[str, str]) -> None:
    axes = {element.get("name"): element.find("axis") for element in model.findall("joint")}
    for follower, (leader, multiplier) in mimics.items():
        axis = axes[names[follower]]
        assert axis is not None
        mimic = ET.SubElement(axis, "mimic", joint=names[leader], axis="axis")
        for key, value in (("multiplier", multiplier), ("offset", 0.0), ("reference", 0.0)):
            ET.SubElement(mimic, key).text = _number(value)


def _tree_joint(
    chain: ChainState,
    model: ET.Element,
    body: TreeBody,
    parent: str,
    q: FloatArray,
    taken: set[str],
    names: dict[str, str],
) -> None:
    """A joint of the tree; ``names`` gets its name in the file."""
    held = _HELD if body.axis is not None else ()
    refuse_data("SDF", body.joint, [what for what in body.data.present if what not in held])
    if body.kind == "free" and body.parent == 0:
        return
    if body.kind not in _TREE:
        raise InvalidInput(f"SDF has no joint for {body.joint!r}, which is {body.kind}")
    names[body.joint] = _free_name(body.joint, "joint", taken)
    element = _joint(model, names[body.joint], _TREE[body.kind])
    ET.SubElement(element, "parent").text = parent
    ET.SubElement(element, "child").text = body.name
    if body.axis is not None:
        own = q[chain.configuration_slice(body.joint)]
        here = float(np.arctan2(own[1], own[0])) if len(own) == 2 else float(own[0])
        _strong_axis(element, body, here, body.joint in chain.roles.actuated)


def _strong_axis(element: ET.Element, body: TreeBody, here: float, actuated: bool) -> None:
    """The axis of a hinge or slide, its limits, damping, friction and spring; zero of the file is ``here``."""
    data, axis = body.data, ET.SubElement(element, "axis")
    assert body.axis is not None
    ET.SubElement(axis, "xyz").text = " ".join(_number(value) for value in body.axis)
    limits = ET.SubElement(axis, "limit")
    for key, limit in zip(("lower", "upper"), body.limits or (), strict=False):
        if np.isfinite(limit):
            ET.SubElement(limits, key).text = _number(limit - here)
    effort = data.symmetric("effort", body.joint, "SDF")
    for key, limit in (
        ("effort", effort if np.isfinite(effort) or actuated else 0.0),
        ("velocity", data.symmetric("velocity", body.joint, "SDF")),
    ):
        if np.isfinite(limit):
            ET.SubElement(limits, key).text = _number(limit)
    values = {"damping": float(data.damping[0]), "friction": float(data.friction[0])}
    if data.stiffness != 0.0:
        values |= {"spring_reference": data.rest - here, "spring_stiffness": data.stiffness}
    if any(values.values()):
        dynamics = ET.SubElement(axis, "dynamics")
        for key, value in values.items():
            ET.SubElement(dynamics, key).text = _number(value)


def _universal(chain: ChainState, c: int, child: int, element: ET.Element, q: FloatArray) -> None:
    """First the axis on the parent, then the one on the child, both in the joint's frame, which is the child's."""
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    ends = [
        data.oMi[int(chain.topology.joints[c, end])].rotation @ chain.topology.local[c, end, :3].T for end in (0, 1)
    ]
    # Frame a turns about its x, frame b about its y.
    axes = [ends[0][:, 0], ends[1][:, 1]]
    for name, end in (("axis", 1 - child), ("axis2", child)):
        _axis(element, name, ends[child].T @ axes[end])


def _joint(model: ET.Element, name: str, kind: str) -> ET.Element:
    return ET.SubElement(model, "joint", name=name, type=kind)


def _axis(element: ET.Element, name: str, direction: FloatArray) -> None:
    axis = ET.SubElement(element, name)
    ET.SubElement(axis, "xyz").text = " ".join(_number(value) for value in direction)
    # Passive until a simulator drives it.
    ET.SubElement(ET.SubElement(axis, "limit"), "effort").text = "0"


def _free_name(name: str, suffix: str, taken: set[str]) -> str:
    """SDF's links and joints share one space of names."""
    while name in taken:
        name = f"{name}_{suffix}"
    taken.add(name)
    return name


def _pose(element: ET.Element, place: pin.SE3) -> None:
    numbers = [*place.translation, *pin.Quaternion(place.rotation).normalized().coeffs()]
    pose = ET.SubElement(element, "pose", rotation_format="quat_xyzw")
    pose.text = " ".join(_number(value) for value in numbers)


def _number(value: float) -> str:
    return repr(float(value) + 0.0)
