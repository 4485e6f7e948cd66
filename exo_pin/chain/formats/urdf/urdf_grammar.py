"""Which elements and attributes a URDF may have, and where.

After http://wiki.ros.org/urdf/XML and the schema of urdfdom. Pinocchio's URDF reader drops what it does not know, so
a misspelt ``<axis xqz=...>`` would be read as no axis at all; here it is an error.

Extensions of other programs are not read: every element and attribute with a prefix (``drake:...``), except
xacro's, which have to be expanded first, and those without a prefix that are common in published files, listed in
``_OTHERS`` and in ``others`` below. They are for simulators, controllers and drawings.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import NamedTuple

from ....core.errors import FileFormatError
from ..xml_elements import Element

__all__ = ["check_grammar", "is_extension"]


class _Rule(NamedTuple):
    """Attributes and children of an element.

    Attributes
    ----------
    required, optional, others : tuple of str
        Attributes; the others pass unread.
    once, often : tuple of str
        Children that may occur once, or any number of times.
    needed : tuple of str
        Children that have to be there.
    """

    required: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    once: tuple[str, ...] = ()
    often: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()


_SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
_RULES = {
    "robot": _Rule(("name",), ("version",), often=("link", "joint", "material")),
    "link": _Rule(
        ("name",), others=("type", "drake_ignore"), once=("inertial", "origin"), often=("visual", "collision")
    ),
    "inertial": _Rule(once=("origin", "mass", "inertia"), needed=("mass", "inertia")),
    "origin": _Rule(optional=("xyz", "rpy", "quat_xyzw")),
    "mass": _Rule(("value",)),
    "inertia": _Rule(("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "visual": _Rule(optional=("name",), once=("origin", "geometry", "material"), needed=("geometry",)),
    "collision": _Rule(optional=("name",), once=("origin", "geometry"), needed=("geometry",)),
    "geometry": _Rule(others=("name",), once=_SHAPES),
    "box": _Rule(("size",)),
    "cylinder": _Rule(("radius", "length")),
    "capsule": _Rule(("radius", "length")),
    "sphere": _Rule(("radius",)),
    "mesh": _Rule(("filename",), ("scale",)),
    "material": _Rule(optional=("name",), once=("color", "texture")),
    "color": _Rule(("rgba",)),
    "texture": _Rule(optional=("filename",)),
    "joint": _Rule(
        ("name", "type"),
        others=("dont_collapse",),
        once=(
            "origin",
            "parent",
            "child",
            "axis",
            "calibration",
            "dynamics",
            "limit",
            "mimic",
            "safety_controller",
            "joint_properties",
        ),
        needed=("parent", "child"),
    ),
    "parent": _Rule(("link",)),
    "child": _Rule(("link",)),
    "axis": _Rule(("xyz",)),
    "calibration": _Rule(optional=("rising", "falling"), others=("reference_position",)),
    "dynamics": _Rule(optional=("damping", "friction"), others=("D", "K", "mu_coulomb", "mu_viscous")),
    "limit": _Rule(
        optional=("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"),
        others=("command_effort", "current", "gear_velocity"),
    ),
    "mimic": _Rule(("joint",), ("multiplier", "offset")),
    "joint_properties": _Rule(others=("damping", "friction")),  # of onshape-to-robot
    "safety_controller": _Rule(("k_velocity",), ("k_position", "soft_lower_limit", "soft_upper_limit")),
}

#: Elements of other programs by the element that holds them: those of Gazebo, ROS, Drake, Bullet and MuJoCo.
_OTHERS = {
    "robot": ("gazebo", "transmission", "ros2_control", "sensor", "frame", "mujoco"),
    "link": ("contact", "collision_checking", "self_filter", "surface", "gravity", "kinematic"),
    "collision": ("verbose", "material", "contact_coefficients"),
}


def is_extension(holder: Element, element: Element) -> bool:
    """Whether an element belongs to another program."""
    return ":" in element.tag or element.tag in _OTHERS.get(holder.tag, ())


def check_grammar(root: Element) -> None:
    """Check every element's attributes and children; their values are not checked.

    Raises
    ------
    FileFormatError
        If an element or attribute is unknown, missing, or there twice, or there is text where none is allowed. A near
        miss is named.
    """
    if root.tag != "robot":
        raise root.error(f"expected the root element <robot>, got <{root.tag}>")
    waiting = [root]
    while waiting:
        element = waiting.pop()
        _check(element, _RULES[element.tag])
        waiting += [child for child in reversed(element.children) if not is_extension(element, child)]


def _check(element: Element, rule: _Rule) -> None:
    for attribute in rule.required:
        if attribute not in element.attributes:
            near = get_close_matches(attribute, list(element.attributes), n=1)
            raise element.error(f"the attribute {attribute!r} is missing{f'; there is {near[0]!r}' if near else ''}")
    known = (*rule.required, *rule.optional, *rule.others)
    for attribute in element.attributes:
        if ":" not in attribute and attribute != "xmlns" and attribute not in known:
            raise _unknown(element, f"attribute {attribute!r}", attribute, known)
    if element.text:
        raise element.error(f"expected no text in <{element.tag}>, got {element.text!r:.60}")
    children = (*rule.once, *rule.often)
    seen: dict[str, Element] = {}
    for child in element.children:
        if child.tag.startswith("xacro:"):
            raise child.error("the file still has xacro in it; expand it first (ros2 run xacro xacro ...)")
        if is_extension(element, child):
            continue
        if child.tag not in children:
            raise _unknown(child, f"element <{child.tag}>", child.tag, (*children, *_OTHERS.get(element.tag, ())))
        if child.tag in rule.once and child.tag in seen:
            raise child.error(f"expected one <{child.tag}>, this is a second one; the first is on line "
                              f"{seen[child.tag].line}")  # fmt: skip
        seen.setdefault(child.tag, child)
    for tag in rule.needed:
        if tag not in seen:
            raise element.error(f"<{tag}> is missing")


def _unknown(element: Element, what: str, name: str, known: Iterable[str]) -> FileFormatError:
    known = tuple(known)
    there = ", ".join(known) or "none"
    return element.error(f"unknown {what}{_near(name, known)}; there are: {there}")


def _near(name: str, known: Iterable[str]) -> str:
    near = get_close_matches(name, list(known), n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""
