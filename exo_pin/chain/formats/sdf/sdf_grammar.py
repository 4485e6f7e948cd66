"""Which elements an SDF may have, and what becomes of each: read, left out and listed, or refused.

After the specification at sdformat.org, versions 1.5 to 1.12. Elements that change the motion are read, or are an
error as soon as they have another value than the one without effect. Elements for drawing, contact, sensors and
programs are left out; :func:`check_grammar` lists them. So are elements of other programs, with a prefix
(``drake:...``), with a warning, because they may change the motion.
"""

from __future__ import annotations

import warnings
from collections import Counter

from ..xml_elements import Element
from ..xml_grammar import Rule, is_left_out, read_children

__all__ = ["VERSIONS", "check_grammar", "flag"]

VERSIONS = ("1.5", "1.6", "1.7", "1.8", "1.9", "1.10", "1.11", "1.12")


_TEXT = Rule(text=True)
_AXIS = Rule(
    once=("xyz", "limit", "dynamics", "use_parent_model_frame", "mimic"),
    fixed={"initial_position": "0"},
)
_ELSEWHERE = "is in another file: expand the file first (gz sdf -p)"
_RULES = {
    "sdf": Rule(("version",), once=("world", "model")),
    "world": Rule(
        ("name",),
        once=("gravity",),
        often=("model", "joint", "frame"),
        left_out=(
            *("audio", "wind", "atmosphere", "gui", "physics", "scene", "light", "plugin", "magnetic_field"),
            *("spherical_coordinates",),
        ),
        refused={"include": _ELSEWHERE, "actor": "moves by a script", "population": "makes models at random"}
        | dict.fromkeys(("road", "state"), "is not read: remove it"),
    ),
    "model": Rule(
        ("name",),
        ("canonical_link", "placement_frame"),
        once=("pose",),
        often=("link", "joint", "frame", "model"),
        left_out=("plugin", "self_collide", "allow_auto_disable", "gripper"),
        refused={"include": _ELSEWHERE},
        fixed={"static": "false", "enable_wind": "false"},
    ),
    "link": Rule(
        ("name",),
        once=("pose", "inertial"),
        left_out=(
            *("visual", "collision", "sensor", "light", "plugin", "self_collide", "audio_sink", "audio_source"),
            *("battery", "particle_emitter", "projector"),
        ),
        fixed={"gravity": "true", "kinematic": "false", "enable_wind": "false", "must_be_base_link": "false"}
        | {"velocity_decay": "0"},
    ),
    "inertial": Rule(
        optional=("auto",),
        once=("pose", "mass", "inertia"),
        refused={"density": "needs the collision shapes: state mass and inertia"}
        | dict.fromkeys(("fluid_added_mass", "auto_inertia_params"), "is not read: remove it"),
    ),
    "inertia": Rule(once=("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "joint": Rule(
        ("name", "type"),
        once=("pose", "parent", "child", "axis", "axis2"),
        left_out=("sensor", "physics"),
        refused=dict.fromkeys(
            ("gearbox_ratio", "gearbox_reference_body", "thread_pitch", "screw_thread_pitch"),
            "is of a joint type that is not read",
        ),
    ),
    "axis": _AXIS,
    "axis2": _AXIS,
    "limit": Rule(once=("lower", "upper", "effort", "velocity"), left_out=("stiffness", "dissipation")),
    "dynamics": Rule(once=("damping", "friction", "spring_reference", "spring_stiffness")),
    "mimic": Rule(("joint",), ("axis",), once=("multiplier", "offset", "reference")),
    "frame": Rule(("name",), ("attached_to",), once=("pose",)),
    "pose": Rule(optional=("relative_to", "frame", "rotation_format", "degrees"), text=True),
    "xyz": Rule(optional=("expressed_in",), text=True),
}


def check_grammar(root: Element) -> tuple[str, ...]:
    """Check every element's attributes and children that matter, and list what is left out.

    Parameters
    ----------
    root : Element
        The document.

    Returns
    -------
    tuple of str
        What is left out, in words, by kind of element.

    Warns
    -----
    RuntimeWarning
        If elements of other programs are left out.

    Raises
    ------
    FileFormatError
        If an element or attribute is unknown, missing, there twice, or changes the motion in a way that is not read;
        or the version is not one of :data:`VERSIONS`.
    """
    if root.tag != "sdf":
        raise root.error(f"expected the root element <sdf>, got <{root.tag}>")
    version = root.attributes.get("version")
    if version not in VERSIONS:
        raise root.error(f"expected one of {', '.join(VERSIONS)}, got {version!r}: convert the file (gz sdf -p)")
    left: Counter[str] = Counter()
    waiting = [root]
    while waiting:
        element = waiting.pop()
        _refuse_other_version(element, VERSIONS.index(version) >= VERSIONS.index("1.7"), version)
        rule = _RULES.get(element.tag, _TEXT)
        children = read_children(element, rule)
        for attribute in rule.required:
            if not element.attributes[attribute]:
                raise element.error(f"the attribute {attribute!r} is empty")
        for child in children:
            if child.tag in rule.fixed:
                _refuse_effect(child, rule.fixed[child.tag])
        waiting += [child for child in reversed(children) if child.tag not in rule.fixed]
        left.update(f"<{child.tag}> in <{element.tag}>" for child in element.children if is_left_out(child, rule))
    prefixed = [name for name in left if ":" in name]
    if prefixed:
        warnings.warn(f"not read: {', '.join(prefixed)}, of other programs", RuntimeWarning, stacklevel=3)
    return tuple(name if count == 1 else f"{name}, {count} times" for name, count in left.items())


def flag(element: Element) -> bool:
    """The value of a truth element.

    Raises
    ------
    FileFormatError
        If it is neither true nor false.
    """
    if element.text.lower() in ("true", "1"):
        return True
    if element.text.lower() in ("false", "0"):
        return False
    raise element.error(f"expected true or false, got {element.text!r:.60}")


def _refuse_other_version(element: Element, is_new: bool, version: str) -> None:
    """Raise FileFormatError for what SDF has from version 1.7 on, or up to 1.6, in a file of the other kind."""
    for attribute in ("relative_to", "expressed_in", "attached_to"):
        if not is_new and attribute in element.attributes:
            raise element.error(f"is of version 1.7; this file says {version}", attribute)
    if is_new and (element.tag == "use_parent_model_frame" or "frame" in element.attributes):
        raise element.error(f"is of version 1.6 and before; this file says {version}: use expressed_in, relative_to")


def _refuse_effect(element: Element, harmless: str) -> None:
    """Raise unless an element has the value that has no effect."""
    if element.tag == "velocity_decay":
        values = [child.text for child in element.children] or [element.text or "0"]
        fits = all(text.strip("0.+-") == "" for text in values)
    elif harmless in ("true", "false"):
        fits = flag(element) == (harmless == "true")
    else:
        fits = element.text.strip("0.+-") == ""
    if not fits:
        raise element.error(f"expected {harmless}: another value changes the motion and is not read")
