"""From files to a Pinocchio tree and its closures.

A check of a URDF before Pinocchio reads it, which drops what it does not understand.

:func:`checked_urdf` returns the part that makes the model: inertias of links, and joints. Every number is spelt so that
Pinocchio's reader reads it correctly, whatever the file's encoding, line ends and blanks.

The rules of elements and attributes are in ``urdf_grammar.toml``. Extensions of other programs are not read: every
element and attribute with a prefix (``drake:...``), except xacro's, which have to be expanded first, and those without
a prefix that are common in published files.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ....core.errors import FileFormatError, UnknownName
from ....core.errors.base import warn
from ...structure.closures import Closure
from ...structure.description import Closures, JointProperties, Shape
from ..bodies import rebuilt
from ..closures_file import read_closures
from ..digits import Redrawn, closure_words, exact_right_angles, geometry_words, refuse_tolerance, with_digits
from ..joint_data import NO_LIMIT, apply_joint_properties, repair_limits
from ..leaving_out import LEAVE_OUT, LeftOut
from ..shapes import urdf_shapes
from ..urdf_dialects import DIALECTS, extensions, with_dialects
from ..xml_elements import MOMENTS, NOTHING, Element, as_numbers, checked, is_left_out, parse_xml, read_source, vector
from .urdf_values import (
    check_joint,
    check_origin,
    inertia_of,
    mimic_couplings,
    unread_physics,
    with_mimics,
)

#: Longest chain of links that is read. Pinocchio's reader calls itself once a link, and the stack of a thread
#: (8 MiB) ends between 3,000 and 4,000 links.
DEEPEST = 1000

#: What of links and joints makes the model: elements, attributes that are names, and attributes that are numbers.
_PARTS = ("inertial", "mass", "inertia", "parent", "child", "origin", "axis", "limit", "dynamics")
_NAMES = ("name", "type", "link")
_NUMBERS = {"xyz", "rpy", "quat_xyzw", "value", *MOMENTS, "lower", "upper", "effort", "velocity", "damping", "friction"}
_ENDLESS = {"lower": repr(-NO_LIMIT), "upper": repr(NO_LIMIT)}

_VERSIONS = {None: (1, 0), "1.0": (1, 0), "1": (1, 0), "1.1": (1, 1), "1.2": (1, 2)}


#: Most degrees of freedom: Pinocchio's Data takes 64 bytes times their cube, 4 GB for these.
_MOST_FREEDOMS = 400
#: Joints of roots by name; "fixed" needs none.
ROOT_MODELS = {
    "spherical": pin.JointModelSpherical,
    "free_flyer": pin.JointModelFreeFlyer,
    "planar": pin.JointModelPlanar,
    "translation": pin.JointModelTranslation,
}


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

    strange: Counter[tuple[str, str]] = Counter()
    for element, rule in checked(root, "urdf", lambda error: left.say("pictures", str(error))):
        unread = (child.tag for child in element.children if is_left_out(child, rule) and child.tag not in DIALECTS)
        strange.update((tag, f"<{tag}> in <{element.tag}>") for tag in unread)
        for child in element.children:
            if child.tag.startswith("xacro:"):
                raise child.error("the file still has xacro in it; expand it first (ros2 run xacro xacro ...)")
    left.unread(strange)
    version = _version(root)
    links, joints = _named(root, "link"), _named(root, "joint")
    robot = ET.Element("robot", name=root.attributes["name"], version="{}.{}".format(*version))
    for link in links.values():
        _check_link(link, version, left)
        robot.append(_part(link))
    for joint in joints.values():
        check_joint(joint, version, left)
    mimics = mimic_couplings(joints, left)
    counted = {end for each in (*closures, *mimics) if each.kind.is_coupling for end in (each.frame_a, each.frame_b)}
    for name, joint in joints.items():
        robot.append(_joint(joint, name in counted))
    _check_tree(root, links, joints)
    for element, name in unread_physics(root):
        warn(f"line {element.line}: {element.place}: {name} is not read", RuntimeWarning)
    return CheckedUrdf(
        ET.tostring(robot, encoding="unicode"), mimics, words, tuple(urdf_shapes(root, folder, version, left))
    )


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


def _check_link(link: Element, version: tuple[int, int], left: LeftOut) -> None:
    """A link's origin, mass and inertia."""
    origin = link.first("origin")
    if origin is not None:
        check_origin(origin, version)
        if vector(origin, "xyz", NOTHING).any() or vector(origin, "rpy", NOTHING).any():
            raise origin.error("a link has no origin of its own in URDF: place its joint, its inertial or its visual")
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
        ends = [end for tag in ("parent", "child") for end in joint.all(tag)[:1]]
        for end in ends:
            if end.attributes["link"] not in links:
                raise end.error(f"there is no link {end.attributes['link']!r}", "link")
        parent, child = (end.attributes["link"] for end in ends)
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


