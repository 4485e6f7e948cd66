"""Writing a chain as SDF: every closure is one more joint, a linear coupling a <mimic> of joint b.

SDF holds poses of links, not positions of joints: all joints are zero in the file's configuration, which is closed.
Root joints: a free robot is not joined to the world, a ball root is a ball joint on it. A massless body between two
hinges that meet at right angles is the cross of a universal joint, ``<axis>`` and ``<axis2>``. A massless body at the
end of a joint, which a rigid closure welds to another link, is that link: the joint closes the loop itself. Any other
massless body is a link of zero mass, which a comment names, because engines may need some.

A hinge or slide has its damping, friction and spring, and its limits of position, effort and velocity. A joint
without a limit of effort that is not among the actuated ones gets a limit of zero, so that it is passive. SDF has no
armature, and no data of a ball joint. A model has no gravity of its own: that of the world counts, and another one than
the default stands in a comment. Names that SDF does not allow are replaced.

The elements of an SDF that is written: links, joints of the tree, joints that close loops, frames.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ....core.conventions import GRAVITY
from ....core.errors import InvalidInput
from ....core.records import OneProcess
from ....core.validation import FloatArray
from ...structure.chain_state import ChainState
from ...structure.closures import Closure
from ..bodies import (
    LINKS_AND_SITES,
    TreeBody,
    free_name,
    joined_bodies,
    link_frames,
    loose_ends,
    one_sided,
    tree_bodies,
    welded_to_arm,
    without,
)
from ..shapes import shapes_of_bodies, write_sdf_shape
from ..urdf.urdf_values import linear
from ..xml_elements import MOMENTS, as_numbers
from .sdf_frames import RESERVED

#: Data of a hinge or slide that SDF has a place for.
_HELD = ("damping", "friction", "spring", "effort limits", "velocity limits", "position limits")
#: Joints of closures by the rules of their types.
FORMS = {
    ("xyz", "xyz"): "fixed",
    ("xyz", ""): "ball",
    ("xyz", "xy"): "revolute",
    ("xyz", "cross"): "universal",
    ("xy", "xyz"): "prismatic",
    ("", "joints"): "mimic",
}
_TREE = {"hinge": "revolute", "slide": "prismatic", "ball": "ball"}


_VERSION, _VERSION_WITH_MIMICS = "1.9", "1.11"
#: Cosine of the angle of hinges, and their distance in m, up to which they make a universal joint.
_MEETING = 1e-9


class SdfWriter(OneProcess):
    """Writer of the ``<model>`` of a file.

    Attributes
    ----------
    model : Element
        The ``<model>``.
    """

    def __init__(self, chain: ChainState, q: FloatArray, bodies: list[TreeBody]) -> None:
        self.model = ET.Element("model", name=chain.description.name)
        self._chain, self._q, self._data = chain, q, chain.model.createData()
        pin.forwardKinematics(chain.model, self._data, q)
        # SDF's links and joints share one space of names.
        self._taken, named, self._links, self._local = set(RESERVED), link_frames(chain.model), {0: "world"}, {}
        self._local[0] = pin.SE3.Identity()
        for body in bodies:
            frame = named.get(body.index)
            self._links[body.index] = self._free_name(body.name if frame is None else frame.name, "_link")
            # The link's frame in its joint's.
            self._local[body.index] = pin.SE3.Identity() if frame is None else frame.placement
        self._axes: dict[str, tuple[str, str]] = {}
        self._ground, self._welded, self._shapes = "", welded_to_arm(chain), shapes_of_bodies(chain)

    def _free_name(self, name: str, more: str) -> str:
        """The name, or one like it: "::" is for parts of nested models, and two underscores in front are reserved."""
        return free_name(name.replace("::", "_").lstrip("_" if name.startswith("__") else "") or "_", self._taken, more)

    def link(self, body: TreeBody) -> None:
        """Add a body, and what is welded to it."""
        self._add_link(body.index, without(body.inertia, body.index, self._welded))
        for part in (part for part in self._welded if part.on == body.index):
            link = ET.SubElement(self.model, "link", name=self._free_name(part.name, "_link"))
            _pose(link, self._data.oMi[part.on] * part.placement)
            _add_inertial(link, part.inertia)
            self._joint(self._free_name(f"{part.name}_weld", "_"), "fixed", self._links[part.on], str(link.get("name")))

    def ground(self) -> None:
        """Add a link that is fixed to the world, if the world has mass or shapes."""
        own, frames = self._chain.model.inertias[0], self._chain.model.frames
        if own.mass > 0.0 or 0 in self._shapes:
            link = next(
                (frame for frame in frames if frame.parentJoint == 0 and frame.type == pin.FrameType.BODY), None
            )
            self._ground = self._free_name("ground" if link is None else link.name, "_link")
            if link is not None:
                self._local[0] = link.placement
            self._add_link(0, own)
            self._joint(self._free_name("ground_weld", "_"), "fixed", "world", self._ground)

    def _joint(self, name: str, kind: str, parent: str, child: str, place: pin.SE3 | None = None) -> ET.Element:
        """Add a joint between two links; its place is in the child's frame."""
        element = ET.SubElement(self.model, "joint", name=name, type=kind)
        if place is not None:
            _pose(element, place)
        ET.SubElement(element, "parent").text = parent
        ET.SubElement(element, "child").text = child
        return element

    def _add_link(self, index: int, inertia: pin.Inertia) -> None:
        name, local = self._links[index] if index else self._ground, self._local[index]
        link = ET.SubElement(self.model, "link", name=name)
        _pose(link, self._data.oMi[index] * local)
        if index or inertia.mass > 0.0:
            _add_inertial(link, local.actInv(inertia))
        for number, shape in self._shapes.get(index, ()):
            write_sdf_shape(link, shape.moved(local.inverse()), number)

    def tree_joint(self, body: TreeBody, cross: TreeBody | None, welded: int | None = None) -> None:
        """Add a joint of the tree, a universal one where the body hangs on a cross, to a body or the one it is."""
        if body.kind == "free" and body.parent == 0:
            body.refuse("SDF")
            return
        if body.kind not in _TREE:
            raise InvalidInput(f"SDF has no joint for {body.joint!r}, which is {body.kind}")
        parent, child = body.parent if cross is None else cross.parent, body.index if welded is None else welded
        hinges, name = [body] if cross is None else [cross, body], body.joint
        backwards, common = False, body.joint.rpartition("_axis")[0]
        if cross is not None and {body.joint, cross.joint} == {f"{common}_axis", f"{common}_axis2"}:
            name = common
            if body.joint == f"{common}_axis" and parent:
                # A joint that the tree goes through from its child to its parent.
                parent, child, backwards, hinges = child, parent, True, [body, cross]
        name = self._free_name(name, "_joint")
        kind, point = "universal" if cross is not None else _TREE[body.kind], np.zeros(3)
        if cross is not None:
            assert body.axis is not None
            # The hinges meet on the body's own axis.
            apart = self._data.oMi[body.index].actInv(self._data.oMi[cross.index]).translation
            point = body.axis * float(apart @ body.axis)
        place = self._data.oMi[body.index] * pin.SE3(np.eye(3), point)
        here = (self._data.oMi[child] * self._local[child]).actInv(place)
        at = None if here.isIdentity(0.0) else here
        element = self._joint(name, kind, self._links[parent], self._links[child], at)
        for tag, hinge in zip(("axis", "axis2"), hinges, strict=False):
            hinge.refuse("SDF", but=() if hinge.axis is None else _HELD)
            if hinge.axis is not None:
                turned = place.rotation.T @ self._data.oMi[hinge.index].rotation @ hinge.axis
                direction = hinge.axis if hinge is body else turned
                self._add_axis(element, name, tag, hinge, -direction if backwards else direction)

    def _add_axis(self, element: ET.Element, name: str, tag: str, body: TreeBody, direction: FloatArray) -> None:
        """Add the axis of a hinge or slide, its limits, damping, friction and spring; zero of the file is here."""
        self._axes[body.joint] = name, tag
        own, data = self._q[self._chain.configuration_slice(body.joint)], body.data
        here = float(np.arctan2(own[1], own[0])) if len(own) == 2 else float(own[0])
        axis = ET.SubElement(element, tag)
        limits = dict(zip(("lower", "upper"), data.ends(0) - here, strict=True))
        effort = body.effort("SDF")
        limits["effort"] = effort if np.isfinite(effort) or body.joint in self._chain.roles.actuated else 0.0
        limits["velocity"] = data.symmetric("velocity", body.joint, "SDF")
        _add_numbers(axis, {"xyz": direction})
        _add_numbers(ET.SubElement(axis, "limit"), {key: value for key, value in limits.items() if np.isfinite(value)})
        values = {"damping": float(data.damping[0]), "friction": float(data.friction[0])}
        if data.stiffness != 0.0:
            values |= {"spring_reference": data.rest(0) - here, "spring_stiffness": data.stiffness}
        if any(values.values()):
            _add_numbers(ET.SubElement(axis, "dynamics"), values)

    def add_frames(self) -> None:
        """Add the frames of links and sites that are no link here."""
        welded = {part.name for part in self._welded}
        for frame in self._chain.model.frames:
            carrier = int(frame.parentJoint)
            link = self._links.get(carrier, frame.name) if carrier else self._ground or frame.name
            if frame.type in LINKS_AND_SITES and frame.name not in {link, "universe", *welded}:
                name = self._free_name(frame.name, "_frame")
                element = ET.SubElement(self.model, "frame", name=name, attached_to=link)
                _pose(element, self._local[carrier].actInv(frame.placement))

    def add_mimics(self, mimics: dict[str, tuple[str, float]]) -> None:
        """Add couplings, in the axes of their joints b."""
        joints = {element.get("name"): element for element in self.model.findall("joint")}
        for follower, (leader, multiplier) in mimics.items():
            name, tag = self._axes[follower]
            axis = joints[name].find(tag)
            assert axis is not None
            joint, tag = self._axes[leader]
            mimic = ET.SubElement(axis, "mimic", joint=joint, axis=tag)
            _add_numbers(mimic, {"multiplier": multiplier, "offset": 0.0, "reference": 0.0})

    def closing_joint(self, c: int, closure: Closure) -> None:
        """Add a closure as a joint."""
        form = closure.form_in(FORMS, "SDF has no joint")
        ends = [self._links[joint] for joint in self._chain.topology.joints[c].tolist()]
        name = self._free_name(closure.name, "_closure")
        # A joint's frame is on its child, and the world cannot be a child.
        child = 1 if ends[0] == "world" else 0
        carrier = int(self._chain.topology.joints[c, child])
        place = self._local[carrier].actInv(self._chain.topology.frame(c, child))
        element = self._joint(name, form, ends[1 - child], ends[child], place)
        if form in ("revolute", "prismatic"):
            _axis(element, "axis", np.array([0.0, 0.0, 1.0]))
        if form == "universal":
            self._universal(element, c, child)

    def _universal(self, element: ET.Element, c: int, child: int) -> None:
        """First the axis on the parent, then the one on the child, both in the joint's frame, which is the child's."""
        topology = self._chain.topology
        joints = topology.joints[c].tolist()
        ends = [self._data.oMi[joints[end]].rotation @ topology.frame(c, end).rotation for end in (0, 1)]
        # Frame a turns about its x, frame b about its y.
        axes = [ends[0][:, 0], ends[1][:, 1]]
        for name, end in (("axis", 1 - child), ("axis2", child)):
            _axis(element, name, ends[child].T @ axes[end])


