"""Links that are welded to the arm's, which a file has to keep apart from it."""

from __future__ import annotations

from dataclasses import dataclass

import pinocchio as pin

from ..structure.chain_state import ChainState

#: Of the mass of an arm with what is welded to it: an arm of less has no mass of its own.
_LEAST_SHARE = 1e-9


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
