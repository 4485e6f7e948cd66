"""A device in the scene: what is drawn of it in a pose, and the forces on the arm where they act."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...chain import ClosedChain, Placement
from ...chain.formats.urdf.urdf_writing import urdf_text
from ...core.errors import InvalidInput
from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...device import Route
from ...device.device_model import device_model
from ...device.postures import reached_postures
from ..stage.force_arrows import DrawnForce, ShownForces
from ..stage.stage import Stage
from .chain_picture import ChainPicture
from .drawn_parts import DrawnParts

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

#: Node of the device.
ROOT = "exo"
#: Where the device's centre lies: of harness and base ring in the base frame, of cuff and arm ring in the arm's, m.
Offset = tuple[tuple[float, ...], tuple[float, ...]]


class Placed(NamedTuple):
    """A pose of the arm with the chain's configuration, shape (nq,), and where the device's centre is off O.

    ``drawn`` is the offset with which the device is drawn: none where it follows the arm only by giving way.
    """

    pose: Rotation
    q: FloatArray
    offset: Offset | None
    drawn: Offset | None


class DrawnDevice(OneProcess, ABC):
    """A device on the arm.

    Attributes
    ----------
    exo : ShoulderExo
        The device.
    notes : list of str
        What could not be drawn, and why.
    parts : DrawnParts or None
        Cables, springs and drives; None where limbs are all that there is.
    """

    exo: ShoulderExo
    notes: list[str]
    parts: DrawnParts | None

    def __init__(self, stage: Stage, exo: ShoulderExo) -> None:
        self._stage, self.exo = stage, exo

    def places(self, poses: Rotation, offsets: Sequence[Offset | None]) -> list[Placed]:
        """Poses of shape () or (k,) with their offsets; coordinates are NaN where a pose is out of reach."""
        each = [poses] if poses.single else [poses[k] for k in range(len(poses))]
        whole = zip(each, self._configurations(poses), offsets, offsets, strict=True)
        return [Placed(*place) for place in whole]

    def _configurations(self, poses: Rotation) -> FloatArray:
        return np.atleast_2d(self.exo.configurations(poses))

    @abstractmethod
    def show(self, placed: Placed) -> bool:
        """Draw a pose, and return whether the device reaches it; else it stays as it was."""

    @abstractmethod
    def corners(self) -> FloatArray:
        """What is to be in the picture at rest, shape (k, 3), m."""

    @abstractmethod
    def forces(self, placed: Placed, forces: ShownForces) -> list[DrawnForce]:
        """Forces on the arm, N, base frame."""

    def tensions(self, forces: ShownForces) -> FloatArray:
        """Of limbs or drives, shape (n,), N."""
        return forces.tensions

    def colour_muscles(self, colours: FloatArray) -> None:
        """Colour the muscles, shape (n, 3), where limbs are drawn so."""

    def _on_arm(self, placed: Placed, forces: ShownForces) -> list[DrawnForce]:
        """Weight of arm and device, force of the shoulder, contact force."""
        arm, here = self.exo.device.arm, np.zeros(3)
        at, weight = placed.pose.as_matrix() @ arm.centre_of_mass, arm.mass * self.exo.device.gravity
        found = [DrawnForce("weight", "weight", at, weight, "weight")]
        found.append(DrawnForce("shoulder", "shoulder", here, forces.shoulder, "shoulder"))
        if forces.contact is not None:
            found.append(DrawnForce("contact", "contact", here, np.nan_to_num(forces.contact.force), "contact"))
        return found


class DrawnLinks(DrawnDevice):
    """A device by the links of its chain.

    Parameters
    ----------
    stage, exo
        Where, and what.
    with_arm : bool
        Whether the arm is drawn; a human figure brings its own.
    """

    def __init__(self, stage: Stage, exo: ShoulderExo, with_arm: bool) -> None:
        super().__init__(stage, exo)
        self._with_arm, self._rest = with_arm, self._configurations(Rotation.identity())[0]
        self._draw(None)

    def _draw(self, offset: Offset | None) -> None:
        self._offset, device = offset, displaced_device(self.exo.chain_device, offset)
        self._stage.viewer[ROOT].delete()
        self.parts = self._own = DrawnParts(self._stage, device, ROOT)
        self._picture = ChainPicture(
            self._stage, device.chain, looks_of(self.exo), self._rest, ROOT, marks=False, with_arm=self._with_arm,
            moved=np.zeros(3) if offset is None else np.array(offset[1]),
        )  # fmt: skip
        self.notes = self._picture.notes

    def places(self, poses: Rotation, offsets: Sequence[Offset | None]) -> list[Placed]:
        """See :class:`DrawnDevice`."""
        return [self._moved(placed) for placed in super().places(poses, offsets)]

    def _moved(self, placed: Placed) -> Placed:
        if placed.offset is None:
            return placed
        model = device_model(displaced_device(self.exo.chain_device, placed.offset))
        found = reached_postures(model, placed.pose.as_matrix()[None])
        return placed._replace(q=found.q[0]) if found.reached[0] else placed._replace(drawn=None)

    def show(self, placed: Placed) -> bool:
        """See :class:`DrawnDevice`."""
        if np.isnan(placed.q).any():
            return False
        if placed.drawn != self._offset:
            self._draw(placed.drawn)
        self._picture.show(placed.q)
        self._own.show(placed.q)
        return True

    def corners(self) -> FloatArray:
        """See :class:`DrawnDevice`."""
        return np.vstack([self._picture.corners(self._rest), self._own.place(self._rest)])

    def forces(self, placed: Placed, forces: ShownForces) -> list[DrawnForce]:
        """Shoulder, weight of the wearer's arm, the device at its cuff, which add up to nothing at rest; efforts."""
        weight, *found = self._on_arm(placed, forces)
        person, wrench = self.exo.device.arm.person, forces.cuff_wrench
        if person is None:
            # Nobody wears it: the arm is one body with what is fixed to it.
            wrench = forces.limb_wrenches.sum(axis=0)
        else:
            at, own = placed.pose.as_matrix() @ person.centre_of_mass, person.mass * self.exo.device.gravity
            weight = DrawnForce("weight", "own weight", at, own, "weight")
        if np.isnan(placed.q).any() or not forces.has_device:
            return [weight, *found]
        device = displaced_device(self.exo.chain_device, placed.drawn)
        cuff = device.chain.roles.cuff
        at = weight.at if cuff is None else np.array(device.chain.placement(placed.q, cuff).translation)
        found.append(DrawnForce("device", "device", at, wrench[:3], "device"))
        parts = self._own if placed.drawn == self._offset else DrawnParts(self._stage, device, ROOT)
        return [weight, *found, *parts.forces(placed.q, forces.tensions)]


