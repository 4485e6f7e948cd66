"""Writing any chain as URDF, with its closures file beside it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin

from ..errors import InvalidInput
from .bodies import tree_bodies, world_link
from .closures import Closures, Root
from .structure import Structure
from .xml import Body, Document

__all__ = ["urdf_text"]

_ROOTS = {"ball": "spherical", "free": "free_flyer", "translation": "translation", "planar": "planar"}
_KINDS = {"hinge": "revolute", "slide": "prismatic"}


def urdf_text(chain: Structure) -> tuple[str, Closures]:
    """The XML of a chain, and what goes into its closures file.

    Links that are welded together in the model come out with their masses in the first of them.

    Raises
    ------
    InvalidInput
        If a joint is of a kind that URDF does not have, as a ball joint anywhere but alone under the root.
    """
    model, given = chain.model, chain.description
    bodies = tree_bodies(chain)
    document = Document(given.name, ["Written by exo_pin; load it with its closures file."])
    first = [body for body in bodies if body.parent == 0]
    alone = len(first) == 1 and first[0].kind in _ROOTS and first[0].placement.isIdentity(1e-12)
    hung = first[0] if alone else None
    gravity = tuple(np.asarray(model.gravity.linear).tolist())
    links, root = {body.index: body.name for body in bodies}, Root(gravity=gravity)
    if hung is not None:
        root = Root(_ROOTS[hung.kind], hung.joint, gravity)
    else:
        links[0] = world_link(chain)
        document.link(links[0], None)
    for body in bodies:
        inertia = body.inertia
        held = None if inertia.mass <= 0.0 else Body(inertia.mass, np.array(inertia.lever), np.array(inertia.inertia))
        document.link(body.name, held)
        if body is hung:
            continue
        place = body.placement.translation, body.placement.rotation
        if body.kind == "free" and body.parent == 0:
            document.joint(body.joint, "floating", links[0], body.name, place[0], [1, 0, 0], rotation=place[1])
            continue
        if body.axis is None:
            raise InvalidInput(f"URDF has no joint for {body.joint!r}, which is {body.kind}")
        endless = body.kind == "hinge" and model.nqs[body.index] == 2
        kind = "continuous" if endless else _KINDS[body.kind]
        limits = None if endless else body.limits or (-1e9, 1e9)
        parent = links[body.parent]
        document.joint(body.joint, kind, parent, body.name, place[0], body.axis, limits, rotation=place[1])
    _more_frames(chain, document, links)
    return document.text(), dataclasses.replace(given, root=root)


def _more_frames(chain: Structure, document: Document, links: dict[int, str]) -> None:
    """Links without a joint of their own, as welded ones, so that closures and roles still find them."""
    known = set(links.values())
    for frame in chain.model.frames:
        if frame.type not in (pin.FrameType.BODY, pin.FrameType.OP_FRAME) or frame.name in known:
            continue
        if frame.parentJoint not in links or frame.name == "universe":
            continue
        place = frame.placement
        document.link(frame.name, None)
        document.joint(
            f"{frame.name}_weld",
            "fixed",
            links[frame.parentJoint],
            frame.name,
            place.translation,
            [1, 0, 0],
            rotation=place.rotation,
        )
        known.add(frame.name)
