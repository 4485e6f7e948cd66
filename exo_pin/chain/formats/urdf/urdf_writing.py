"""Writing any chain as URDF, with its closures file beside it.

Damping, friction and limits of a joint go into the URDF, its spring and armature into the closures file. No limit is
written as the largest double, because URDF needs a number; reading it gives no limit again.

A ball joint on which all of a robot hangs is its root. Elsewhere a ball joint or translation of a device, which has an
arm among its roles, is a floating joint in the URDF, and the closures file says what it is: other programs see a link
that floats. Of any other robot it is refused.

A linear coupling is written twice: into the closures file, as every closure, and for other programs as ``<mimic>``, of
which a joint can have one. The reader knows the two as one.

A URDF made of links, joints and pictures; its numbers read back bit for bit.
"""

from __future__ import annotations

import copy
import dataclasses
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ....core.errors import InvalidInput
from ....core.records import Record
from ....core.validation import FloatArray
from ...structure.chain_state import ChainState
from ...structure.description import Closures, JointProperties, Root, Shape
from ..bodies import LINKS_AND_SITES, TreeBody, free_name, one_sided, tree_bodies, welded_to_arm, without, world_link
from ..joint_data import NO_LIMIT
from ..shapes import write_urdf_shape
from ..xml_elements import MOMENTS, as_numbers
from .urdf_values import linear

#: Materials by name, red, green, blue, alpha.
COLOURS = {
    "arm": (0.90, 0.76, 0.65, 1.0),
    "platform": (0.35, 0.55, 0.80, 1.0),
    "platform_half": (0.20, 0.20, 0.22, 1.0),
    "base_half": (0.75, 0.75, 0.78, 1.0),
    "cross": (0.85, 0.55, 0.15, 1.0),
    "base": (0.45, 0.45, 0.50, 1.0),
}

#: Limits of effort and velocity, damping and friction of a passive joint: URDF requires a limit of velocity.
_PASSIVE = (0.0, 100.0, 0.0, 0.0)


_ROOTS = {"ball": "spherical", "free": "free_flyer", "translation": "translation", "planar": "planar"}
#: What the closures file says of joints that are written as floating.
_FLOATING = {"ball": "spherical", "translation": "translation"}
_KINDS = {"hinge": "revolute", "slide": "prismatic"}


