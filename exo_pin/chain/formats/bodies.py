"""The bodies of a chain, as every file format needs them.

Links that are welded to the arm's, which a file has to keep apart from it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ..structure.chain_state import ChainState
from ..structure.motion_axes import motion_axes
from .joint_data import FIELDS, JointData, joint_data, part_of, refuse_data

#: Frames of Pinocchio that are links and sites.
LINKS_AND_SITES = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
#: Joints by Pinocchio's name that are no single hinge or slide, under the names that are used here.
_COMPOUND = {
    "JointModelSpherical": "ball",
    "JointModelFreeFlyer": "free",
    "JointModelTranslation": "translation",
    "JointModelPlanar": "planar",
}

#: Of the mass of an arm with what is welded to it: an arm of less has no mass of its own.
_LEAST_SHARE = 1e-9


@dataclass(frozen=True, eq=False)
class TreeBody:
    """A moving body of the tree with the joint that carries it.

    Attributes
    ----------
    index, parent : int
        Joint indices in the model; 0 is the world.
    name, joint : str
        Of the body (its link) and of its joint.
    placement : pinocchio.SE3
        Of the joint in the parent's joint frame.
    kind : str
        "hinge", "slide", "ball", "free", "translation" or "planar".
    axis : ndarray or None
        Shape (3,), of a hinge or slide, in the joint's frame.
    inertia : pinocchio.Inertia
        In the joint's frame.
    data : JointData
        Damping, friction, armature, limits and spring of the joint.
    is_limb : bool
        Whether the joint is the slide of a limb, whose effort may be limited otherwise in one direction.
    """

    index: int
    parent: int
    name: str
    joint: str
    placement: pin.SE3
    kind: str
    axis: FloatArray | None
    inertia: pin.Inertia
    data: JointData
    is_limb: bool

    def refuse(self, file_format: str, what: Container[str] | None = None, but: Container[str] = ()) -> None:
        """Raise InvalidInput if the joint has data (of those in ``what``) that a format cannot hold."""
        refuse_data(file_format, self.joint, (x for x in self.data.present if (not what or x in what) and x not in but))

    def effort(self, file_format: str) -> float:
        """The one limit of effort that a format holds; of a limb the larger one, see :func:`one_sided`."""
        return self.data.symmetric("effort", self.joint, file_format, larger=self.is_limb)


def tree_bodies(chain: ChainState) -> list[TreeBody]:
    """The bodies in the model's order, parents first.

    Raises
    ------
    InvalidInput
        If a joint is of a kind that the formats do not have, or for what :func:`joint_data` refuses.
    """
    model, found = chain.model, []
    slides = {limb.slide for limb in chain.roles.limbs}
    axes, links, data = motion_axes(model), link_frames(model), joint_data(model, chain.description.joints)
    for index in range(1, model.njoints):
        joint, axis = model.joints[index], None
        kind = _COMPOUND.get(joint.shortname(), "")
        if not kind and model.nvs[index] == 1:
            linear, angular = axes[index][:3, 0], axes[index][3:, 0]
            if not (linear.any() and angular.any()):
                kind, axis = ("slide", linear) if linear.any() else ("hinge", angular)
        if not kind:
            raise InvalidInput(f"joint {model.names[index]!r} ({joint.shortname()}) cannot be written")
        called, inertia, link = model.names[index], model.inertias[index], links.get(index)
        name = called if link is None or not link.placement.isIdentity(1e-12) else link.name
        place, parent = model.jointPlacements[index], int(model.parents[index])
        more = data[index], called in slides
        found.append(TreeBody(index, parent, name, called, place, kind, axis, inertia, *more))
    return found


@dataclass(frozen=True, eq=False)
class JoinedBody:
    """A body with mass, and the hinges, slides or ball of the massless bodies between it and its parent.

    Attributes
    ----------
    body : TreeBody
        The body and its own joint, which comes last.
    parent : int
        Index of the next body towards the world that is written, 0 for the world.
    placement : pinocchio.SE3
        Of the body in that parent, with all its joints at zero.
    before : tuple of (TreeBody, pinocchio.SE3)
        The massless bodies, from the parent on, and the pose of the joint of each in the body's frame, with all joints
        at zero.
    """

    body: TreeBody
    parent: int
    placement: pin.SE3
    before: tuple[tuple[TreeBody, pin.SE3], ...]


def joined_bodies(bodies: list[TreeBody], held: Container[int]) -> list[JoinedBody]:
    """The bodies that have to be written where several hinges, slides and a ball may be on one, parents first.

    P_1 J_1 P_2 J_2 = (P_1 P_2) (P_2⁻¹ J_1 P_2) J_2: a joint before a body's own is one of the body itself, whose axis
    and position are those in the body's frame with all joints at zero.

    Parameters
    ----------
    bodies : list of TreeBody
        All of a tree, parents first.
    held : container of int
        Indices of bodies that have to be written, because a closure is on them.
    """
    children = Counter(body.parent for body in bodies)
    follower = {body.parent: body for body in bodies}
    massless = {
        body.index: body
        for body in bodies
        if _is_massless(body) and body.index not in held and children[body.index] == 1
        if _are_on_one_body(body, follower[body.index])
    }
    found = []
    for body in bodies:
        if body.index in massless:
            continue
        parent, placement, before = body.parent, body.placement, list[tuple[TreeBody, pin.SE3]]()
        while parent in massless:
            joint = massless[parent]
            before.insert(0, (joint, placement.inverse()))
            parent, placement = joint.parent, joint.placement * placement
        found.append(JoinedBody(body, parent, placement, tuple(before)))
    return found


def _are_on_one_body(joint: TreeBody, last: TreeBody) -> bool:
    """Whether the joint of a massless body and the next can be on one body.

    MuJoCo lets no hinge follow a ball, whose quaternion is in the body's own axes.
    """
    if joint.kind == "ball":
        return not _is_massless(last) and last.kind == "slide" and np.array_equal(last.placement.rotation, np.eye(3))
    return joint.axis is not None and (last.axis is not None or last.kind == "ball")


def link_frames(model: pin.Model) -> dict[int, pin.Frame]:
    """Of joints the link of their body: the first in the joint's frame, or else the first on the body."""
    links = [frame for frame in model.frames if frame.type == pin.FrameType.BODY and frame.parentJoint]
    found: dict[int, pin.Frame] = {}
    for frame in sorted(links, key=lambda frame: not frame.placement.isIdentity(1e-12)):
        found.setdefault(int(frame.parentJoint), frame)
    return found


