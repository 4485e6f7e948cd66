"""A URDF made of links, joints and pictures; its numbers read back bit for bit."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ....core.records import Record
from ....core.validation import FloatArray
from ...structure.description import Shape
from ..joint_data import NO_LIMIT
from ..xml_numbers import MOMENTS, as_numbers
from .urdf_shapes import write_urdf_shape

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
            _inertial(link, body)
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


def _inertial(link: ET.Element, body: Body) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=as_numbers(body.centre))
    ET.SubElement(inertial, "mass", value=as_numbers(body.mass))
    ET.SubElement(inertial, "inertia", {key: as_numbers(body.inertia[entry]) for key, entry in MOMENTS.items()})


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
