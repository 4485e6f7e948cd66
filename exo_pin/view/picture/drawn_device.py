"""A device in the scene: what is drawn of it in a pose, and the forces on the arm where they act."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...chain.formats.urdf.urdf_writing import urdf_text
from ...core.errors import InvalidInput, LoopNotClosed
from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...design.holding_frame import WALL, sleeve_size
from ...wrist import inverse_kinematics
from ..figure.figure import starts_inside
from ..stage.force_arrows import DrawnForce, ShownForces
from ..stage.stage import Stage
from .chain_picture import ChainPicture
from .drawn_parts import DrawnParts, pulls_or_pushes
from .mechanism_picture import MechanismPicture, Offset, displaced, same_offset

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

#: Node of the device, and distances of tension arrows from their limb and of the cuff's arrow from its sleeve, m.
ROOT, _BESIDE, _FROM_CUFF = "exo", 0.032, 0.015


class Placed(NamedTuple):
    """A pose of the arm with the chain's configuration, shape (nq,), and where the device's centre is off O."""

    pose: Rotation
    q: FloatArray
    offset: Offset | None


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
    displaced : bool
        Whether it is drawn where an offset of its centre puts it.
    """

    displaced = True
    exo: ShoulderExo
    notes: list[str]
    parts: DrawnParts | None

    def __init__(self, stage: Stage, exo: ShoulderExo) -> None:
        self._stage, self.exo = stage, exo

    def configurations(self, poses: Rotation) -> FloatArray:
        """Of the chain in poses of shape () or (k,), shape (1, nq) or (k, nq); NaN where a pose is out of reach."""
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

    def inside(self, scale: float) -> list[str]:
        """What starts inside the chest of a figure of that scale, in words."""
        return []

    def tensions(self, forces: ShownForces) -> FloatArray:
        """Of limbs or drives, shape (n,), N."""
        return forces.tensions

    def colour_muscles(self, colours: FloatArray) -> None:
        """Colour the muscles, shape (n, 3), where limbs are drawn so."""

    def _on_arm(self, placed: Placed, forces: ShownForces) -> list[DrawnForce]:
        """Force of the shoulder, contact force, and weight of arm and device."""
        arm, R = self.exo.device.arm, placed.pose.as_matrix()
        force = forces.shoulder
        found = [DrawnForce("shoulder", "shoulder", np.zeros(3), force, f"shoulder {np.linalg.norm(force):.0f} N")]
        if forces.contact is not None:
            contact = np.nan_to_num(forces.contact.force)
            text = f"contact {np.linalg.norm(contact):.0f} N"
            found.append(DrawnForce("contact", "contact", np.zeros(3), contact, text))
        weight = arm.mass * self.exo.device.gravity
        text = f"weight {np.linalg.norm(weight):.0f} N"
        return [DrawnForce("weight", "weight", R @ arm.centre_of_mass, weight, text), *found]


