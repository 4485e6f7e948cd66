"""A check of a URDF before Pinocchio reads it, which drops what it does not understand.

:func:`checked_urdf` returns the part that makes the model: inertias of links, and joints. Every number is spelt so that
Pinocchio's reader reads it correctly, whatever the file's encoding, line ends and blanks.

The rules of elements and attributes are in ``urdf_grammar.toml``. Extensions of other programs are not read: every
element and attribute with a prefix (``drake:...``), except xacro's, which have to be expanded first, and those without
a prefix that are common in published files.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ....core.errors import FileFormatError
from ....core.errors.warning_categories import warn
from ...structure.closures import Closure
from ...structure.description import Shape
from ..joint_data import NO_LIMIT
from ..leaving_out import LeftOut
from ..rounding.rounded_numbers import geometry_words
from ..xml_elements import MOMENTS, NOTHING, Element, as_numbers, vector
from ..xml_grammar import checked, is_left_out
from .urdf_mimic import coupled_joints, mimic_couplings
from .urdf_shapes import urdf_shapes
from .urdf_values import check_joint, check_material, check_origin, check_picture, inertia_of, unread_physics

#: Longest chain of links that is read. Pinocchio's reader calls itself once a link, and the stack of a thread
#: (8 MiB) ends between 3,000 and 4,000 links.
DEEPEST = 1000

#: What of links and joints makes the model: elements, attributes that are names, and attributes that are numbers.
_PARTS = ("inertial", "mass", "inertia", "parent", "child", "origin", "axis", "limit", "dynamics")
_NAMES = ("name", "type", "link")
_NUMBERS = {"xyz", "rpy", "quat_xyzw", "value", *MOMENTS, "lower", "upper", "effort", "velocity", "damping", "friction"}
_ENDLESS = {"lower": repr(-NO_LIMIT), "upper": repr(NO_LIMIT)}

_VERSIONS = {None: (1, 0), "1.0": (1, 0), "1": (1, 0), "1.1": (1, 1), "1.2": (1, 2)}


class CheckedUrdf(NamedTuple):
    """A URDF that Pinocchio reads as it is meant.

    Attributes
    ----------
    text : str
        The same links, inertias and joints, in the same order, and nothing else.
    mimics : tuple of Closure
        The mimic joints as couplings.
    words : tuple of str
        Numbers of the geometry as written.
    shapes : tuple of Shape
        What of the links is drawn.
    """

    text: str
    mimics: tuple[Closure, ...]
    words: tuple[str, ...]
    shapes: tuple[Shape, ...]


def checked_urdf(
    root: Element, left: LeftOut, closures: Sequence[Closure] = (), folder: Path | None = None
) -> CheckedUrdf:
    """The URDF that Pinocchio is to read.

    Parameters
    ----------
    root : Element
        The document.
    left : LeftOut
        What is left out, which is put down there.
    closures : sequence of Closure
        Those of the closures file: continuous joints that they couple count turns.
    folder : Path, optional
        Where the file stands, for its meshes.

    Warns
    -----
    RuntimeWarning
        If it has something that is not URDF's own and may change the motion, such as ``<dynamics K="50"/>``.

    Raises
    ------
    FileFormatError
        If an element or attribute is unknown, missing or twice there; a number is no
        decimal number or out of range; a name is empty or given twice; a joint's link does not exist; the links are
        not one tree, or a tree that is too deep; or a joint mimics what it cannot. The message and ``key`` name the
        place.
    """
    words = tuple(word for joint in root.all("joint") for word in geometry_words(joint))
    if root.tag != "robot":
        raise root.error(f"expected the root element <robot>, got <{root.tag}>")

    def faulty(error: FileFormatError) -> None:
        left.say("pictures", str(error))

    strange: Counter[str] = Counter()
    for element, rule in checked(root, "urdf", faulty):
        strange.update(f"<{child.tag}> in <{element.tag}>" for child in element.children if is_left_out(child, rule))
        for child in element.children:
            if child.tag.startswith("xacro:"):
                raise child.error("the file still has xacro in it; expand it first (ros2 run xacro xacro ...)")
    for name, count in strange.items():
        left.say("not_urdf", name if count == 1 else f"{name}, {count} times")
    version = _version(root)
    links, joints = _named(root, "link"), _named(root, "joint")
    for material in root.all("material"):
        _drawn(check_material, material, left)
    robot = ET.Element("robot", name=root.attributes["name"], version="{}.{}".format(*version))
    for link in links.values():
        _check_link(link, version, left)
        robot.append(_part(link))
    for joint in joints.values():
        check_joint(joint, version, left)
    mimics = mimic_couplings(joints, left)
    counted = coupled_joints((*closures, *mimics))
    for name, joint in joints.items():
        robot.append(_joint(joint, name in counted))
    _check_tree(root, links, joints)
    for element, name in unread_physics(root):
        warn(f"line {element.line}: {element.place}: {name} is not read", RuntimeWarning)
    return CheckedUrdf(ET.tostring(robot, encoding="unicode"), mimics, words, tuple(urdf_shapes(root, folder)))


def _version(root: Element) -> tuple[int, int]:
    given = root.attributes.get("version")
    if given not in _VERSIONS:
        raise root.error(f"expected 1.0, 1.1 or 1.2, got {given!r}", "version")
    if not root.attributes["name"]:
        raise root.error("expected a name, got an empty one", "name")
    return _VERSIONS[given]


def _named(root: Element, tag: str) -> dict[str, Element]:
    """Links or joints by name."""
    found: dict[str, Element] = {}
    for element in root.all(tag):
        name = element.attributes["name"]
        if not name:
            raise element.error("expected a name, got an empty one", "name")
        if name == "universe":
            raise element.error("this name is the world's; choose another one", "name")
        if name in found:
            raise element.error(f"expected a name of its own; line {found[name].line} has a {tag} of this name, too")
        found[name] = element
    return found


def _drawn(check: Callable[[Element], None], picture: Element, left: LeftOut) -> None:
    """Check what is drawn, which may be wrong: it has no effect on the motion."""
    try:
        check(picture)
    except FileFormatError as error:
        left.say("pictures", str(error))


def _check_link(link: Element, version: tuple[int, int], left: LeftOut) -> None:
    """A link's origin, pictures, mass and inertia."""
    origin = link.first("origin")
    if origin is not None:
        check_origin(origin, version)
        if vector(origin, "xyz", NOTHING).any() or vector(origin, "rpy", NOTHING).any():
            raise origin.error("a link has no origin of its own in URDF: place its joint, its inertial or its visual")
    for child in link.children:
        if child.tag in ("visual", "collision"):
            _drawn(partial(check_picture, version=version), child, left)
    inertial = link.first("inertial")
    if inertial is not None:
        check_origin(inertial.first("origin"), version)
        inertia_of(inertial, left)


