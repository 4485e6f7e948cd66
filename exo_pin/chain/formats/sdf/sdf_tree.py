"""The Pinocchio model and the closures of an SDF's links and joints.

A closing joint that only allows a motion is a closure between its links. One with limits, dynamics or a mimic is a
joint of the tree with a body of its own that has no mass, fixed to the child link by a rigid closure.

Which joints of an SDF make the tree, and which close its loops.

Links that fixed joints join are one body. The other joints are taken into the tree one by one, as long as they close no
loop: first one that is asked for, then those with limits, dynamics or a mimic, because a closure has none of them, and
among these hinges and slides before universal and ball joints, in the order of the file. What remains closes the loops.
So a joint may be gone through from its child to its parent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import pinocchio as pin

from ....core.validation import as_choice
from ...structure.closures import Closure
from ...structure.description import JointProperties
from ...structure.frames import placement_of
from ...structure.motion_axes import unit_of
from ..bodies import add_frame, add_joint, axis_joint
from ..joint_data import put_data
from ..leaving_out import LeftOut
from ..urdf.urdf_loading import ROOT_MODELS
from .sdf_model import SdfJoint, SdfLink, closure_of, is_closure


@dataclass(frozen=True, eq=False)
class Graph:
    """Bodies, tree joints and closing joints.

    Attributes
    ----------
    body : dict of str to str
        Of every link, "world" included, the first link of its body.
    bases : list of str
        Bodies that no joint carries, the world first; each carries a tree.
    tree, closing : list of SdfJoint
        In the order of the file.
    """

    body: dict[str, str]
    bases: list[str]
    tree: list[SdfJoint]
    closing: list[SdfJoint]


def make_graph(links: Sequence[SdfLink], joints: Sequence[SdfJoint], first_joint: str | None, left: LeftOut) -> Graph:
    """Choose the tree.

    Raises
    ------
    UnknownName
        If no joint that moves has the name of the one that is asked for.
    """
    from scipy.cluster.hierarchy import DisjointSet  # takes long to import, and no other file format needs it

    names = ["world", *(link.name for link in links)]
    welds, reached = DisjointSet(names), DisjointSet(names)
    across = {frozenset((joint.parent, joint.child)) for joint in joints if joint.kind != "fixed"}
    moving = []
    for joint in joints:
        # A fixed joint beside one that moves the same two links holds it, as a closure does.
        if joint.kind != "fixed" or {joint.parent, joint.child} in across:
            moving.append(joint)
        elif not welds.merge(joint.parent, joint.child):
            left.say("rigid", f"{joint.element.place} fixes links that other joints fix already")
    first: dict[str, str] = {}
    body = {name: first.setdefault(welds[name], name) for name in names}
    for joint in [joint for joint in moving if body[joint.parent] == body[joint.child]]:
        left.say("rigid", f"{joint.element.place} joins two links that are one body, by fixed joints")
        moving.remove(joint)
    if first_joint is not None:
        as_choice("first joint of the tree", first_joint, [joint.name for joint in moving])
    order = sorted(moving, key=lambda joint: (joint.name != first_joint, *_rank(joint)))
    tree = [joint for joint in order if reached.merge(body[joint.parent], body[joint.child])]
    carried = {body[joint.child] for joint in tree}
    bases = ["world"]
    for link in links:
        own = body[link.name]
        if own == link.name and not any(reached.connected(base, own) for base in bases):
            members = [name for name in dict.fromkeys(body.values()) if reached.connected(name, own)]
            # A body that is no joint's child, as its maker thought of it: a tree has one joint less than bodies.
            bases.append(next(name for name in members if name not in carried))
    closing = [joint for joint in moving if joint not in tree]
    return Graph(body, bases, [joint for joint in moving if joint in tree], closing)


def _rank(joint: SdfJoint) -> tuple[bool, bool, bool, int]:
    """A ball joint has no axis."""
    return joint.kind == "fixed", joint.is_bare, not joint.axes, len(joint.axes)


@dataclass(eq=False)
class SdfTree:
    """A model under construction.

    Attributes
    ----------
    model : pinocchio.Model
        The tree.
    closures : list of Closure
        Its loops, couplings last.
    springs : list of JointProperties
        Springs of its joints.
    actuated : list of str
        Hinges and slides whose effort is not limited to zero.
    carriers : dict of str to (int, pinocchio.SE3)
        Of every body the joint that carries it, and that joint's pose in the world at zero.
    """

    model: pin.Model
    closures: list[Closure] = field(default_factory=list)
    springs: list[JointProperties] = field(default_factory=list)
    actuated: list[str] = field(default_factory=list)
    carriers: dict[str, tuple[int, pin.SE3]] = field(default_factory=dict)


def build_tree(name: str, links: list[SdfLink], graph: Graph, root_joint: str | None) -> SdfTree:
    """Build the model: bases on the world, each with its tree, depth first.

    Parameters
    ----------
    name : str
        Of the model.
    links : list of SdfLink
        In the order of the file.
    graph : Graph
        The tree.
    root_joint : str or None
        How bases hang on the world; free for None.
    """
    tree = SdfTree(pin.Model())
    tree.model.name = name
    more = [joint for joint in graph.closing if not (joint.is_bare and is_closure(joint))]
    hanging: dict[str, list[tuple[SdfJoint, bool]]] = {}
    for edge in graph.tree:
        hanging.setdefault(graph.body[edge.parent], []).append((edge, True))
        hanging.setdefault(graph.body[edge.child], []).append((edge, False))
    members: dict[str, list[SdfLink]] = {}
    for link in links:
        members.setdefault(graph.body[link.name], []).append(link)
    for base in graph.bases:
        if base == "world":
            tree.carriers[base] = (0, pin.SE3.Identity())
        else:
            _hang(tree, base, members[base][0], root_joint or "free_flyer", alone=len(graph.bases) == 2)
        waiting: list[tuple[str, SdfJoint | None, bool]] = [(base, None, True)]
        while waiting:
            body, joint, forward = waiting.pop()
            if joint is not None:
                source = graph.body[joint.parent if forward else joint.child]
                tree.carriers[body] = _add_joint(tree, joint, tree.carriers[source], forward)
            _add_links(tree, members.get(body, []), tree.carriers[body])
            for closing in more:
                if graph.body[closing.parent] == body:
                    # Its own body after it has no mass.
                    index, _ = _add_joint(tree, closing, tree.carriers[body], True)
                    add_frame(tree.model, f"{closing.name}_end", index, pin.SE3.Identity(), pin.FrameType.BODY)
            for other, ahead in reversed(hanging.get(body, [])):
                if other is not joint:
                    waiting.append((graph.body[other.child if ahead else other.parent], other, ahead))
    places = {link.name: link.place for link in links} | {"world": pin.SE3.Identity()}
    for loop in graph.closing:
        end = placement_of(places[loop.child].actInv(loop.place))
        tree.closures.append(
            Closure(f"{loop.name}_closure", "rigid", loop.child, f"{loop.name}_end", end)
            if loop in more
            else closure_of(loop, places)
        )
    _add_mimics(tree, [*graph.tree, *more])
    return tree


def _hang(tree: SdfTree, base: str, link: SdfLink, kind: str, alone: bool) -> None:
    """A base on the world; its joint is zero where the file puts it."""
    if kind == "fixed":
        tree.carriers[base] = (0, pin.SE3.Identity())
        return
    name = "root_joint" if alone else f"{base}_root_joint"
    index = add_joint(tree.model, 0, ROOT_MODELS[kind](), link.place, name)
    tree.carriers[base] = (index, link.place)


def _add_links(tree: SdfTree, links: list[SdfLink], carrier: tuple[int, pin.SE3]) -> None:
    index, place = carrier
    for link in links:
        local = place.actInv(link.place)
        tree.model.appendBodyToJoint(index, link.inertia, local)
        # Of links that are one body it says which has what, as a cuff on an arm.
        add_frame(tree.model, link.name, index, local, pin.FrameType.BODY).inertia = link.inertia


def _add_joint(tree: SdfTree, joint: SdfJoint, carrier: tuple[int, pin.SE3], forward: bool) -> tuple[int, pin.SE3]:
    """A joint on the body that it is gone through from; backwards its axes are turned round."""
    index, place = carrier
    local, model = place.actInv(joint.place), tree.model
    for name in axis_names(joint) or (joint.name,):
        if model.existJointName(name):
            raise joint.element.error(
                f"the chain has two joints {name!r}: rename this one (an axis is called after its joint, and what "
                "carries a free model root_joint)"
            )
    if joint.kind == "ball":
        index = add_joint(model, index, pin.JointModelSpherical(), local, joint.name)
        put_data(model, index, {"damping": joint.damping})
        return index, joint.place
    names = axis_names(joint)
    order = list(zip(names, joint.axes, strict=True))
    for name, axis in order if forward else reversed(order):
        direction = axis.direction if forward else -axis.direction
        moving = axis_joint(joint.kind == "prismatic", direction)
        index = add_joint(model, index, moving, local, name)
        own = {"damping": axis.damping, "friction": axis.friction, "speed": axis.velocity}
        own |= {"lower_effort": -axis.effort, "upper_effort": axis.effort}
        put_data(model, index, own | {"lower_position": axis.lower, "upper_position": axis.upper})
        local = pin.SE3.Identity()
        if axis.stiffness:
            tree.springs.append(JointProperties(name, axis.stiffness, (axis.reference,), unit=unit_of(model, index)))
        if len(names) == 1 and axis.effort > 0.0:
            tree.actuated.append(name)
    return index, joint.place


def axis_names(joint: SdfJoint) -> tuple[str, ...]:
    """The hinges and slides that a joint is made of: itself, one for each of two axes, none for a ball."""
    return ((), (joint.name,), (f"{joint.name}_axis", f"{joint.name}_axis2"))[len(joint.axes)]


def _add_mimics(tree: SdfTree, joints: list[SdfJoint]) -> None:
    """Couplings: position = multiplier (position of the other axis - reference) + offset."""
    named = {joint.name: joint for joint in joints}
    for joint in joints:
        for name, axis in zip(axis_names(joint), joint.axes, strict=True):
            if axis.mimic is None:
                continue
            leader, number, multiplier, offset, reference = axis.mimic
            if leader not in named or number >= len(named[leader].axes):
                raise joint.element.error(f"it mimics joint {leader!r}, which has no such axis in the tree")
            one = axis_names(named[leader])[number]
            if one == name:
                raise joint.element.error("a joint cannot mimic itself")
            tree.closures.append(
                Closure(
                    f"{name}_mimic", "coupling", one, name, polynomial=(offset, multiplier), references=(reference, 0.0)
                )
            )