class DrawnLinks(DrawnDevice):
    """A device by the links of its chain.

    Parameters
    ----------
    stage, exo
        Where, and what.
    with_arm : bool
        Whether the arm is drawn; a human figure brings its own.
    """

    displaced = False

    def __init__(self, stage: Stage, exo: ShoulderExo, with_arm: bool) -> None:
        super().__init__(stage, exo)
        stage.viewer[ROOT].delete()
        self.parts = self._own = DrawnParts(stage, exo.chain_device, ROOT)
        self._rest = self.configurations(Rotation.identity())[0]
        self._picture = ChainPicture(stage, exo.chain, looks_of(exo), self._rest, ROOT, marks=False, with_arm=with_arm)
        self.notes = self._picture.notes

    def show(self, placed: Placed) -> bool:
        """See :class:`DrawnDevice`."""
        if np.isnan(placed.q).any():
            return False
        self._picture.show(placed.q)
        self._own.show(placed.q)
        return True

    def corners(self) -> FloatArray:
        """See :class:`DrawnDevice`."""
        return np.vstack([self._picture.corners(self._rest), self._own.place(self._rest)])

    def forces(self, placed: Placed, forces: ShownForces) -> list[DrawnForce]:
        """Shoulder, weight of the wearer's arm, the device at its cuff, which add up to nothing at rest; efforts."""
        weight, *found = self._on_arm(placed, forces)
        person, R, wrench = self.exo.device.arm.person, placed.pose.as_matrix(), forces.cuff_wrench
        if person is None:
            # Nobody wears it: the arm is one body with what is fixed to it.
            wrench = forces.limb_wrenches.sum(axis=0)
        else:
            own = person.mass * self.exo.device.gravity
            text = f"weight {np.linalg.norm(own):.0f} N"
            weight = DrawnForce("weight", "own weight", R @ person.centre_of_mass, own, text)
        if np.isnan(placed.q).any() or not forces.has_device:
            return [weight, *found]
        size = float(np.linalg.norm(wrench[:3]))
        cuff = self.exo.chain.roles.cuff
        at = weight.at if cuff is None else np.array(self.exo.chain.placement(placed.q, cuff).translation)
        found.append(DrawnForce("device", "device", at, wrench[:3], f"device {size:.0f} N"))
        return [weight, *found, *self._own.forces(placed.q, forces.tensions)]


