"""Writing any chain as URDF, with its closures file beside it.

Damping, friction and limits of a joint go into the URDF, its spring and armature into the closures file. No limit is
written as the largest double, because URDF needs a number; reading it gives no limit again.

A ball joint on which all of a robot hangs is its root. Elsewhere a ball joint or translation of a device, which has an
arm among its roles, is a floating joint in the URDF, and the closures file says what it is: other programs see a link
that floats. Of any other robot it is refused.

A linear coupling is written twice: into the closures file, as every closure, and for other programs as ``<mimic>``, of
which a joint can have one. The reader knows the two as one.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin

from ....core.errors import InvalidInput
from ...structure.chain_state import ChainState
from ...structure.description import Closures, JointProperties, Root
from ..bodies import LINKS_AND_SITES, TreeBody, free_name, one_sided, tree_bodies, world_link
from ..joint_data import NO_LIMIT
from ..welded_links import welded_to_arm, without
from .urdf_document import Body, Document
from .urdf_mimic import linear

_ROOTS = {"ball": "spherical", "free": "free_flyer", "translation": "translation", "planar": "planar"}
#: What the closures file says of joints that are written as floating.
_FLOATING = {"ball": "spherical", "translation": "translation"}
_KINDS = {"hinge": "revolute", "slide": "prismatic"}


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
        limits = None if endless else np.clip(body.limits or (-np.inf, np.inf), -NO_LIMIT, NO_LIMIT)
        strength = (
            body.effort("URDF"),
            body.data.symmetric("velocity", body.joint, "URDF"),
            float(body.data.damping[0]),
            float(body.data.friction[0]),
        )
        parent = links[body.parent]
        mimic = mimics.get(body.joint)
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
        if frame.type not in LINKS_AND_SITES or frame.name in known:
            continue
        if frame.parentJoint not in links:
            continue
        name, carrier, place = frame.name, links[frame.parentJoint], frame.placement
        document.link(name, _body(welded[name]) if name in welded else None)
        weld = free_name(f"{name}_weld", joints)
        document.joint(weld, "fixed", carrier, name, place.translation, [1, 0, 0], rotation=place.rotation)
        known.add(name)
