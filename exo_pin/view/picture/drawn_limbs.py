"""A wrist in the scene: its URDF's visuals, harness and cuff, cables and muscles in place of rods, forces of limbs."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...chain.formats.urdf.urdf_writing import COLOURS
from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray
from ...design import Arm, Limb, Mechanism, WristGeometry
from ...design.holding_frame import BAR, WALL, holding_bars, sleeve_size
from ...load_case import CentreOffset, CentrePath
from ...reaction import Split
from ...reaction.assumptions import as_split
from ...wrist import inverse_kinematics
from ...wrist.forces.displaced import as_offset
from ...wrist_chain import mechanism_urdf
from ...wrist_chain.equilibrium import EquilibriumModel
from ..colours import BLACK, GREY
from ..stage.force_arrows import DrawnForce, ShownForces
from ..stage.shapes import (
    flat_material,
    frustum,
    lathe,
    matt_material,
    mesh_of,
    placement,
    rings_about_z,
    segment,
    skin_of,
    tube,
)
from ..stage.stage import Stage, mg
from .chain_picture import read_visuals, urdf_visuals
from .drawn_device import ROOT, DrawnDevice, Offset, Placed
from .drawn_parts import DrawnParts, pulls_or_pushes

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

#: Centres nearer than this are at one place, m.
_FITS = 1e-6
#: Distances of tension arrows from their limb and of the cuff's arrow from its sleeve, m.
_BESIDE, _FROM_CUFF = 0.032, 0.015


def offsets(
    given: CentreOffset | CentrePath | ArrayLike | None, poses: Rotation, split: str | Split
) -> list[Offset] | list[None]:
    """Offsets of poses of shape () or (k,), a list of 1 or k, as the forces of a query count them; None without one."""
    if given is None:
        return [None] * (1 if poses.single else len(poses))
    known = given.offset(poses) if isinstance(given, CentrePath) else given
    base, cuff = as_offset(known, poses.shape)
    base, cuff = as_split(split).offsets(poses.as_matrix().reshape(-1, 3, 3), base, cuff)
    return [(tuple(at), tuple(on_arm)) for at, on_arm in zip(base.tolist(), cuff.tolist(), strict=True)]


def displaced(mechanism: Mechanism, offset: Offset | None) -> Mechanism:
    """The mechanism with its joints where the offset has them."""
    if offset is None:
        return mechanism
    geometry = mechanism.geometry
    moved = geometry.replace(
        base_points=geometry.base_points + offset[0], platform_points=geometry.platform_points + offset[1]
    )
    return mechanism.replace(geometry=moved)


def offset_notes(offset: Offset | None, matrix: FloatArray) -> list[str]:
    """How far the device's centres are from the shoulder's in a pose of shape (3, 3), in words."""
    if offset is None:
        return []
    base, cuff = np.array(offset[0]), matrix @ offset[1]
    centres = {"harness": base, "cuff": cuff} if np.linalg.norm(base - cuff) > _FITS else {"device": base}
    sizes = {name: float(np.linalg.norm(centre)) for name, centre in centres.items()}
    return [f"{name}'s centre, {1e3 * size:.0f} mm off" for name, size in sizes.items() if size > _FITS]


#: Radius of the balls at the joints, m.
_BALL = 0.0138
#: Opacity of a sleeve that shows what is in it.
_SEE_THROUGH = 0.35
#: Of the frames, of the joints and of the sleeve.
_FRAME, _JOINT, _CLOTH = (0.30, 0.33, 0.37), (0.85, 0.55, 0.15), (0.52, 0.57, 0.62)


def _balls(points: FloatArray) -> Any:
    rise = np.linspace(-np.pi / 2, np.pi / 2, 9)
    ball = _BALL * rings_about_z(np.column_stack([np.cos(rise), np.sin(rise)]), 16)
    return mesh_of([skin_of(ball + point) for point in points])


#: Radius of a muscle at its nominal length and of its end fittings, m, and the angle of its braid there: for the
#: picture only. Threads that do not stretch make the radius follow from the length.
_RADIUS, _FITTING_RADIUS, _BRAID = 0.011, 0.006, np.radians(25.0)
#: Radius of a cable, m, thick enough to be seen.
_CABLE_RADIUS = 0.003
#: Share of the joint distance at each end that is not muscle, where the design has no value.
_FITTING_SHARE = 0.15


class DrawnLimbs(DrawnDevice):
    """A device by the limbs of its wrist, whose joints are known in closed form.

    Parameters
    ----------
    stage, exo
        Where, and what.
    muscles : bool
        Whether limbs are drawn as muscles, and not as cables or telescoping rods.
    with_arm : bool
        Whether the arm is drawn; a human figure brings its own.
    see_through : bool
        Whether the cuff shows what is in it.
    """

    def __init__(self, stage: Stage, exo: ShoulderExo, muscles: bool, with_arm: bool, see_through: bool) -> None:
        super().__init__(stage, exo)
        self._muscles, self._with_arm, self._see_through = muscles, with_arm, see_through
        own: Any = exo.wrist
        self._record = own.record
        actuators = [limb.actuator for limb in exo.device.limbs[: self._record.limb_count]]
        are_cables = [not muscles and actuator is not None and actuator.family == "cable" for actuator in actuators]
        self._cables = np.flatnonzero(are_cables).tolist()
        self._draw(None)
        # The record holds all of most wrists.
        more = own.beyond_record and exo.has_arm
        self.parts = DrawnParts(stage, exo.chain_device, ROOT) if more else None

    def _draw(self, offset: Offset | None) -> None:
        """Make everything, with the device's centre at an offset."""
        self._offset, self._mechanism = offset, displaced(self._record, offset)
        mechanism = self._mechanism
        if mechanism.arm is None:
            # Positions of the parts do not depend on the arm's mass, and no forces are computed here.
            mechanism = mechanism.replace(arm=Arm(1.0, np.array([0.0, 0.0, -0.2])))
        self._equilibrium = EquilibriumModel(mechanism)
        model, own = self._equilibrium.chain.model, mechanism_urdf(mechanism, part="whole")[0]
        # Shapes of a URDF belong to limbs at its place.
        urdf = self.exo.urdf if offset is None else None
        visuals, self.notes = urdf_visuals(model, own if urdf is None else urdf, "as exo_pin draws wrists")
        if visuals is None:
            visuals = read_visuals(model, own)
        self._hide(visuals, urdf is not None)
        self._stage.viewer[ROOT].delete()
        self._picture = self._stage.picture(model, visuals, ROOT)
        if not self._is_framed:
            self._load_worn(self._record.geometry)
        if self._muscles:
            self._load_muscles()
        for i in self._cables:
            self._stage.set_object(self._path("cables", i), frustum(1.0, 1.0), flat_material(BLACK))

    def _hide(self, visuals: Any, given: bool) -> None:
        """Take out what other shapes take the place of; visuals that are ``given`` may have a frame of their own."""
        cables = tuple(f"limb_{i + 1}_" for i in self._cables)
        parts = {
            shape.name: {part for part, colour in COLOURS.items() if np.allclose(shape.meshColor, colour, atol=1e-6)}
            for shape in visuals.geometryObjects
        }
        # Harness and cuff take the place of the rods between the joints, unless a URDF has a frame of its own.
        self._is_framed = given and any(
            shape.parentJoint == 0 or "base" in parts[shape.name] for shape in visuals.geometryObjects
        )
        hidden = {*(() if self._with_arm else ("arm",)), *(() if self._is_framed else ("base", "platform"))}
        for name, own in parts.items():
            is_rod = "platform_body" in name or "base_body" in name
            if own & hidden or (is_rod and (self._muscles or name.startswith(cables))):
                visuals.removeGeometryObject(name)

    def _configurations(self, poses: Rotation) -> FloatArray:
        # Without coordinates where limbs are all that is drawn.
        if self.parts is None:
            return np.empty((1 if poses.single else len(poses), 0))
        return super()._configurations(poses)

    def show(self, placed: Placed) -> bool:
        """See :class:`DrawnDevice`."""
        if placed.offset != self._offset:
            self._draw(placed.offset)
        pose, matrix = placed.pose, placed.pose.as_matrix()
        try:
            self._picture.display(self._equilibrium.configuration(matrix, pose.as_quat()))
        except LoopNotClosed:
            return False
        if not self._is_framed:
            # The harness in place, the cuff turned with the arm.
            harness, cuff = ((0.0,) * 3, (0.0,) * 3) if self._offset is None else self._offset
            self._stage.set_transform(f"/meshcat/{ROOT}/harness", placement(1.0, harness))
            self._stage.set_transform(f"/meshcat/{ROOT}/cuff", placement(matrix, matrix @ cuff))
        geometry = self._mechanism.geometry
        ends = list(zip(geometry.base_points, inverse_kinematics(geometry, pose).platform_points, strict=True))
        for i in self._cables:
            self._stage.set_transform(self._path("cables", i), segment(*ends[i], _CABLE_RADIUS))
        for i, limb in enumerate(self._mechanism.limbs if self._muscles else ()):
            self._place_muscle(i, limb, *ends[i])
        if self.parts is not None and not np.isnan(placed.q).any():
            self.parts.show(placed.q)
        return True

    def colour_muscles(self, colours: FloatArray) -> None:
        """Colour the muscles, shape (n, 3)."""
        if self._muscles:
            for i, colour in enumerate(colours):
                self._stage.set_colour(f"{self._path('muscles', i)}/braid", [*colour, 1.0])

    def _path(self, kind: str, index: int) -> str:
        return f"/meshcat/{ROOT}/{kind}/limb_{index + 1}"

    def corners(self) -> FloatArray:
        """See :class:`DrawnDevice`."""
        return np.vstack([self._record.geometry.base_points, self._record.geometry.platform_points])

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
            at, pull = _beside_cuff(R, geometry), -forces.cuff_pull * R[:, 2]
            found.append(DrawnForce("cuff", "cuff", at, pull, "cuff", more=f" along the arm{slips}"))
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
            found.append(DrawnForce(f"limb_{i + 1}/side", "side", b, sides[i], f"{i + 1} side"))
        if self.parts is None or np.isnan(placed.q).any() or not forces.has_device:
            return found
        slides = tuple(role.slide for role in self.exo.chain.roles.limbs)
        return [*found, *self.parts.forces(placed.q, forces.tensions, slides)]

    def _load_worn(self, geometry: WristGeometry) -> None:
        """Make harness and cuff, which carry joint centres."""
        node, arm = self._stage.viewer[ROOT], np.asarray(geometry.platform_points)
        radius, bottom, top = sleeve_size(arm)
        wall = radius + WALL
        sleeve = lathe(np.array([(radius, bottom), (wall, bottom), (wall, top), (radius, top), (radius, bottom)]), 48)
        node["cuff/sleeve"].set_object(sleeve, matt_material(_CLOTH, _SEE_THROUGH if self._see_through else 1.0))
        base = np.asarray(geometry.base_points)
        for name, points, bars in zip(("harness", "cuff"), (base, arm), holding_bars(geometry), strict=True):
            frame = mesh_of([tube(bar, BAR) for bar in bars])
            node[f"{name}/frame"].set_object(frame, matt_material(_FRAME))
            node[f"{name}/joints"].set_object(_balls(points), matt_material(_JOINT))

    def _load_muscles(self) -> None:
        rise = np.linspace(0.0, 1.0, 7)
        profile = np.column_stack([0.45 + 0.55 * np.sin(rise * np.pi / 2), 0.16 * rise])
        below = np.vstack([[1e-6, 0.0], profile])
        above = below[::-1] * [1.0, -1.0] + [0.0, 1.0]
        for i in range(self._record.limb_count):
            node = self._stage.viewer[ROOT]["muscles"][f"limb_{i + 1}"]
            node["braid"].set_object(lathe(np.vstack([below, above])), mg.MeshLambertMaterial(side=0))
            for end in ("fitting_a", "fitting_b"):
                node[end].set_object(frustum(1.0, 1.0), flat_material(GREY))

    def _place_muscle(self, index: int, limb: Limb, a: FloatArray, b: FloatArray) -> None:
        length = float(np.linalg.norm(b - a))
        s = (b - a) / length
        fitting, radius = _FITTING_SHARE * length, _RADIUS
        stroke = limb.stroke
        if stroke is not None and stroke.end_fitting is not None:
            fitting = min(stroke.end_fitting / 2, 0.45 * length)
            stretch = min((length - 2 * fitting) / stroke.nominal_length * np.cos(_BRAID), 0.98)
            radius = _RADIUS * np.sqrt(1.0 - stretch**2) / np.sin(_BRAID)
        start, end = a + fitting * s, b - fitting * s
        path = self._path("muscles", index)
        self._stage.set_transform(f"{path}/braid", segment(start, end, radius))
        self._stage.set_transform(f"{path}/fitting_a", segment(a, start, _FITTING_RADIUS))
        self._stage.set_transform(f"{path}/fitting_b", segment(end, b, _FITTING_RADIUS))


def _beside_cuff(R: FloatArray, geometry: WristGeometry) -> FloatArray:
    """Middle of the sleeve, beside it, where no joint is near, base frame, shape (3,), m."""
    points = geometry.platform_points
    radius, bottom, top = sleeve_size(points)
    turns = np.radians(np.arange(0.0, 360.0, 10.0))
    around = np.stack([np.cos(turns), np.sin(turns)], axis=1) * (radius + WALL + _FROM_CUFF)
    gaps = np.linalg.norm(around[:, None] - points[None, :, :2], axis=2).min(axis=1)
    return np.asarray(R @ np.array([*around[int(gaps.argmax())], (bottom + top) / 2]))