def _axis(element: ET.Element, name: str, direction: FloatArray) -> None:
    axis = ET.SubElement(element, name)
    _add_numbers(axis, {"xyz": direction})
    # Passive until a simulator drives it.
    ET.SubElement(ET.SubElement(axis, "limit"), "effort").text = "0"


def _add_inertial(link: ET.Element, own: pin.Inertia) -> None:
    """Add mass properties, given in the link's frame."""
    inertial, tensor = ET.SubElement(link, "inertial"), own.inertia
    _pose(inertial, pin.SE3(np.eye(3), own.lever))
    _add_numbers(inertial, {"mass": own.mass})
    _add_numbers(ET.SubElement(inertial, "inertia"), {key: tensor[entry] for key, entry in MOMENTS.items()})


def _pose(element: ET.Element, place: pin.SE3) -> None:
    numbers = [*place.translation, *pin.Quaternion(place.rotation).normalized().coeffs()]
    ET.SubElement(element, "pose", rotation_format="quat_xyzw").text = as_numbers(numbers)


def _add_numbers(element: ET.Element, values: Mapping[str, ArrayLike]) -> None:
    """Children that hold numbers."""
    for tag, value in values.items():
        ET.SubElement(element, tag).text = as_numbers(value)


def sdf_text(chain: ChainState, q: FloatArray) -> str:
    """The XML of a chain at a closed configuration.

    Parameters
    ----------
    chain : ChainState
        The chain.
    q : ndarray
        Shape (nq,), closed: the poses of the links in the file, where joints are zero.

    Raises
    ------
    InvalidInput
        If a joint or closure is of a kind that SDF does not have (cylindrical, distance, a
        coupling that is not linear, or a second one of the same joint b), or a joint has data that SDF cannot hold.
    """
    bodies = tree_bodies(chain)
    crosses = _crosses(bodies, set(chain.topology.joints.ravel().tolist()))
    ends = loose_ends(chain, bodies)
    links = [body for body in bodies if body.index not in {*(cross.index for cross in crosses.values()), *ends}]
    mimics, closing = _mimics(chain), {c: bodies[index - 1] for index, (c, _) in ends.items()}
    writer = SdfWriter(chain, q, links)
    writer.ground()
    for body in links:
        writer.link(body)
    for body in links:
        writer.tree_joint(body, crosses.get(body.index))
    for c, closure in enumerate(chain.closures):
        form = closure.form_in(FORMS, "SDF has no joint")
        if c in closing:
            end = closing[c]
            writer.tree_joint(end, crosses.get(end.index), ends[end.index][1])
        elif form != "mimic":
            writer.closing_joint(c, closure)
    writer.add_mimics(mimics)
    writer.add_frames()
    root = ET.Element("sdf", version=_VERSION_WITH_MIMICS if mimics else _VERSION)
    root.append(writer.model)
    ET.indent(root)
    notes = ["Written by exo_pin. Joints read zero where the loops are closed."]
    gravity = np.asarray(chain.model.gravity.linear)
    if not np.array_equal(gravity, GRAVITY):
        notes.append(f"The chain's gravity: {as_numbers(gravity)} m/s².")
    if wider := one_sided(bodies):
        notes.append(wider)
    light = [body.name for body in links if body.inertia.mass == 0.0]
    if light:
        notes.append(f"Links of zero mass, of which some engines need a little: {', '.join(light)}.")
    note = f"<!-- {' '.join(notes)} -->"
    return "\n".join(['<?xml version="1.0"?>', note, ET.tostring(root, encoding="unicode"), ""])


