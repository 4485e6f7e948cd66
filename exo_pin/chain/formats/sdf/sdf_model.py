"""Links and joints of an SDF, in the world's frame, as data; joints stand at zero."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from ....core.errors import FileFormatError
from ....core.validation import FloatArray
from ...structure.closures import Closure
from ...structure.frames import placement_of
from ..leaving_out import LeftOut
from ..shapes import sdf_shape
from ..urdf.urdf_values import inertia_of
from ..xml_elements import Element, flag, numbers_of
from .sdf_frames import Scope, place_of

#: Axes by joint type; a ball joint has none, and may still have an <axis>.
_AXES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("revolute", "continuous", "prismatic"), ("axis",)),
    **dict.fromkeys(("universal", "revolute2"), ("axis", "axis2")),
    **dict.fromkeys(("ball", "fixed"), ()),
}
_NOT_READ = ("screw", "gearbox")
_LIMITS = ("lower", "upper", "effort", "velocity")
#: Density of a collision shape that states none, kg/m³.
_WATER = 1000.0
#: Volumes of shapes, m³, of their sizes.
_VOLUMES: dict[str, Callable[..., float]] = {
    "box": lambda x, y, z: x * y * z,
    "sphere": lambda r: 4.0 / 3.0 * np.pi * r**3,
    "cylinder": lambda r, length: np.pi * r**2 * length,
    "capsule": lambda r, length: np.pi * r**2 * (length + 4.0 / 3.0 * r),
    "ellipsoid": lambda x, y, z: 4.0 / 3.0 * np.pi * x * y * z,
}
#: From this size on a limit is none, as in the specification.
_NO_LIMIT = 1e16
_SHORTEST_AXIS = 1e-6
#: Largest cosine of the angle between the axes of a universal joint that a closure can be.
_SQUARE = 1e-12
#: Types of closures that are called otherwise than the joints.
_CLOSURES = {"continuous": "revolute", "revolute2": "universal", "ball": "spherical", "fixed": "rigid"}


@dataclass(frozen=True, eq=False)
class SdfLink:
    """A link.

    Attributes
    ----------
    name : str
        In the chain.
    place : pinocchio.SE3
        In the world.
    inertia : pinocchio.Inertia
        In the link's frame.
    """

    name: str
    place: pin.SE3
    inertia: pin.Inertia


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis of a joint.

    Attributes
    ----------
    direction : ndarray
        Shape (3,), of length 1, in the joint's frame.
    lower, upper, effort, velocity : float
        Limits, m or rad, N or N m, m/s or rad/s; infinite for none.
    damping, friction, stiffness, reference : float
        N s/m or N m s/rad; N or N m; N/m or N m/rad; m or rad.
    mimic : tuple or None
        Joint and number of the axis that it follows, multiplier, offset and reference.
    """

    direction: FloatArray
    lower: float = -np.inf
    upper: float = np.inf
    effort: float = np.inf
    velocity: float = np.inf
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    reference: float = 0.0
    mimic: tuple[str, int, float, float, float] | None = None

    @property
    def is_bare(self) -> bool:
        """Whether the axis only allows a motion: no closure holds anything else."""
        limits = np.isfinite([self.lower, self.upper, self.velocity]).any() or 0.0 < self.effort < np.inf
        return not (limits or self.damping or self.friction or self.stiffness or self.mimic)


@dataclass(frozen=True, eq=False)
class SdfJoint:
    """A joint.

    Attributes
    ----------
    name, kind : str
        In the chain; type in the file.
    parent, child : str
        Links in the chain, "world" for the world.
    place : pinocchio.SE3
        In the world.
    axes : tuple of Axis
        One for hinges and slides, two for universal joints.
    damping : float
        Of a ball joint, N m s/rad.
    element : Element
        For messages.
    """

    name: str
    kind: str
    parent: str
    child: str
    place: pin.SE3
    axes: tuple[Axis, ...]
    damping: float
    element: Element

    @property
    def is_bare(self) -> bool:
        """Whether it only allows a motion."""
        return not self.damping and all(axis.is_bare for axis in self.axes)


def read_link(scope: Scope, element: Element, left: LeftOut) -> SdfLink:
    """A link of a scope. Without mass or inertia it has those of the specification: 1 kg and 1 kg m².

    Raises
    ------
    FileFormatError
        If a number is none, or the inertia is one that no body has.
    """
    name = element.attributes["name"]
    inertial = element.first("inertial")
    if inertial is None:
        inertia = pin.Inertia(1.0, np.zeros(3), np.eye(3))
    elif inertial.attributes.get("auto", "false") in ("true", "1"):
        inertia = _of_shapes(element, inertial, left)
    else:
        inertia = _inertia(inertial, left)
    return SdfLink(f"{scope.name}{name}", scope.pose(name, element), inertia)


