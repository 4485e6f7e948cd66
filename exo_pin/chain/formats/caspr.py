"""Cable-driven robots of CASPR: two XML files, the links with their joints and the cables with their attachments.

Read are ``<link_rigid>`` with every joint that :data:`JOINTS` lists, a hinge or slide along a given axis (``R_AXIS``,
``P_AXIS``), and ``<cable_ideal>`` with attachments at points. The files are in m, kg, rad and N.
A ball, and the ball of a free link, has a quaternion in place of CASPR's three angles. Gravity is along -z, as there.
CASPR does not hold joints within ``q_min`` and ``q_max``; of hinges and slides they are kept as limits. Cables with
springs, pulleys and other links are errors that name them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, UnknownName
from ...core.files.atomic import read_text
from ...core.files.toml_tables import naming_file
from ...core.validation import FloatArray
from ..structure.description import Cable, Closures, Roles
from .bodies import add_frame, add_joint, axis_joint
from .joint_data import put_data
from .xml_elements import Element, number, numbers, numbers_of, parse_xml

#: What moves, one after the other: slides along axes, then turns about them; a ball by its angles, "XYZ" about axes
#: that turn along, "xyz" about fixed ones.
JOINTS = {
    **{f"R_{axis}": ("", axis) for axis in "XYZ"},
    **{f"P_{axes}": (axes, "") for axes in ("X", "XY", "XZ")},
    **{f"U_{axes}": ("", axes) for axes in ("XY", "XZ", "YZ")},
    **{f"PLANAR_{axes}": (axes, normal) for axes, normal in (("XY", "Z"), ("XZ", "Y"), ("YZ", "X"))},
    "T_XYZ": ("XYZ", ""),
    "S_EULER_XYZ": ("", "XYZ ball"),
    "S_FIXED_XYZ": ("", "xyz ball"),
    "SPATIAL_EULER_XYZ": ("XYZ", "XYZ ball"),
}
_MOMENTS = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
_DOCTYPE = re.compile(r"<!DOCTYPE[^\[>]*>")


def read_caspr(
    bodies: str | PathLike[str], cables: str | PathLike[str], cable_set: str | None = None
) -> tuple[pin.Model, Closures]:
    """Load a cable-driven robot of CASPR.

    See :mod:`exo_pin.chain.formats.caspr`.

    Parameters
    ----------
    bodies, cables : path-like or str
        The two XML files, or the XML itself.
    cable_set : str, optional
        The set of cables; by default the file's ``default_cable_set``.

    Returns
    -------
    pinocchio.Model
        The tree, with a joint and a frame of the link's name; where a link has several joints, as "arm_x" and
        "arm_turn_z". ``referenceConfigurations`` has "q_initial".
    Closures
        The cables in ``cables``, with their least and greatest tension, N; joints with ``actuated`` in the roles. Of
        both ``ClosedChain.from_caspr`` makes the chain.

    Raises
    ------
    FileFormatError
        If a file is not of this format, or has something that is not read.
    UnknownName
        If there is no such set of cables.

    Examples
    --------
    >>> own = "<mass>2</mass><com_location>0 0 -0.3</com_location>"
    >>> base = "<parent><num>0</num><location>0 0 0</location></parent>"
    >>> moments = "<Ixx>1</Ixx><Iyy>1</Iyy><Izz>0</Izz><Ixy>0</Ixy><Ixz>0</Ixz><Iyz>0</Iyz>"
    >>> joint = "<joint type='R_Y' q_initial='0' q_min='-1' q_max='1'/>"
    >>> body = f"{joint}<physical>{own}<inertia ref='com'>{moments}</inertia></physical>{base}"
    >>> bodies = f"<bodies_system><links><link_rigid num='1' name='arm'>{body}</link_rigid></links></bodies_system>"
    >>> points = "<attachment><link>{}</link><location>{}</location></attachment>"
    >>> ends = points.format(0, "0.2 0 0") + points.format(1, "0 0 -0.5")
    >>> force = "<properties><force_min>1</force_min><force_max>50</force_max></properties>"
    >>> cable = f"<cable_ideal name='lifter' attachment_reference='joint'>{force}<attachments>{ends}</attachments>"
    >>> cables = f"<cables default_cable_set='one'><cable_set id='one'>{cable}</cable_ideal></cable_set></cables>"
    >>> chain = ep.ClosedChain.from_caspr(bodies, cables)
    >>> [(cable.name, cable.tension, len(cable.points)) for cable in chain.description.cables]
    [('lifter', (1.0, 50.0), 2)]
    """
    with _named(bodies, "bodies") as root:
        model, actuated, centres = _tree(root)
    with _named(cables, "cables") as root:
        sets = {each.attributes.get("id", ""): each for each in root.all("cable_set")}
        chosen = root.attributes.get("default_cable_set", "") if cable_set is None else cable_set
        if chosen not in sets:
            raise UnknownName("set of cables", chosen, sets)
        read = tuple(_cable(each, {"universe": np.zeros(3), **centres}) for each in sets[chosen].children)
        try:
            return model, Closures(model.name, roles=Roles(tuple(actuated)), cables=read)
        except InvalidInput as error:
            raise root.error(str(error)) from error


@contextmanager
def _named(source: str | PathLike[str], what: str) -> Iterator[Element]:
    """The root element of a file, whose errors name the file."""
    is_text = isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<")
    text, path = (str(source), None) if is_text else (read_text(source), source)
    with naming_file(path):
        # The type of the document names the rules of the format, and nothing that counts.
        yield parse_xml(_DOCTYPE.sub("", text, count=1), f"CASPR's {what}")


def _only(element: Element, *tags: str) -> Element:
    """The element at the end of a path of tags."""
    for tag in tags:
        found = element.first(tag)
        if found is None:
            raise element.error(f"expected <{tag}>")
        element = found
    return element


def _number(element: Element, tag: str) -> float:
    found = _only(element, tag)
    return numbers_of(found, found.text, 1)[0]


def _place(element: Element, tag: str = "location") -> FloatArray:
    found = _only(element, tag)
    return np.array(numbers_of(found, found.text, 3))


def _link_of(element: Element, tag: str, links: list[str]) -> str:
    given = _number(element, tag)
    if given not in range(len(links)):
        raise element.error(f"expected a link before this one, from 0, the base, to {len(links) - 1}, got {given:g}")
    return links[int(given)]


def _tree(root: Element) -> tuple[pin.Model, list[str], dict[str, FloatArray]]:
    """The tree, its actuated joints, and of every link its centre of mass from its joint."""
    model, centres, start, actuated = pin.Model(), dict[str, FloatArray](), list[float](), list[str]()
    model.name = "caspr"
    for count, link in enumerate(_only(root, "links").children, 1):
        if link.tag != "link_rigid" or number(link, "num") != count:
            raise link.error(
                f"expected <link_rigid num='{count}'>: other links, and links in another order, are not read"
            )
        name = link.attributes.get("name") or f"link_{count}"
        if name in ("universe", *centres):
            raise link.error(f"two links have the name {name!r}, or one the base's")
        above = _link_of(_only(link, "parent"), "num", ["universe", *centres])
        index = model.frames[model.getFrameId(above, pin.FrameType.BODY)].parentJoint if above != "universe" else 0
        place = pin.SE3(np.eye(3), _place(_only(link, "parent")))
        joint = _only(link, "joint")
        for suffix, made, low, high, at in _joints(joint):
            index = add_joint(model, index, made, place, name + suffix)
            put_data(model, index, {"lower_position": low, "upper_position": high})
            place = pin.SE3.Identity()
            start += at
            if joint.attributes.get("actuated") == "true":
                actuated.append(name + suffix)
        physical = _only(link, "physical")
        centres[name] = _place(physical, "com_location")
        model.appendBodyToJoint(index, _inertia(physical, centres[name]), place)
        add_frame(model, name, index, place, pin.FrameType.BODY)
    model.referenceConfigurations["q_initial"] = np.array(start)
    return model, actuated, centres


def _inertia(physical: Element, centre: FloatArray) -> pin.Inertia:
    mass, given = _number(physical, "mass"), _only(physical, "inertia")
    xx, yy, zz, xy, xz, yz = (_number(given, key) for key in _MOMENTS)
    moments = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if given.attributes.get("ref") == "joint":
        moments -= mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    elif given.attributes.get("ref") != "com":
        raise given.error("expected ref='com' or ref='joint'")
    principal, axes = np.linalg.eigh(moments)
    if mass < 0.0 or principal[0] < -1e-9 * max(1e-9, float(np.abs(moments).max())):
        raise physical.error("a mass or a moment of inertia is below zero")
    # Pinocchio takes none below zero, not even by rounding.
    moments = moments if principal[0] >= 0.0 else (axes * np.maximum(principal, 0.0)) @ axes.T
    return pin.Inertia(mass, centre, moments)


def _joints(joint: Element) -> Iterator[tuple[str, pin.JointModel, FloatArray, FloatArray, list[float]]]:
    """Pinocchio's joints of a joint: ends of their names, limits of q, and q at the start."""
    kind = joint.attributes.get("type", "")
    if kind in ("R_AXIS", "P_AXIS"):
        axis = np.array(numbers(joint, "axis", 3))
        if not axis.any():
            raise joint.error("the axis is zero", "axis")
        yield "", axis_joint(kind[0] == "P", axis / np.linalg.norm(axis)), *_limits(joint, 1)
        return
    if kind not in JOINTS:
        raise joint.error(str(UnknownName("type of joint", kind, [*JOINTS, "R_AXIS", "P_AXIS"])), "type")
    slides, turns = JOINTS[kind]
    angles, _, ball = turns.partition(" ")
    low, high, start = _limits(joint, len(slides) + len(angles))
    count = len(slides)
    if ball:
        quaternion = Rotation.from_euler(angles, start[count:]).as_quat().tolist()
        made = pin.JointModelFreeFlyer() if slides else pin.JointModelSpherical()
        free = np.full(made.nq, np.inf)
        yield "", made, -free, free, start[:count] + quaternion
        return
    for k, way in enumerate(slides + angles):
        one = "" if count + len(angles) == 1 else f"_{'' if k < count else 'turn_'}{way.lower()}"
        made = axis_joint(k < count, np.array([way == other for other in "XYZ"], dtype=float))
        yield one, made, low[k : k + 1], high[k : k + 1], start[k : k + 1]