def load_model(
    urdf: str | PathLike[str],
    closures: Closures | str | PathLike[str] | None = None,
    root_joint: str | None = None,
    right_angle_tolerance: float = 0.0,
    leave_out: Iterable[str] = (),
) -> tuple[pin.Model, Closures]:
    """Load a chain.

    Parameters
    ----------
    urdf : path-like or str
        The file, or the XML itself.
    closures : Closures or path-like, optional
        What closes the loops; by default the file beside the URDF, ``robot.closures.toml`` for
        ``robot.urdf``. Loops that elements of other programs state are added, see
        :mod:`exo_pin.chain.formats.urdf_dialects`. Where there are none the URDF is read as a tree.
    root_joint : str, optional
        How the root link hangs in the world, one of :data:`exo_pin.chain.ROOT_JOINTS`; by default that of the
        closures.
    right_angle_tolerance : float
        Angles ``rpy`` of the URDF this near a multiple of π/2 are read as that multiple, rad: 2e-5 for 1.5708,
        which tilts the axes of loops that are meant to be plane. Not above 0.01.
    leave_out : iterable of str
        Names of :data:`exo_pin.chain.formats.leaving_out.LEAVE_OUT`: "inertia_rules" reads inertias that no body has,
        "loops" what states a loop that no closure holds. ``description.left_out`` says what was left out.

    Returns
    -------
    pinocchio.Model
        The tree.
    Closures
        Its loops, roles and springs; of both ``ClosedChain.from_urdf`` makes the chain.

    Raises
    ------
    FileFormatError
        If the URDF or the closures file is not valid; the message names the place and line, see
        :mod:`exo_pin.chain.formats.urdf.urdf_loading`. Mimic joints become closures, see
        :mod:`exo_pin.chain.formats.urdf.urdf_values`.
    UnknownName
        If a root joint, frame, joint or closure type is not known.
    InvalidInput
        If data of a joint in the closures have another unit or number of components than the joint.

    Examples
    --------
    >>> mass = '<inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    >>> urdf = f'<robot name="satellite"><link name="body">{mass}</link></robot>'
    >>> chain = ep.ClosedChain.from_urdf(urdf, root_joint="free_flyer")
    >>> chain.model.nq, chain.model.nv  # a position and a quaternion; a velocity and an angular velocity
    (7, 6)
    """
    refuse_tolerance(right_angle_tolerance)
    source, path = read_source(urdf)
    left, beside = LeftOut(leave_out), path and path.with_suffix(".closures.toml")
    missing = closures is None and not (beside and beside.exists())
    if missing:
        closures = Closures(path.stem if path else "unnamed")
    elif not isinstance(closures, Closures):
        closures = read_closures(beside if closures is None else closures)  # type: ignore[arg-type]
    assert isinstance(closures, Closures)
    root = closures.root
    hangs = root.joint if root_joint is None else root_joint
    if hangs != "fixed" and hangs not in ROOT_MODELS:
        raise UnknownName("root joint", hangs, ("fixed", *ROOT_MODELS))

    try:
        folder = None if path is None else path.parent
        document = parse_xml(source)
        exact_right_angles(document, right_angle_tolerance)
        checked = checked_urdf(document, left, closures.closures, folder)
        closures = with_mimics(closures, checked.mimics)
        kinds, closures = _kinds_of_floating(closures)
        model, own, stated = _built(checked.text, hangs, root.name, kinds), extensions(document), closures
        closures = with_dialects(stated, own, model, left)
    except FileFormatError as error:
        raise FileFormatError(str(error), path, error.key) from error
    if missing and closures is stated:
        left.say("closures", f"there is no {beside.name if beside else 'closures file'}: read as a tree")
    model.gravity.linear = np.array(root.gravity)
    apply_joint_properties(model, closures.joints)
    closures = replace(closures, left_out=(*closures.left_out, *left.report), shapes=checked.shapes)

    def again(digits: Redrawn) -> tuple[pin.Model, Closures]:
        document = digits.element(parse_xml(checked.text))
        whole = checked_urdf(document, LeftOut(LEAVE_OUT))
        redrawn = _built(whole.text, hangs, root.name, kinds)
        loops = with_dialects(digits.closures(stated), digits.element(own), redrawn, LeftOut(LEAVE_OUT))
        return redrawn, replace(closures, closures=loops.closures)

    words = (*checked.words, *geometry_words(own), *closure_words(stated))
    return model, with_digits(model, closures, words, again)


def _kinds_of_floating(closures: Closures) -> tuple[dict[str, str], Closures]:
    """What the joints are that a URDF calls floating, by name, and the closures without that."""
    kinds = {item.joint: item.type for item in closures.joints if item.type is not None}
    plain = (item if item.type is None else replace(item, type=None) for item in closures.joints)
    return kinds, replace(closures, joints=tuple(item for item in plain if item != JointProperties(item.joint)))


def _built(text: str, hangs: str, name: str, kinds: dict[str, str]) -> pin.Model:
    """The model of a checked URDF, hanging on a joint of this name unless it is fixed; floating joints as they are.

    Raises
    ------
    FileFormatError
        If Pinocchio reads no model of it, or a joint that is to be another one does not float.
    """
    try:
        model = pin.buildModelFromXML(text, *(() if hangs == "fixed" else (ROOT_MODELS[hangs](), name)))
    except (RuntimeError, ValueError, TypeError) as error:
        raise FileFormatError(f"not a URDF that Pinocchio reads: {error}") from error
    if hangs != "fixed" and list(model.names).count(name) > 1:
        raise FileFormatError(
            f"the root joint and a joint of the URDF are both called {name!r}: rename one", None, name
        )
    if model.nv > _MOST_FREEDOMS:
        raise FileFormatError(
            f"{model.nv} degrees of freedom are too many: Pinocchio's memory for a tree grows with their cube, "
            f"and ends at {_MOST_FREEDOMS}"
        )
    repair_limits(model)
    found = {}
    for name, kind in kinds.items():
        index = list(model.names).index(name) if name in model.names else 0
        if not index or model.joints[index].shortname() != "JointModelFreeFlyer":
            raise FileFormatError(f"expected a floating joint {name!r} in the URDF, for a type of {kind!r}", None, name)
        found[index] = {"": ROOT_MODELS[kind]()}
    return rebuilt(model, found) if found else model