class DrawnLimbs(DrawnDevice):
    """A device by the limbs of its wrist, whose joints are known in closed form.

    Parameters
    ----------
    stage, exo
        Where, and what.
    muscles : bool
        Whether limbs are drawn as muscles.
    with_arm, see_through : bool
        As for :class:`.MechanismPicture`.
    """

    _offset: Offset | None

    def __init__(self, stage: Stage, exo: ShoulderExo, muscles: bool, with_arm: bool, see_through: bool) -> None:
        super().__init__(stage, exo)
        self._looks = {"muscles": muscles, "with_arm": with_arm, "see_through": see_through}
        own: Any = exo.wrist
        self._record, self._offset = own.record, None
        self._draw()
        # The record holds all of most wrists.
        more = own.beyond_record and exo.has_arm
        self.parts = DrawnParts(stage, exo.chain_device, ROOT) if more else None

    def _draw(self) -> None:
        # Shapes of a URDF belong to limbs at its place.
        urdf = self.exo.urdf if self._offset is None else None
        drives = self.exo.device.limbs[: self._record.limb_count]
        self._picture = MechanismPicture(
            self._stage, self._record, ROOT, **self._looks, urdf=urdf, offset=self._offset,
            cables=[drive.actuator is not None and drive.actuator.family == "cable" for drive in drives],
        )  # fmt: skip
        self.notes = self._picture.notes

    def configurations(self, poses: Rotation) -> FloatArray:
        """See :class:`DrawnDevice`; without coordinates where limbs are all that is drawn."""
        if self.parts is None:
            return np.empty((1 if poses.single else len(poses), 0))
        return super().configurations(poses)

    def show(self, placed: Placed) -> bool:
        """See :class:`DrawnDevice`."""
        if not same_offset(placed.offset, self._offset):
            self._offset = placed.offset
            self._draw()
        try:
            self._picture.show(placed.pose)
        except LoopNotClosed:
            return False
        if self.parts is not None and not np.isnan(placed.q).any():
            self.parts.show(placed.q)
        return True

    def colour_muscles(self, colours: FloatArray) -> None:
        """Colour the muscles, shape (n, 3)."""
        self._picture.colour_muscles(colours)

    def corners(self) -> FloatArray:
        """See :class:`DrawnDevice`."""
        return np.vstack([self._record.geometry.base_points, self._record.geometry.platform_points])

    def inside(self, scale: float) -> list[str]:
        """See :class:`DrawnDevice`."""
        return starts_inside(self._picture.mechanism.geometry.base_points, self.exo.side, scale)

    def tensions(self, forces: ShownForces) -> FloatArray:
        """Of the limbs, shape (n,), N; zero where a limb has no drive."""
        if self.parts is None:
            return forces.tensions
        return np.array([0.0 if k is None else sign * forces.tensions[k] for k, sign in self._drives])

    @cached_property
    def _drives(self) -> list[tuple[int | None, float]]:
        """Of each limb the number of its drive, and whether its effort is a tension."""
        known = {
            drive.joint: (k, 1.0 if drive.pulls else -1.0) for k, drive in enumerate(self.exo.chain_device.efforts)
        }
        return [known.get(role.slide, (None, 0.0)) for role in self.exo.chain.roles.limbs]

    @cached_property
    def _rows(self) -> list[int]:
        """Of each limb the row of its wrench in an answer."""
        count = self._record.limb_count
        if self.parts is None:
            return list(range(count))
        model, arm, found = self.exo.chain.model, self.exo.chain_device.arm_index, []
        for role in self.exo.chain.roles.limbs:
            joint = model.getJointId(role.slide)
            while model.parents[joint] != arm:
                joint = model.parents[joint]
            found.append(joint)
        hanging = [joint for joint in range(model.njoints) if joint > 0 and model.parents[joint] == arm]
        return [hanging.index(joint) for joint in found]

    def forces(self, placed: Placed, forces: ShownForces) -> list[DrawnForce]:
        """Shoulder, weight and limbs, which add up to nothing at rest; the cuff's pull; springs and other drives."""
        found, R = self._on_arm(placed, forces), placed.pose.as_matrix()
        geometry = displaced(self._record, placed.offset).geometry
        if forces.cuff_text:
            slips = "" if forces.cuff_slip is None else f", slips {1e3 * forces.cuff_slip:.0f} mm"
            text = f"cuff {abs(forces.cuff_pull):.0f} N along the arm{slips}"
            found.append(DrawnForce("cuff", "cuff", _beside_cuff(R, geometry), -forces.cuff_pull * R[:, 2], text))
        state, tensions = inverse_kinematics(geometry, placed.pose), self.tensions(forces)
        if placed.offset is None and self.parts is None:
            sides = -forces.side_forces[:, None] * state.normals
        else:
            # Off its centre a limb's side wrench is a screw, and a heavy limb's force has other parts: what is across.
            sides = forces.limb_wrenches[self._rows, :3] + tensions[:, None] * state.directions
        for i, (b, s) in enumerate(zip(state.platform_points, state.directions, strict=True)):
            outward = b - (b @ s) * s
            beside = b + _BESIDE * outward / max(float(np.linalg.norm(outward)), 1e-9)
            found += pulls_or_pushes(f"limb_{i + 1}", f"{i + 1}", beside, -s, float(tensions[i]))
            text = f"{i + 1} side {np.linalg.norm(sides[i]):.0f} N"
            found.append(DrawnForce(f"limb_{i + 1}/side", "side", b, sides[i], text))
        if self.parts is None or np.isnan(placed.q).any() or not forces.has_device:
            return found
        slides = tuple(role.slide for role in self.exo.chain.roles.limbs)
        return [*found, *self.parts.forces(placed.q, forces.tensions, slides)]


def looks_of(exo: ShoulderExo) -> str | PathLike[str] | None:
    """The URDF that a robot was read from; else one of its chain's own shapes, or None where there are none."""
    if exo.urdf is not None or not exo.chain.description.shapes:
        return exo.urdf
    try:
        return urdf_text(exo.chain._state)[0]
    except InvalidInput:
        # What URDF has no words for is drawn by its joints.
        return None


def _beside_cuff(R: FloatArray, geometry: WristGeometry) -> FloatArray:
    """Middle of the sleeve, beside it, where no joint is near, base frame, shape (3,), m."""
    points = geometry.platform_points
    radius, bottom, top = sleeve_size(points)
    turns = np.radians(np.arange(0.0, 360.0, 10.0))
    around = np.stack([np.cos(turns), np.sin(turns)], axis=1) * (radius + WALL + _FROM_CUFF)
    gaps = np.linalg.norm(around[:, None] - points[None, :, :2], axis=2).min(axis=1)
    return np.asarray(R @ np.array([*around[int(gaps.argmax())], (bottom + top) / 2]))