def _inertia(inertial: Element, left: LeftOut) -> pin.Inertia:
    pose = inertial.first("pose")
    if pose is not None and pose.attributes.get("relative_to"):
        raise pose.error("the pose of an inertial is relative to its link", "relative_to")
    mass, tensor = inertia_of(_as_urdf(inertial), left)
    centre = place_of(pose)
    if mass == 0.0:
        return pin.Inertia.Zero()
    return pin.Inertia(mass, centre.translation, centre.rotation @ tensor @ centre.rotation.T)


def _of_shapes(link: Element, inertial: Element, left: LeftOut) -> pin.Inertia:
    """The inertia of a link's collision shapes by their densities, scaled to the mass if one is stated.

    Raises
    ------
    FileFormatError
        If a shape is none that has a volume here.
    """
    total, common = pin.Inertia.Zero(), _one(inertial, "density", _WATER)
    for collision in link.all("collision"):
        try:
            shape = sdf_shape(collision, "", None, left)
            mass = _one(collision, "density", common) * _VOLUMES[shape.kind](*shape.size)
            own = getattr(pin.Inertia, f"From{shape.kind.capitalize()}")(mass, *shape.size)
        except (FileFormatError, KeyError, ValueError) as error:
            raise collision.error("no inertia is computed of this shape: state mass and inertia") from error
        total += pin.XYZQUATToSE3(np.array([*shape.translation, *shape.quaternion])).act(own)
    if total.mass <= 0.0:
        raise inertial.error("there is no collision shape of which to compute the inertia: state it", "auto")
    share = _one(inertial, "mass", total.mass) / total.mass
    return pin.Inertia(share * total.mass, total.lever, share * total.inertia)


def _as_urdf(inertial: Element) -> Element:
    """Mass and inertia as attributes, with the specification's defaults, for the check that URDF has, too."""
    mass, inertia = inertial.first("mass") or inertial, inertial.first("inertia") or inertial
    value = {"value": "1" if mass is inertial else mass.text or "1"}
    entries = {"ixx": "1", "ixy": "0", "ixz": "0", "iyy": "1", "iyz": "0", "izz": "1"}
    entries |= {child.tag: child.text for child in inertia.children if child.tag in entries and child.text}
    found = [Element("mass", value, mass.line, mass.place), Element("inertia", entries, inertia.line, inertia.place)]
    return Element("inertial", {}, inertial.line, inertial.place, found)


def read_joint(scope: Scope, element: Element, left: LeftOut | None = None) -> SdfJoint | None:
    """A joint of a scope; None for one that is left out, which without ``left`` is an error.

    Raises
    ------
    FileFormatError
        If its type is not read, a link or frame is not there, or a value is out of its range.
    """
    name, kind = element.attributes["name"], element.attributes["type"]
    if kind not in _AXES:
        why = "joints of this type are not read" if kind in _NOT_READ else "there is no such type"
        what = f"{why}: expected one of {', '.join(_AXES)}, got {kind!r}"
        if kind not in _NOT_READ or left is None:
            raise element.error(what, "type")
        left.named("joint_types", f"{element.place}: {what}", "state it as a coupling", element.at_line)
        return None
    ends = {}
    for tag in ("parent", "child"):
        end = element.first(tag)
        assert end is not None
        ends[tag] = scope.link_of(end.text, end)
    if ends["child"] == "world":
        raise element.error("the world cannot be a joint's child: exchange parent and child")
    if ends["parent"] == ends["child"]:
        raise element.error(f"it joins link {ends['child']!r} with itself")
    place = scope.pose(name, element)
    tags = _AXES[kind]
    for tag in ("axis", "axis2"):
        if (element.first(tag) is None) == (tag in tags) and (kind, tag) != ("ball", "axis"):
            said = "its <{}> is not there, and along z" if tag in tags else "it has no <{}>, which is not read"
            if left is not None:
                left.say("axes", f"{element.place}, which is {kind}: {said.format(tag)}")
    axes = tuple(
        _axis(scope, element.first(tag) or Element(tag, {}, element.line, element.place), place, kind) for tag in tags
    )
    if len(axes) == 2 and np.linalg.norm(np.cross(axes[0].direction, axes[1].direction)) < _SHORTEST_AXIS:
        raise element.error(f"a {kind} joint has two axes of different directions")
    damping = _ball_damping(scope, element, place) if kind == "ball" else 0.0
    return SdfJoint(f"{scope.name}{name}", kind, ends["parent"], ends["child"], place, axes, damping, element)


def _ball_damping(scope: Scope, element: Element, place: pin.SE3) -> float:
    """Damping of a ball joint: simulators take it from <axis>, whose direction has no meaning then."""
    given = element.first("axis")
    if given is None:
        return 0.0
    axis = _axis(scope, given, place, "ball")
    if not replace(axis, damping=0.0).is_bare:
        raise given.error("a ball joint has no limits, friction, spring or mimic: remove them")
    return axis.damping