def one_sided(bodies: list[TreeBody]) -> str:
    """A comment on limbs whose efforts are written wider than they are, by their joint; empty if there are none."""
    ranges = {body.joint: body.data.effort[0].tolist() for body in bodies if body.is_limb}
    wide = [f"{joint} {low:g} to {high:g} N" for joint, (low, high) in ranges.items() if low != -high]
    return f"Limits of effort are for both directions here, and really: {', '.join(wide)}." if wide else ""


def loose_ends(chain: ChainState, bodies: list[TreeBody]) -> dict[int, tuple[int, int]]:
    """Of massless bodies that carry nothing and are welded to another by a rigid closure: that closure, that body.

    Their joint closes a loop and has limits or dynamics, which a closure cannot have. A body on the world is none, and
    of two that are welded to each other the second is none.
    """
    joints, parents = chain.topology.joints.tolist(), {body.parent for body in bodies}
    found: dict[int, tuple[int, int]] = {}
    for body in bodies:
        on = [c for c, ends in enumerate(joints) if body.index in ends]
        if len(on) == 1 and _is_massless(body) and body.index not in parents and chain.closures[on[0]].type == "rigid":
            (other,) = {*joints[on[0]]} - {body.index}
            if other and other not in found:
                found[body.index] = (on[0], other)
    return found


def _is_massless(body: TreeBody) -> bool:
    return body.inertia.mass == 0.0 and not body.inertia.inertia.any()


def axis_joint(slides: bool, axis: FloatArray) -> pin.JointModel:
    """Pinocchio's slide along an axis of length 1, or hinge about it; there are special ones for x, y and z."""
    along = np.flatnonzero(axis == 1.0)
    if along.size and np.count_nonzero(axis) == 1:
        return getattr(pin, f"JointModel{'P' if slides else 'R'}{'XYZ'[int(along[0])]}")()
    return pin.JointModelPrismaticUnaligned(axis) if slides else pin.JointModelRevoluteUnaligned(axis)


def add_joint(model: pin.Model, parent: int, joint: pin.JointModel, place: pin.SE3, name: str) -> int:
    """Add a joint with its frame, and return its index."""
    index = int(model.addJoint(parent, joint, place, name))
    # Pinocchio finds the frame that it hangs on.
    model.addJointFrame(index, -1)
    return index


def add_frame(model: pin.Model, name: str, joint: int, place: pin.SE3, kind: pin.FrameType) -> pin.Frame:
    """Add a frame on the body of a joint, and return it."""
    above = model.getFrameId(model.names[joint], pin.FrameType.JOINT if joint else pin.FrameType.FIXED_JOINT)
    return model.frames[model.addFrame(pin.Frame(name, joint, above, place, kind), False)]


def free_name(base: str, taken: set[str], more: str = "_") -> str:
    """The name with ``more`` appended until it is not in ``taken``, to which it is added."""
    while base in taken:
        base += more
    taken.add(base)
    return base


def world_link(chain: ChainState) -> str:
    """A link in the world's frame, or a new name."""
    for frame in chain.model.frames:
        at_origin = frame.parentJoint == 0 and frame.placement.isIdentity(1e-12)
        if frame.type == pin.FrameType.BODY and at_origin and frame.name != "universe":
            return frame.name
    return "ground"


def copy_data(old: pin.Model, joint: int, new: pin.Model, to: int) -> None:
    """Give a joint the limits, damping, friction and armature of one of another tree."""
    for key in (key for keys in FIELDS.values() for key in keys):
        getattr(new, key)[part_of(new, to, key)] = getattr(old, key)[part_of(old, joint, key)]