def _limits(joint: Element, count: int) -> tuple[FloatArray, FloatArray, list[float]]:
    for key in ("q_initial", "q_min", "q_max"):
        if key not in joint.attributes:
            raise joint.error(f"the attribute {key!r} is missing")
    low, high, start = (numbers(joint, key, count) for key in ("q_min", "q_max", "q_initial"))
    return np.array(low), np.array(high), start


def _cable(element: Element, centres: dict[str, FloatArray]) -> Cable:
    """A cable along straight pieces between its attachments."""
    about = element.attributes.get("attachment_reference")
    if element.tag != "cable_ideal" or about not in ("com", "joint"):
        raise element.error("only <cable_ideal> with attachment_reference='com' or 'joint' is read")
    points = []
    for each in _only(element, "attachments").children:
        if each.tag != "attachment":
            raise each.error("only attachments at points are read, no pulleys")
        link, at = _link_of(each, "link", list(centres)), _place(each)
        points.append((link, tuple((at + centres[link] if about == "com" else at).tolist())))
    low, high = (_number(_only(element, "properties"), key) for key in ("force_min", "force_max"))
    if len(points) < 2 or not 0.0 <= low <= high:
        raise element.error("expected two or more attachments, and 0 <= force_min <= force_max")
    return Cable(element.attributes.get("name", ""), tuple(points), (low, high))
