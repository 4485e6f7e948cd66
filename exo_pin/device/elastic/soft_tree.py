"""The tree of a device that gives way: one more joint under each part that does.

The part of the device that is fixed to the arm hangs on the arm by a free flight with the cuff's spring; a link that
gives way hangs on its own joint by one. What is fixed to the torso stands on it by one with the harness's spring, and
this on a translation: it moves by minus the displacement of the shoulder's centre, so that the centre itself rests.
Where cuff or shoulder is rigid its joint is held; an offset of the device's centre is a position of these two.

The trees of a device that gives way; see :mod:`exo_pin.device.elastic.soft_equations`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

from ...chain.formats.bodies import copy_data
from ...chain.structure.chain_state import ChainState
from ...chain.structure.closures import Closure, Placement
from ...chain.structure.motion_axes import q_slice
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, set_fields
from ...design import Interfaces, Shoulder
from ...design.shoulder import nothing_gives_way
from ..chain_device import ChainDevice
from ..chain_roles import soft_bodies
from ..device_model import DeviceModel, device_model
from ..parts.drives import Drive, Spring
from ..parts.routes import Route, RoutePoint
from .springs import (
    CUFF,
    HARNESS,
    OF_LINK,
    SHOULDER,
    GuidedLimb,
    PlacedGuide,
    PlacedSpring,
    gives_way,
    guided_limbs,
    placed_springs,
    straight,
)  # fmt: skip


class SoftTree:
    """The tree of a device with a joint for each part that may give way, and what stands on it.

    Parameters
    ----------
    device : ChainDevice
        The device.
    ends : tuple of str
        Which of shoulder, harness and cuff are among these parts.
    """

    def __init__(self, device: ChainDevice, ends: tuple[str, ...] = (SHOULDER, HARNESS, CUFF)) -> None:
        self.given: ChainState = device.chain._state
        self.arm, self.model, self._ends = device.arm_index, pin.Model(), ends
        old = self.given.model
        self.model.name, self.model.gravity = old.name, old.gravity
        self._links, self.limbs = soft_bodies(device), guided_limbs(device)
        #: Of every joint of the given tree: its own in the new one; and the joint that carries what the device has on
        #: its body, with the place of the body's axes in that joint's.
        self.joint, self.carrier = {0: 0}, {0: (0, pin.SE3.Identity())}
        # In the shoulder's centre, from which the points of springs are counted.
        centre = pin.SE3(np.eye(3), old.jointPlacements[self.arm].translation)
        last, place = 0, centre
        if SHOULDER in ends:
            last, place = self._add(SHOULDER, pin.JointModelTranslation(), last, place), pin.SE3.Identity()
        if HARNESS in ends and device.interfaces.harness is not None:
            last = self._add(HARNESS, pin.JointModelFreeFlyer(), last, place)
        if last:
            self.carrier[0] = last, centre.inverse()
        cuff = pin.JointModelTranslation() if device.interfaces.cuff is None else pin.JointModelFreeFlyer()
        # Depth first: what stands on the torso before the arm, wherever they are in the given tree.
        for joint in sorted(range(1, old.njoints), key=lambda joint: self.arm in list(old.supports[joint])):
            self._grow(joint, cuff)
        for frame in list(old.frames)[1:]:
            self.model.addFrame(self._moved(frame), False)

    def _add(self, name: str, kind: pin.JointModel, parent: int, place: pin.SE3 | None = None) -> int:
        added = int(self.model.addJoint(parent, kind, pin.SE3.Identity() if place is None else place, name))
        self.model.inertias[added], own = pin.Inertia.Zero(), q_slice(self.model, added)
        self.model.lowerPositionLimit[own], self.model.upperPositionLimit[own] = -np.inf, np.inf
        self.model.addFrame(pin.Frame(name, added, 0, pin.SE3.Identity(), pin.FrameType.BODY), False)
        return added

    def _grow(self, joint: int, cuff: pin.JointModel) -> None:
        """Add a joint of the given tree, and one under it where its body gives way."""
        old, new = self.given.model, self.model
        under, shift = (0, pin.SE3.Identity()) if joint == self.arm else self.carrier[old.parents[joint]]
        limb = self.limbs.get(joint)
        if limb is not None and limb.part.resists:
            place = shift * old.jointPlacements[joint]
            bent = self._add(limb.joint, pin.JointModelFreeFlyer(), under, place)
            new.inertias[bent] = old.inertias[joint]
            self.joint[joint], self.carrier[joint] = bent, (bent, pin.SE3.Identity())
            return
        own = int(new.addJoint(under, old.joints[joint], shift * old.jointPlacements[joint], old.names[joint]))
        new.inertias[own] = old.inertias[joint]
        self.joint[joint], self.carrier[joint] = own, (own, pin.SE3.Identity())
        copy_data(old, joint, new, own)
        if joint == self.arm and CUFF in self._ends:
            self.carrier[joint] = self._add(CUFF, cuff, own), pin.SE3.Identity()
        elif limb is not None:
            spin = self._add(limb.joint, pin.JointModelRevoluteUnaligned(limb.along), own)
            new.inertias[spin], new.inertias[own] = old.inertias[joint], pin.Inertia.Zero()
            self.carrier[joint] = spin, pin.SE3.Identity()
        elif joint in self._links:
            link = old.frames[self.given.frame_index(self._links[joint])]
            soft = self._add(self._links[joint] + OF_LINK, pin.JointModelFreeFlyer(), own, link.placement)
            back = link.placement.inverse()
            new.inertias[soft], new.inertias[own] = back.act(old.inertias[joint]), pin.Inertia.Zero()
            self.carrier[joint] = soft, back

    def _moved(self, frame: pin.Frame) -> pin.Frame:
        """A frame of the given tree in the new one: those of arm and torso stay on them."""
        joint, moved = frame.parentJoint, pin.Frame(frame)
        moved.parentJoint, moved.parentFrame = self.joint[joint], 0
        if joint not in (0, self.arm):
            moved.parentJoint, shift = self.carrier[joint]
            moved.placement = shift * frame.placement
        return moved

    def _end(self, name: str) -> tuple[str, pin.SE3] | None:
        """Where what the device has on a frame of arm or torso hangs: a frame, and its place; None of other frames."""
        frame = self.given.model.frames[self.given.frame_index(name)]
        if frame.parentJoint not in (0, self.arm):
            return None
        carrier, shift = self.carrier[frame.parentJoint]
        if carrier == self.joint[frame.parentJoint]:
            return None
        return str(self.model.names[carrier]), shift * frame.placement

    def closure(self, closure: Closure) -> Closure:
        """A closure with its ends on what gives way."""
        changes: dict[str, Any] = {}
        for end in ("a", "b") if closure.polynomial is None else ():
            there = self._end(getattr(closure, f"frame_{end}"))
            if there is not None:
                own: Placement = getattr(closure, f"placement_{end}")
                place = there[1] * pin.XYZQUATToSE3([*own.translation, *own.quaternion])
                x, y, z, *quaternion = pin.SE3ToXYZQUAT(place).tolist()
                turn = pin.Quaternion(*quaternion[3:], *quaternion[:3]).normalized().coeffs().tolist()
                changes[f"frame_{end}"], changes[f"placement_{end}"] = there[0], Placement((x, y, z), tuple(turn))
        return replace(closure, **changes)

    def part(self, part: Drive | Spring) -> Any:
        """A drive or spring with the ends of its route on what gives way."""
        if part.route is None:
            limb = next((limb for limb in self.limbs.values() if limb.part.slide == part.joint), None)
            return part if limb is None or not limb.part.resists else self._beside(part, limb)
        return replace(part, route=Route(tuple(self._point(point) for point in part.route.points)))

    def _beside(self, drive: Drive | Spring, limb: GuidedLimb) -> Drive | Spring:
        """A slide's drive along the line of its limb's joints, beside the guide."""
        joint = self.given.joint_index(limb.part.slide)
        carrier, shift = self.carrier[self.given.model.parents[joint]]
        near = shift * self.given.model.jointPlacements[joint] * limb.near
        ends = (str(self.model.names[carrier]), near), (limb.joint, limb.far)
        own = replace(drive)
        # It stays a limb's, which may push, with the same coordinate.
        set_fields(
            own, joint=None, route=Route.over(*ends), zero_length=getattr(drive, "zero_length", 0.0) - limb.length
        )
        return own

    def _point(self, point: RoutePoint) -> RoutePoint:
        there = self._end(point.link)
        return point if there is None else RoutePoint(there[0], tuple(there[1].act(np.array(point.point)).tolist()))


@lru_cache(maxsize=32)
def twisting_device(device: ChainDevice) -> Any:
    """The device whose guided limbs let their two halves turn against each other, and that gives way nowhere else.

    Off its centre limbs with two universal joints close no other way. As of a wrist, their side forces then are unknown
    forces g: the moments with which guides of any stiffness resist.
    """
    slides = tuple(replace(part, guide=None) for part in device.guided_slides)
    bare = device.replace(guided_slides=slides, soft_links=(), interfaces=Interfaces(), shoulder=Shoulder())
    found = _on_tree(bare, SoftTree(bare, ends=()))
    vars(found)["twists"] = tuple(limb.joint for limb in guided_limbs(bare).values())
    return found


def padded_device(device: ChainDevice, ends: tuple[str, ...]) -> tuple[DeviceModel, list[PlacedSpring | PlacedGuide]]:
    """Trees of a device whose cuff and harness give way, and nothing else, and their springs in them.

    Parameters
    ----------
    device : ChainDevice
    ends : tuple of str
        Names of the joints of those that give way; their stiffness is that of the device.

    Raises
    ------
    InvalidInput
        If a limb's guide resists across it: its ends could not follow without bending.
    """
    stiff = [part.slide for part in device.guided_slides if part.resists]
    if stiff:
        raise InvalidInput(f"expected limbs without guides on a cuff that gives way, got one of {stiff[0]!r}")
    own = device.interfaces
    held = Interfaces(own.harness if HARNESS in ends else None, own.cuff if CUFF in ends else None, own.cuff_area)
    bare = device.replace(soft_links=(), shoulder=replace(device.shoulder, stiffness=None), interfaces=held)
    found = _on_tree(bare, SoftTree(bare, ends))
    model = DeviceModel(found, soft_joints=ends)
    return model, placed_springs(bare, model)


def _on_tree(device: ChainDevice, tree: SoftTree) -> Any:
    """The device with the joints of a tree."""
    described = device.chain.description
    closures = tuple(tree.closure(closure) for closure in tree.given.closures)
    slides = {limb.part.slide for limb in tree.limbs.values() if limb.part.resists}
    roles = described.roles
    if slides:
        roles = replace(roles, actuated=tuple(name for name in roles.actuated if name not in slides), limbs=())
    chain = type(device.chain)(tree.model, replace(described, closures=closures, roles=roles))
    parts = {key: tuple(tree.part(part) for part in getattr(device, key)) for key in ("drives", "springs")}
    return device.replace(chain=chain, soft_links=(), guided_slides=(), **parts)


class SoftModel:
    """The trees of a device that gives way.

    Parameters
    ----------
    device : ChainDevice
        The device.
    """

    def __init__(self, device: ChainDevice) -> None:
        self.device, self.rigid = device, device_model(device)
        if not gives_way(device):
            raise nothing_gives_way(device.name)
        self.soft = _on_tree(device, SoftTree(device))
        rigid = (SHOULDER,) * (device.shoulder.stiffness is None) + (CUFF,) * (device.interfaces.cuff is None)
        limbs = guided_limbs(device)
        free = [limb.joint for limb in limbs.values() if not limb.part.resists]
        added = sorted(set(self.soft.chain.model.names) - set(device.chain.model.names) - {*rigid, *free})
        self._guides = {limb.part.slide: limb.joint for limb in limbs.values() if limb.part.resists}
        self.model = DeviceModel(self.soft, held_joints=rigid, soft_joints=tuple(added))
        self.springs = placed_springs(device, self.model)
        held = self.model.held
        self.base, self.cuff = (held.configuration_slice(name) for name in (SHOULDER, CUFF))

    def start(self, q: FloatArray, quaternion: FloatArray) -> FloatArray:
        """The configuration of the rigid device, with no spring displaced, shape (nq,)."""
        state, out = self.model.held, self.model.held.neutral()
        given = self.rigid.held
        for name in list(given.model.names)[1:]:
            own = q[given.configuration_slice(name)]
            if name in self._guides:
                own = straight(given.model.joints[given.joint_index(name)], q)
            out[state.configuration_slice(self._guides.get(name, name))] = own
        out[self.model.arm_q] = quaternion
        return out