def rebuilt(
    old: pin.Model,
    kinds: Mapping[int, Mapping[str, pin.JointModel]] | None = None,
    places: Mapping[int, pin.SE3] | None = None,
    joint_names: Mapping[str, str] | None = None,
    frame_names: Mapping[str, str] | None = None,
    without: Container[int] = (),
) -> pin.Model:
    """The tree with some joints of another kind, in another place, called otherwise or gone; the rest of it stays.

    Parameters
    ----------
    old : pinocchio.Model
        The tree.
    kinds : mapping, optional
        Of joints, by index: what they become, one joint after the other, by what is added to the name, without the data
        that the joint had. A joint that has become several is still a frame.
    places : mapping, optional
        Of joints, by index: their placements.
    joint_names, frame_names : mapping, optional
        New names by old ones, of joints, and of frames that are no joint's.
    without : container of int
        Joints that go with their bodies, which carry no other.

    Returns
    -------
    pinocchio.Model
        With the reference configurations where the coordinates are the same.
    """
    kinds, places, named, called = kinds or {}, places or {}, joint_names or {}, frame_names or {}
    new = pin.Model()
    new.name, new.gravity = old.name, old.gravity
    new.inertias[0] = old.inertias[0]
    now = {0: 0}
    for index in (i for i in range(1, old.njoints) if i not in without):
        name, carrier = old.names[index], now[old.parents[index]]
        place = places.get(index, old.jointPlacements[index])
        for more, kind in kinds.get(index, {"": old.joints[index]}).items():
            carrier, place = new.addJoint(carrier, kind, place, named.get(name, name) + more), pin.SE3.Identity()
            if more:
                new.addJointFrame(carrier, -1)
        now[index] = carrier
        new.inertias[carrier] = old.inertias[index]
    frames = {0: 0}
    for number, frame in enumerate(list(old.frames)[1:], 1):
        if frame.parentJoint not in now:
            continue
        kind = frame.type
        names, above = named if kind == pin.FrameType.JOINT else called, frames.get(frame.parentFrame, 0)
        if kind == pin.FrameType.JOINT and len(kinds.get(frame.parentJoint, ())) > 1:
            kind = pin.FrameType.OP_FRAME
        name = names.get(frame.name, frame.name)
        own = pin.Frame(name, now[frame.parentJoint], above, frame.placement, kind, frame.inertia)
        frames[number] = new.addFrame(own, False)
    for index in now.keys() - {0, *kinds}:
        copy_data(old, index, new, now[index])
    if not kinds and new.nq == old.nq:
        for item in old.referenceConfigurations:
            new.referenceConfigurations[item.key()] = item.data()
    return new


@dataclass(frozen=True, eq=False)
class WeldedLink:
    """A link that is welded to the arm's.

    Attributes
    ----------
    name : str
    on : int
        Index of the arm's joint.
    placement : pinocchio.SE3
        Of the link in that joint's frame.
    inertia : pinocchio.Inertia
        In the link's frame.
    """

    name: str
    on: int
    placement: pin.SE3
    inertia: pin.Inertia


def welded_to_arm(chain: ChainState) -> list[WeldedLink]:
    """Links with mass that are welded to the arm's: a device's, which stay on the next wearer.

    A file in which the arm's link had their mass would lose it with the wearer.
    """
    frames, arm = chain.model.frames, chain.roles.arm
    index = 0 if arm is None else int(frames[chain.frames[arm]].parentJoint)
    found = []
    for frame in frames if index else ():
        if frame.parentJoint == index and frame.type == pin.FrameType.BODY and frame.name != arm:
            # Pinocchio keeps the inertia of a link of a URDF in the frame of its weld.
            above = frames[frame.parentFrame]
            on_weld = frame.inertia.mass == 0.0 and above.type == pin.FrameType.FIXED_JOINT
            own = above.inertia if on_weld else frame.inertia
            if own.mass > 0.0:
                found.append(WeldedLink(frame.name, index, pin.SE3(frame.placement), pin.Inertia(own)))
    whole = chain.model.inertias[index].mass
    return found if whole - sum(part.inertia.mass for part in found) > _LEAST_SHARE * whole else []


def without(inertia: pin.Inertia, joint: int, welded: list[WeldedLink]) -> pin.Inertia:
    """Inertia of the body of a joint, in the joint's frame, without that of links that are welded to it."""
    for part in welded:
        inertia = inertia - part.placement.act(part.inertia) if part.on == joint else inertia
    return inertia


#: Moment of inertia, kg m², below which a body is a needle: MuJoCo reads none below 1e-15.
LEAST_MOMENT = 1e-12


def lawful_moments(moments: FloatArray) -> FloatArray:
    """The nearest principal moments of inertia that a body may have, ascending: none negative or above the others' sum.

    Parameters
    ----------
    moments : ndarray
        Shape (3,), ascending, kg m².
    """
    nearest = np.maximum(moments, 0.0)
    beyond = nearest[2] - nearest[1] - nearest[0]
    return nearest if beyond <= 0.0 else np.asarray(nearest + beyond / 3.0 * np.array([1.0, 1.0, -1.0]))