def _axis(scope: Scope, element: Element, place: pin.SE3, kind: str) -> Axis:
    xyz = None if kind == "ball" else element.first("xyz")
    direction = np.array([0.0, 0.0, 1.0] if xyz is None or not xyz.text else numbers_of(xyz, xyz.text, 3))
    largest = float(np.abs(direction).max())
    if largest < _SHORTEST_AXIS:
        raise (xyz or element).error(f"expected a direction, got {direction.tolist()}")
    direction = direction / largest
    expressed = "" if xyz is None else xyz.attributes.get("expressed_in", "")
    parents = element.first("use_parent_model_frame")
    if parents is not None and parents.text and flag(parents):
        expressed = "__model__"
    if expressed:
        direction = place.rotation.T @ scope.pose(expressed, xyz or element).rotation @ direction
    limit, dynamics, mimic = (element.first(tag) for tag in ("limit", "dynamics", "mimic"))
    values: dict[str, float] = {}
    if limit is not None:
        values = {child.tag: _limit(child) for child in limit.children if child.text and child.tag in _LIMITS}
        lower, upper = values.get("lower", -np.inf), values.get("upper", np.inf)
        if lower > upper:
            raise limit.error(f"expected lower <= upper, got {lower:g} and {upper:g}")
        if kind == "continuous" and np.isfinite([lower, upper]).any():
            raise limit.error("a continuous joint has no limits: make it revolute, or leave them out")
        # Below zero means none.
        values |= {key: np.inf for key in ("effort", "velocity") if values.get(key, 0.0) < 0.0}
    if dynamics is not None:
        for tag in ("damping", "friction"):
            values[tag] = _one(dynamics, tag, 0.0)
            if values[tag] < 0.0:
                raise dynamics.error(f"expected a {tag} of zero or more, got {values[tag]:g}")
        values["stiffness"] = _one(dynamics, "spring_stiffness", 0.0)
        values["reference"] = _one(dynamics, "spring_reference", 0.0)
    return Axis(direction / np.linalg.norm(direction), **values, mimic=None if mimic is None else _mimic(scope, mimic))


def fixed_models(scope: Scope, links: Sequence[SdfLink]) -> Iterator[SdfJoint]:
    """Joints that fix the links of static models to the world."""
    static = scope.element.first("static")
    if static is not None and static.text and flag(static):
        for link in links:
            if link.name.startswith(scope.name):
                yield SdfJoint(f"{link.name}_static", "fixed", "world", link.name, link.place, (), 0.0, static)
        return
    for inner in scope.inner.values():
        yield from fixed_models(inner, links)


def is_closure(joint: SdfJoint) -> bool:
    """Whether a closure type allows just the joint's motion: two axes have to be at right angles."""
    return len(joint.axes) < 2 or abs(float(joint.axes[0].direction @ joint.axes[1].direction)) < _SQUARE


def closure_of(joint: SdfJoint, places: Mapping[str, pin.SE3]) -> Closure:
    """The closure that allows a joint's motion, with the poses of its links in the world where the joint is zero."""
    place: pin.SE3 = joint.place
    axis: tuple[float, ...] | None = None
    if len(joint.axes) == 2:
        # A universal closure turns about y of frame b, the parent's, and x of frame a, the child's.
        x, y = joint.axes[1].direction, joint.axes[0].direction
        place = place * pin.SE3(np.column_stack([x, y, np.cross(x, y)]), np.zeros(3))
    elif joint.axes:
        axis = tuple(joint.axes[0].direction.tolist())
    kind, parent = _CLOSURES.get(joint.kind, joint.kind), "universe" if joint.parent == "world" else joint.parent
    at_child, at_parent = (placement_of(places[end].actInv(place)) for end in (joint.child, joint.parent))
    return Closure(joint.name, kind, joint.child, parent, at_child, at_parent, axis)  # type: ignore[arg-type]


def _mimic(scope: Scope, element: Element) -> tuple[str, int, float, float, float]:
    around, leader = scope.resolved(element.attributes["joint"], element)
    if leader not in around.parts or around.parts[leader].tag != "joint":
        raise element.error(f"there is no joint {element.attributes['joint']!r}", "joint")
    axis = element.attributes.get("axis", "axis")
    if axis not in ("axis", "axis2"):
        raise element.error(f"expected axis or axis2, got {axis!r}", "axis")
    values = (_one(element, "multiplier", 1.0), _one(element, "offset", 0.0), _one(element, "reference", 0.0))
    return (f"{around.name}{leader}", ("axis", "axis2").index(axis), *values)


def _one(element: Element, tag: str, default: float) -> float:
    child = element.first(tag)
    return default if child is None or not child.text else numbers_of(child, child.text, 1)[0]


def _limit(element: Element) -> float:
    """A limit, which may be infinite: ``inf``, ``-inf``, or 1e16 and more."""
    words = {"inf": np.inf, "+inf": np.inf, "-inf": -np.inf}
    value = words.get(element.text.lower())
    if value is None:
        value = numbers_of(element, element.text, 1)[0]
    return float(np.copysign(np.inf, value)) if abs(value) >= _NO_LIMIT else float(value)