def _part(element: Element) -> ET.Element:
    """What of an element makes the model, its numbers spelt in one way."""
    part = ET.Element(element.tag)
    for key, text in element.attributes.items():
        if key in _NAMES:
            part.set(key, text)
        elif key in _NUMBERS:
            part.set(key, " ".join(repr(float(word)) for word in text.split()))
    parts = [_part(child) for child in element.children if child.tag in _PARTS]
    part.extend(child for child in parts if child.attrib or len(child))
    return part


def _joint(joint: Element, counted: bool) -> ET.Element:
    """A joint; an endless one that counts turns as a hinge without limits."""
    part, kind = _part(joint), joint.attributes["type"]
    axis = part.find("axis")
    if axis is not None and kind in ("fixed", "floating"):
        part.remove(axis)
    elif axis is not None:
        direction = vector(joint.first("axis"), "xyz", NOTHING)
        # Divided by a power of two, which rounds nothing, so that no square of a long axis overflows.
        axis.set("xyz", as_numbers(np.ldexp(direction, 1 - np.frexp(np.abs(direction).max())[1])))
    if counted and kind == "continuous":
        part.set("type", "revolute")
        limit = part.find("limit")
        if limit is None:
            limit = ET.SubElement(part, "limit", effort=repr(NO_LIMIT), velocity=repr(NO_LIMIT))
        limit.attrib |= _ENDLESS
    return part


def _check_tree(root: Element, links: dict[str, Element], joints: dict[str, Element]) -> None:
    """Every joint's links exist, and they make one tree that is not too deep."""
    if not links:
        raise root.error("expected at least one link")
    carriers: dict[str, Element] = {}
    children: dict[str, list[str]] = {}
    for joint in joints.values():
        ends = []
        for tag in ("parent", "child"):
            end = joint.first(tag)
            assert end is not None
            ends.append(end.attributes["link"])
            if ends[-1] not in links:
                raise end.error(f"there is no link {ends[-1]!r}", "link")
        parent, child = ends
        if child in carriers:
            other = carriers[child].attributes["name"]
            raise joint.error(f"link {child!r} is the child of joint {other!r} already: state the loop as a closure")
        carriers[child] = joint
        children.setdefault(parent, []).append(child)
    roots = [name for name in links if name not in carriers]
    if len(roots) > 1:
        shown = ", ".join(repr(name) for name in roots[:5])
        raise root.error(f"expected one root link, got {len(roots)} links that are no joint's child: {shown}")
    level, depth, reached = roots, 0, 0
    while level:
        depth, reached = depth + 1, reached + len(level)
        if depth > DEEPEST:
            raise root.error(f"a chain of more than {DEEPEST} links, one on the other, is too deep to be read")
        level = [child for parent in level for child in children.get(parent, ())]
    if reached < len(links):
        raise root.error(f"{len(links) - reached} links hang on each other in a circle, and not on one root link")