@lru_cache(maxsize=32)
def displaced_device(device: Any, offset: Offset | None) -> Any:
    """A chain's device with what stands on the torso and on the arm where an offset of its centre has them.

    Frames and joints that the torso holds go with the harness, those that the arm carries with the cuff; the arm's own
    joint stays in the shoulder.
    """
    if offset is None:
        return device
    model, (base, cuff) = device.chain.model.copy(), np.array(offset)
    for carrier, shift in ((0, base), (device.arm_index, cuff)):
        for frame in model.frames:
            if frame.parentJoint == carrier and frame.name not in ("universe", model.names[device.arm_index]):
                frame.placement.translation += shift
        for joint in range(1, model.njoints):
            if model.parents[joint] == carrier and joint != device.arm_index:
                model.jointPlacements[joint].translation += shift

    # The world's own frame stays; what closures and routes have there moves in it.
    def end(name: str, place: Placement) -> Placement:
        moved = tuple((np.array(place.translation) + base).tolist())
        return replace(place, translation=moved) if name == "universe" else place

    def along(part: Any) -> Any:
        if part.route is None:
            return part
        points = [(p.link, p.point + base * (p.link == "universe")) for p in part.route.points]
        return replace(part, route=Route.over(*points))

    closures = tuple(
        replace(loop, placement_a=end(loop.frame_a, loop.placement_a), placement_b=end(loop.frame_b, loop.placement_b))
        for loop in device.chain.closures
    )
    chain = ClosedChain(model, replace(device.chain.description, closures=closures))
    parts = {name: tuple(map(along, getattr(device, name))) for name in ("drives", "springs", "brakes")}
    return device.replace(chain=chain, **parts)


def looks_of(exo: ShoulderExo) -> str | PathLike[str] | None:
    """The URDF that a robot was read from; else one of its chain's own shapes, or None where there are none."""
    if exo.urdf is not None or not exo.chain.description.shapes:
        return exo.urdf
    try:
        return urdf_text(exo.chain._state)[0]
    except InvalidInput:
        # What URDF has no words for is drawn by its joints.
        return None