@dataclass(frozen=True, eq=False)
class Body(Record):
    """Mass properties of a link.

    Attributes
    ----------
    mass : float
        kg.
    centre : ndarray
        Shape (3,), centre of mass in the link's frame, m.
    inertia : ndarray
        Shape (3, 3), about the centre of mass, axes of the link's frame, kg m².
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray


@dataclass(frozen=True)
class Picture:
    """A primitive shape in a link.

    Attributes
    ----------
    colour : str
        Key of :data:`COLOURS`.
    radius : float
        m.
    start : tuple of float
        Centre of a ball, or one end of a cylinder's axis, in the link's frame, m.
    end : tuple of float or None
        The cylinder's other end.
    """

    colour: str
    radius: float
    start: tuple[float, ...]
    end: tuple[float, ...] | None = None


class Document:
    """A URDF under construction.

    Parameters
    ----------
    name : str
        Of the robot.
    notes : sequence of str
        Comments for its head.
    """

    def __init__(self, name: str, notes: Sequence[str] = ()) -> None:
        self.name = name
        self._notes = list(notes)
        self._robot = ET.Element("robot", name=name)

    def note(self, text: str) -> None:
        """Add a comment to the head."""
        self._notes.append(text)

    def link(self, name: str, body: Body | None, pictures: Sequence[Picture] = ()) -> None:
        """Add a link; without a body it has no ``<inertial>``."""
        link = ET.SubElement(self._robot, "link", name=name)
        if body is not None:
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "origin", xyz=as_numbers(body.centre))
            ET.SubElement(inertial, "mass", value=as_numbers(body.mass))
            moments = {key: as_numbers(body.inertia[entry]) for key, entry in MOMENTS.items()}
            ET.SubElement(inertial, "inertia", moments)
        for picture in pictures:
            _visual(link, picture)

    def joint(
        self,
        name: str,
        kind: str,
        parent: str,
        child: str,
        origin: ArrayLike,
        axis: ArrayLike,
        limits: ArrayLike | None = None,
        rotation: FloatArray | None = None,
        strength: tuple[float, float, float, float] | None = None,
        mimic: tuple[str, float, float] | None = None,
    ) -> None:
        """Add a joint; its frame is parallel to its parent's unless a rotation, shape (3, 3), is given.

        A mimic joint has the joint that it follows, multiplier and offset.

        Limits are in rad or m. The strength is the limits of effort and velocity (N or N m, m/s or rad/s; infinite for
        none), damping (N s/m or N m s/rad) and the largest dry friction (N or N m). Without one the joint is passive.
        """
        joint = ET.SubElement(self._robot, "joint", name=name, type=kind)
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
        place = ET.SubElement(joint, "origin", xyz=as_numbers(origin))
        if rotation is not None:
            place.set("rpy", as_numbers(_roll_pitch_yaw(rotation)))
        ET.SubElement(joint, "axis", xyz=as_numbers(axis))
        if kind not in ("fixed", "floating"):
            _limit_and_dynamics(joint, limits, strength)
        if mimic is not None:
            leader, multiplier, offset = mimic
            ET.SubElement(joint, "mimic", joint=leader, multiplier=as_numbers(multiplier), offset=as_numbers(offset))

    def shapes(self, shapes: Iterable[Shape], world: str | None) -> None:
        """Add shapes to the links of these names, those of the world to a link; a comment says what is left out."""
        links = {link.get("name"): link for link in self._robot.iter("link")}
        if world in links:
            links["universe"] = links[world]
        unwritten = (each for each in shapes if not (each.frame in links and write_urdf_shape(links[each.frame], each)))
        left = Counter(each.kind for each in unwritten)
        if left:
            self.note(f"Shapes without a link or a kind in URDF are left out: {dict(left)}.".replace("'", ""))

    def text(self) -> str:
        """The XML."""
        robot = copy.deepcopy(self._robot)
        used = {material.get("name") for material in robot.iter("material")}
        for place, key in enumerate(key for key in COLOURS if key in used):
            material = ET.Element("material", name=key)
            ET.SubElement(material, "color", rgba=as_numbers(COLOURS[key]))
            robot.insert(place, material)
        ET.indent(robot)
        # ElementTree writes no comment before the root.
        head = ['<?xml version="1.0"?>', *(f"<!-- {note.replace('--', '- -')} -->" for note in self._notes)]
        return "\n".join([*head, ET.tostring(robot, encoding="unicode"), ""])


def _limit_and_dynamics(
    joint: ET.Element, limits: ArrayLike | None, strength: tuple[float, float, float, float] | None
) -> None:
    effort, velocity, damping, friction = strength or _PASSIVE
    if limits is not None or effort < NO_LIMIT or velocity < NO_LIMIT:
        limit = ET.SubElement(joint, "limit")
        if limits is not None:
            low, high = np.asarray(limits, dtype=float)
            limit.attrib |= {"lower": as_numbers(low), "upper": as_numbers(high)}
        limit.set("effort", as_numbers(min(effort, NO_LIMIT)))
        limit.set("velocity", as_numbers(min(velocity, NO_LIMIT)))
    if damping != 0.0 or friction != 0.0:
        ET.SubElement(joint, "dynamics", damping=as_numbers(damping), friction=as_numbers(friction))


def _roll_pitch_yaw(R: FloatArray) -> list[float]:
    """Angles of Rz(yaw) Ry(pitch) Rx(roll), which make up R to rounding even where they lock."""
    yaw = float(np.arctan2(R[1, 0], R[0, 0]))
    cos, sin = np.cos(yaw), np.sin(yaw)
    # What is left after the yaw is taken off: Ry(pitch) Rx(roll).
    left = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ R
    return [float(np.arctan2(-left[1, 2], left[1, 1])), float(np.arctan2(-left[2, 0], left[0, 0])), yaw]


def _visual(link: ET.Element, picture: Picture) -> None:
    start = np.array(picture.start)
    visual = ET.SubElement(link, "visual")
    origin, geometry = ET.SubElement(visual, "origin"), ET.SubElement(visual, "geometry")
    if picture.end is None:
        origin.set("xyz", as_numbers(start))
        ET.SubElement(geometry, "sphere", radius=as_numbers(picture.radius))
    else:
        line = np.array(picture.end) - start
        # Rz(yaw) Ry(pitch) turns the cylinder's own z axis onto the line.
        pitch, yaw = np.arctan2(np.hypot(line[0], line[1]), line[2]), np.arctan2(line[1], line[0])
        origin.attrib |= {"xyz": as_numbers(start + line / 2), "rpy": as_numbers([0.0, pitch, yaw])}
        length = float(np.linalg.norm(line))
        ET.SubElement(geometry, "cylinder", radius=as_numbers(picture.radius), length=as_numbers(length))
    ET.SubElement(visual, "material", name=picture.colour)


def urdf_text(chain: ChainState) -> tuple[str, Closures]:
    """The XML of a chain, and what goes into its closures file.

    Links that are welded together in the model come out with their masses in the first of them.

    Raises
    ------
    InvalidInput
        If a joint is of a kind that URDF does not have, as a free body on another one, or has data that neither file
        can hold: damping, friction or limits of a joint that is neither hinge nor slide, or limits of effort or
        velocity that differ between the directions. Of the slide of a limb the larger limit of effort is written, and
        a comment says so.
    """
    model, given = chain.model, chain.description
    bodies = tree_bodies(chain)
    document = Document(given.name, ["Written by exo_pin; load it with its closures file."])
    if wider := one_sided(bodies):
        document.note(wider)
    first = [body for body in bodies if body.parent == 0]
    alone = len(first) == 1 and first[0].kind in _ROOTS and first[0].placement.isIdentity(1e-12)
    hung = first[0] if alone else None
    gravity = tuple(np.asarray(model.gravity.linear).tolist())
    links, root, welded = {body.index: body.name for body in bodies}, Root(gravity=gravity), welded_to_arm(chain)
    mimics = _mimics(chain)
    if hung is not None:
        root = Root(_ROOTS[hung.kind], hung.joint, gravity)
    else:
        links[0] = world_link(chain)
        document.link(links[0], _body(model.inertias[0]))
    # Other programs would let the link of another robot come loose, and not know it.
    balls = [] if given.roles.arm is None else [body for body in bodies if body.kind in _FLOATING and body is not hung]
    floating = {body.joint: _FLOATING[body.kind] for body in balls}
    for body in bodies:
        document.link(body.name, _body(without(body.inertia, body.index, welded)))
        if body.axis is None:
            body.refuse("URDF", but=("spring", "armature"))
        if body is hung:
            continue
        place = body.placement.translation, body.placement.rotation
        if body.joint in floating or (body.kind == "free" and body.parent == 0):
            document.joint(
                body.joint, "floating", links[body.parent], body.name, place[0], [1, 0, 0], rotation=place[1]
            )
            continue
        if body.axis is None:
            raise InvalidInput(
                f"URDF has no joint for {body.joint!r}, which is {body.kind}: write MJCF or SDF, "
                "or make it a closure or three hinges"
            )
        endless = body.kind == "hinge" and model.nqs[body.index] == 2
        kind = "continuous" if endless else _KINDS[body.kind]
        if endless:
            body.refuse("URDF", ("position limits",))
        limits = None if endless else np.clip(body.data.position[0], -NO_LIMIT, NO_LIMIT)
        strength = (
            body.effort("URDF"),
            body.data.symmetric("velocity", body.joint, "URDF"),
            float(body.data.damping[0]),
            float(body.data.friction[0]),
        )
        parent, mimic = links[body.parent], mimics.get(body.joint)
        document.joint(body.joint, kind, parent, body.name, place[0], body.axis, limits, place[1], strength, mimic)
    _more_frames(chain, document, links, {part.name: part.inertia for part in welded})
    document.shapes(given.shapes, links.get(0))
    return document.text(), dataclasses.replace(given, root=root, joints=_properties(bodies, given.joints, floating))


def _body(inertia: pin.Inertia) -> Body | None:
    """Mass properties as the document wants them; none without mass."""
    return None if inertia.mass <= 0.0 else Body(inertia.mass, np.array(inertia.lever), np.array(inertia.inertia))


def _mimics(chain: ChainState) -> dict[str, tuple[str, float, float]]:
    """The first linear coupling of every joint b: joint a, multiplier and offset."""
    found: dict[str, tuple[str, float, float]] = {}
    for closure in chain.closures:
        numbers = None if closure.polynomial is None else linear(closure)
        if numbers is not None:
            found.setdefault(closure.frame_b, (closure.frame_a, numbers[1], numbers[0]))
    return found


def _properties(
    bodies: list[TreeBody], given: tuple[JointProperties, ...], floating: dict[str, str]
) -> tuple[JointProperties, ...]:
    """Springs as they were given, the armatures of the model, and what joints are that a URDF calls floating."""
    known = {item.joint: item for item in given}
    for body in bodies:
        item, kind = known.get(body.joint), floating.get(body.joint)
        if item is None and kind is None and not body.data.armature.any():
            continue
        item = item or JointProperties(body.joint)
        # Left out stays left out where the model has none.
        armature = body.data.armature if item.armature is not None or body.data.armature.any() else None
        known[body.joint] = dataclasses.replace(
            item, unit=body.data.unit, armature=None if armature is None else tuple(armature.tolist()), type=kind
        )
    return tuple(known.values())


def _more_frames(chain: ChainState, document: Document, links: dict[int, str], welded: dict[str, pin.Inertia]) -> None:
    """Links without a joint of their own, as welded ones, so that closures and roles still find them."""
    known, joints = {*links.values(), "universe"}, set(chain.model.names)
    for frame in chain.model.frames:
        if frame.type not in LINKS_AND_SITES or frame.name in known or frame.parentJoint not in links:
            continue
        name, carrier, place = frame.name, links[frame.parentJoint], frame.placement
        document.link(name, _body(welded[name]) if name in welded else None)
        weld = free_name(f"{name}_weld", joints)
        document.joint(weld, "fixed", carrier, name, place.translation, [1, 0, 0], rotation=place.rotation)
        known.add(name)
