"""URDF text: links, joints and pictures, numbers written so that they read back bit for bit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike

from ....core.records import Record
from ....core.validation import FloatArray
from ..joint_data import NO_LIMIT

__all__ = ["COLOURS", "Body", "Document", "JointStrength", "Picture"]

#: Materials by name, red, green, blue, alpha.
COLOURS = {
    "arm": (0.90, 0.76, 0.65, 1.0),
    "platform": (0.35, 0.55, 0.80, 1.0),
    "platform_half": (0.20, 0.20, 0.22, 1.0),
    "base_half": (0.75, 0.75, 0.78, 1.0),
    "cross": (0.85, 0.55, 0.15, 1.0),
    "base": (0.45, 0.45, 0.50, 1.0),
}

# What URDF demands and nobody knows: N or N m, m/s or rad/s.
_SLIDE_EFFORT, _SPEED = 1000.0, 100.0


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
class JointStrength:
    """What a hinge or slide can give and bear.

    Attributes
    ----------
    effort, velocity : float
        Limits, N or N m, m/s or rad/s; infinite for none.
    damping, friction : float
        N s/m or N m s/rad, and the largest dry friction, N or N m.
    """

    effort: float
    velocity: float
    damping: float = 0.0
    friction: float = 0.0


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
        self._notes, self._lines = list(notes), list[str]()

    def note(self, text: str) -> None:
        """Add a comment to the head."""
        self._notes.append(text)

    def link(self, name: str, body: Body | None, pictures: Sequence[Picture] = ()) -> None:
        """Add a link; without a body it has no ``<inertial>``."""
        inner = [*_inertial(body), *(line for picture in pictures for line in _visual(picture))]
        if inner:
            self._lines += [f"  <link name={quoteattr(name)}>", *inner, "  </link>"]
        else:
            self._lines.append(f"  <link name={quoteattr(name)}/>")

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
        strength: JointStrength | None = None,
    ) -> None:
        """Add a joint; its frame is parallel to its parent's unless a rotation, shape (3, 3), is given.

        Limits are in rad or m. Without a strength its limits of effort and velocity are what URDF wants and nobody
        knows.
        """
        turned = "" if rotation is None else f' rpy="{_numbers(_roll_pitch_yaw(rotation))}"'
        self._lines += [
            f"  <joint name={quoteattr(name)} type={quoteattr(kind)}>",
            f"    <parent link={quoteattr(parent)}/>",
            f"    <child link={quoteattr(child)}/>",
            f'    <origin xyz="{_numbers(origin)}"{turned}/>',
            f'    <axis xyz="{_numbers(axis)}"/>',
        ]
        if kind not in ("fixed", "floating"):
            self._lines += _limit_and_dynamics(kind, limits, strength)
        self._lines.append("  </joint>")

    def text(self) -> str:
        """The XML."""
        head = ['<?xml version="1.0"?>', *(f"<!-- {note.replace('--', '- -')} -->" for note in self._notes)]
        used = [key for key in COLOURS if any(f'name="{key}"/>' in line for line in self._lines)]
        paint = [f'  <material name="{key}"><color rgba="{_numbers(COLOURS[key])}"/></material>' for key in used]
        return "\n".join([*head, f"<robot name={quoteattr(self.name)}>", *paint, *self._lines, "</robot>"]) + "\n"


def _limit_and_dynamics(kind: str, limits: ArrayLike | None, strength: JointStrength | None) -> list[str]:
    if strength is None:
        # A passive joint gives no effort.
        strength = JointStrength(_SLIDE_EFFORT if kind == "prismatic" else 0.0, _SPEED)
    span = ""
    if limits is not None:
        low, high = np.asarray(limits, dtype=float)
        span = f'lower="{_number(low)}" upper="{_number(high)}" '
    lines = []
    if limits is not None or strength.effort < NO_LIMIT or strength.velocity < NO_LIMIT:
        effort, velocity = (_number(min(limit, NO_LIMIT)) for limit in (strength.effort, strength.velocity))
        lines.append(f'    <limit {span}effort="{effort}" velocity="{velocity}"/>')
    if strength.damping != 0.0 or strength.friction != 0.0:
        damping, friction = _number(strength.damping), _number(strength.friction)
        lines.append(f'    <dynamics damping="{damping}" friction="{friction}"/>')
    return lines


def _number(value: float) -> str:
    # Adding zero turns -0.0 into 0.0.
    return repr(float(value) + 0.0)


def _roll_pitch_yaw(R: FloatArray) -> list[float]:
    """Angles of Rz(yaw) Ry(pitch) Rx(roll), which make up R to rounding even where they lock."""
    yaw = float(np.arctan2(R[1, 0], R[0, 0]))
    cos, sin = np.cos(yaw), np.sin(yaw)
    # What is left after the yaw is taken off: Ry(pitch) Rx(roll).
    left = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ R
    return [float(np.arctan2(-left[1, 2], left[1, 1])), float(np.arctan2(-left[2, 0], left[0, 0])), yaw]


def _numbers(values: ArrayLike) -> str:
    return " ".join(_number(value) for value in np.asarray(values, dtype=float))


def _inertial(body: Body | None) -> list[str]:
    if body is None:
        return []
    tensor = body.inertia
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    moments = " ".join(f'{key}="{_number(tensor[entry])}"' for key, entry in entries.items())
    return [
        "    <inertial>",
        f'      <origin xyz="{_numbers(body.centre)}"/>',
        f'      <mass value="{_number(body.mass)}"/>',
        f"      <inertia {moments}/>",
        "    </inertial>",
    ]


def _visual(picture: Picture) -> list[str]:
    start = np.array(picture.start)
    radius = _number(picture.radius)
    if picture.end is None:
        origin, shape = f'xyz="{_numbers(start)}"', f'<sphere radius="{radius}"/>'
    else:
        line = np.array(picture.end) - start
        length = float(np.linalg.norm(line))
        # Rz(yaw) Ry(pitch) turns the cylinder's own z axis onto the line.
        pitch, yaw = np.arctan2(np.hypot(line[0], line[1]), line[2]), np.arctan2(line[1], line[0])
        origin = f'xyz="{_numbers(start + line / 2)}" rpy="{_numbers([0.0, pitch, yaw])}"'
        shape = f'<cylinder radius="{radius}" length="{_number(length)}"/>'
    return [
        "    <visual>",
        f"      <origin {origin}/>",
        f"      <geometry>{shape}</geometry>",
        f'      <material name="{picture.colour}"/>',
        "    </visual>",
    ]