def _mimics(chain: ChainState) -> dict[str, tuple[str, float]]:
    """Of joints b of couplings joint a and the multiplier; positions count from the closed configuration."""
    found: dict[str, tuple[str, float]] = {}
    for closure in chain.closures:
        if closure.kind.is_coupling:
            numbers = linear(closure)
            if numbers is None or closure.frame_b in found:
                raise InvalidInput(
                    f"SDF has no joint for the coupling closure {closure.name!r}: expected a linear coupling of two "
                    "joints, one for each joint b"
                )
            found[closure.frame_b] = (closure.frame_a, numbers[1])
    return found


def _crosses(bodies: list[TreeBody], held: set[int]) -> dict[int, TreeBody]:
    """Of bodies that hang on a universal joint its cross, a massless body between hinges that meet at right angles."""
    found = {}
    for each in joined_bodies(bodies, held):
        if len(each.before) == 1 and each.body.kind == each.before[0][0].kind == "hinge":
            cross, place = each.before[0]
            assert cross.axis is not None
            assert each.body.axis is not None
            first, second = place.rotation @ cross.axis, each.body.axis
            apart = float(place.translation @ np.cross(first, second))
            if abs(first @ second) < _MEETING and abs(apart) < _MEETING:
                found[each.body.index] = cross
    return found
