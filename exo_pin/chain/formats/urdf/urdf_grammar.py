"""Which elements and attributes a URDF may have, and where.

After http://wiki.ros.org/urdf/XML and the schema of urdfdom. Pinocchio's URDF reader drops what it does not know, so
a misspelt ``<axis xqz=...>`` would be read as no axis at all; here it is an error.

Extensions of other programs are not read: every element and attribute with a prefix (``drake:...``), except
xacro's, which have to be expanded first, and those without a prefix that are common in published files, listed in
``left_out`` and ``others`` below. They are of Gazebo, ROS, Drake, Bullet and MuJoCo, for simulators, controllers and
drawings.
"""

from __future__ import annotations

from ..xml_elements import Element
from ..xml_grammar import Rule, read_children

__all__ = ["check_grammar"]

_SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
_RULES = {
    "robot": Rule(
        ("name",),
        ("version",),
        often=("link", "joint", "material"),
        left_out=("gazebo", "transmission", "ros2_control", "sensor", "frame", "mujoco"),
    ),
    "link": Rule(
        ("name",),
        others=("type", "drake_ignore"),
        once=("inertial", "origin"),
        often=("visual", "collision"),
        left_out=("contact", "collision_checking", "self_filter", "surface", "gravity", "kinematic"),
    ),
    "inertial": Rule(once=("origin", "mass", "inertia"), needed=("mass", "inertia")),
    "origin": Rule(optional=("xyz", "rpy", "quat_xyzw")),
    "mass": Rule(("value",)),
    "inertia": Rule(("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "visual": Rule(optional=("name",), once=("origin", "geometry", "material"), needed=("geometry",)),
    "collision": Rule(
        optional=("name",),
        once=("origin", "geometry"),
        needed=("geometry",),
        left_out=("verbose", "material", "contact_coefficients"),
    ),
    "geometry": Rule(others=("name",), once=_SHAPES),
    "box": Rule(("size",)),
    "cylinder": Rule(("radius", "length")),
    "capsule": Rule(("radius", "length")),
    "sphere": Rule(("radius",)),
    "mesh": Rule(("filename",), ("scale",)),
    "material": Rule(optional=("name",), once=("color", "texture")),
    "color": Rule(("rgba",)),
    "texture": Rule(optional=("filename",)),
    "joint": Rule(
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
    "parent": Rule(("link",)),
    "child": Rule(("link",)),
    "axis": Rule(("xyz",)),
    "calibration": Rule(optional=("rising", "falling"), others=("reference_position",)),
    "dynamics": Rule(optional=("damping", "friction"), others=("D", "K", "mu_coulomb", "mu_viscous")),
    "limit": Rule(
        optional=("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"),
        others=("command_effort", "current", "gear_velocity"),
    ),
    "mimic": Rule(("joint",), ("multiplier", "offset")),
    "joint_properties": Rule(others=("damping", "friction")),  # of onshape-to-robot
    "safety_controller": Rule(("k_velocity",), ("k_position", "soft_lower_limit", "soft_upper_limit")),
}


def check_grammar(root: Element) -> None:
    """Check every element's attributes and children; their values are not checked.

    Raises
    ------
    FileFormatError
        As :func:`exo_pin.chain.formats.xml_grammar.read_children`.
    """
    if root.tag != "robot":
        raise root.error(f"expected the root element <robot>, got <{root.tag}>")
    waiting = [root]
    while waiting:
        element = waiting.pop()
        for child in element.children:
            if child.tag.startswith("xacro:"):
                raise child.error("the file still has xacro in it; expand it first (ros2 run xacro xacro ...)")
        waiting += reversed(read_children(element, _RULES[element.tag]))
