"""Which joints of an SDF make the tree, and which close its loops.

Links that fixed joints join are one body. The other joints are taken into the tree one by one, as long as they close no
loop: first one that is asked for, then those with limits, dynamics or a mimic, because a closure has none of them, and
among these hinges and slides before universal and ball joints, in the order of the file. What remains closes the loops.
So a joint may be gone through from its child to its parent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ....core.validation import as_choice
from .sdf_model import SdfJoint, SdfLink


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


def make_graph(links: Sequence[SdfLink], joints: Sequence[SdfJoint], first_joint: str | None = None) -> Graph:
    """Choose the tree.

    Raises
    ------
    FileFormatError
        If fixed joints alone make a loop.
    UnknownName
        If no joint that moves has the name of the one that is asked for.
    """
    from scipy.cluster.hierarchy import DisjointSet  # takes long to import, and no other file format needs it

    names = ["world", *(link.name for link in links)]
    welds, reached = DisjointSet(names), DisjointSet(names)
    for joint in joints:
        if joint.kind == "fixed" and not welds.merge(joint.parent, joint.child):
            raise joint.element.error(
                f"links {joint.parent!r} and {joint.child!r} are fixed to each other already, by other fixed joints: "
                "remove one"
            )
    first: dict[str, str] = {}
    body = {name: first.setdefault(welds[name], name) for name in names}
    tree = []
    moving = [joint for joint in joints if joint.kind != "fixed"]
    if first_joint is not None:
        as_choice("first joint of the tree", first_joint, [joint.name for joint in moving])
    for joint in sorted(moving, key=lambda joint: (joint.name != first_joint, *_rank(joint))):
        if body[joint.parent] == body[joint.child]:
            raise joint.element.error(
                f"links {joint.parent!r} and {joint.child!r} are one rigid body, by fixed joints: it cannot move"
            )
        if reached.merge(body[joint.parent], body[joint.child]):
            tree.append(joint)
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


def _rank(joint: SdfJoint) -> tuple[bool, bool, int]:
    """A ball joint has no axis."""
    return joint.is_bare, not joint.axes, len(joint.axes)
