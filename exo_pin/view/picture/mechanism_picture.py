"""The mechanism in the scene: its URDF's visuals by MeshcatVisualizer, cables and muscles in place of rods."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...chain.formats.urdf.urdf_writing import COLOURS
from ...core.records import OneProcess
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

#: Centres nearer than this are at one place, m.
_FITS = 1e-6

#: Where the device's centre lies: of harness and base ring in the base frame, of cuff and arm ring in the arm's, m.
Offset = tuple[tuple[float, ...], tuple[float, ...]]


def offsets(
    given: CentreOffset | CentrePath | ArrayLike, poses: Rotation, split: str | Split = "spherical"
) -> list[Offset]:
    """Offsets of poses of shape () or (k,), a list of 1 or k, as the forces of a query count them."""
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
#: Colours of the URDF's rods between the joints of base and platform.
_FRAMES = ("base", "platform")


class MechanismPicture(OneProcess):
    """A mechanism in a pose.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    mechanism : Mechanism
        What is drawn.
    root : str
        Name of its node.
    muscles : bool
        Whether the limbs are drawn as muscles, and not as cables or telescoping rods.
    with_arm : bool
        Whether the arm is drawn; a human figure brings its own.
    see_through : bool
        Whether the cuff shows what is in it.
    urdf : path-like or str, optional
        The URDF that the mechanism was read from, or its XML, for its looks; the mechanism's own if left out.
    offset : Offset, optional
        Where its centre is.
    cables : sequence of bool
        Which limbs are cables; what pulls one is on the torso.

    Attributes
    ----------
    mechanism : Mechanism
        The design with its joints where the offset has them.
    notes : list of str
        What could not be drawn, and why.
    """

    def __init__(
        self,
        stage: Stage,
        mechanism: Mechanism,
        root: str,
        muscles: bool = False,
        with_arm: bool = True,
        see_through: bool = False,
        urdf: str | PathLike[str] | None = None,
        offset: Offset | None = None,
        cables: Sequence[bool] = (),
    ) -> None:
        worn, mechanism = mechanism, displaced(mechanism, offset)
        self._stage, self.mechanism, self.root, self._muscles = stage, mechanism, root, muscles
        if mechanism.arm is None:
            # Positions of the parts do not depend on the arm's mass, and no forces are computed here.
            mechanism = mechanism.replace(arm=Arm(1.0, np.array([0.0, 0.0, -0.2])))
        self._equilibrium = EquilibriumModel(mechanism)
        model = self._equilibrium.chain.model
        own = mechanism_urdf(mechanism, part="whole")[0]
        visuals, self.notes = urdf_visuals(model, own if urdf is None else urdf, "as exo_pin draws wrists")
        if visuals is None:
            visuals = _read_visuals(model, own)
        self._cables = () if muscles else tuple(i for i, is_cable in enumerate(cables) if is_cable)
        # Harness and cuff take the place of the rods between the joints, unless a URDF has a frame of its own.
        framed = urdf is not None and any(
            shape.parentJoint == 0 or np.allclose(shape.meshColor, COLOURS["base"], atol=1e-6)
            for shape in visuals.geometryObjects
        )
        hidden = []
        for shape in visuals.geometryObjects:
            if not with_arm and np.allclose(shape.meshColor, COLOURS["arm"], atol=1e-6):
                hidden.append(shape.name)
            if not framed and any(np.allclose(shape.meshColor, COLOURS[part], atol=1e-6) for part in _FRAMES):
                hidden.append(shape.name)
            rod = "platform_body" in shape.name or "base_body" in shape.name
            if rod and (muscles or any(shape.name.startswith(f"limb_{i + 1}_") for i in self._cables)):
                hidden.append(shape.name)
        for name in hidden:
            visuals.removeGeometryObject(name)
        stage.viewer[root].delete()
        self._picture = stage.picture(model, visuals, root)
        self._worn = None if framed else ((0.0,) * 3, (0.0,) * 3) if offset is None else offset
        if not framed:
            self._load_worn(worn.geometry, see_through)
        if muscles:
            self._load_muscles()
        for i in self._cables:
            stage.set_object(self._cable(i), frustum(1.0, 1.0), flat_material(BLACK))

    def show(self, poses: Rotation) -> None:
        """Move it into a pose.

        Raises
        ------
        LoopNotClosed
            If the loops do not close there.
        """
        self._picture.display(self._equilibrium.configuration(poses.as_matrix(), poses.as_quat()))
        if self._worn is not None:
            # The harness in place, the cuff turned with the arm.
            (harness, cuff), matrix = self._worn, poses.as_matrix()
            self._stage.set_transform(f"/meshcat/{self.root}/harness", placement(1.0, harness))
            self._stage.set_transform(f"/meshcat/{self.root}/cuff", placement(matrix, matrix @ cuff))
        base = self.mechanism.geometry.base_points
        platform = (
            base
            if not (self._muscles or self._cables)
            else inverse_kinematics(self.mechanism.geometry, poses).platform_points
        )
        for i in self._cables:
            self._stage.set_transform(self._cable(i), segment(base[i], platform[i], _CABLE_RADIUS))
        for i, limb in enumerate(self.mechanism.limbs if self._muscles else ()):
            self._place_muscle(i, limb, base[i], platform[i])

    def colour_muscles(self, colours: FloatArray) -> None:
        """Colour the muscles, shape (n, 3)."""
        if self._muscles:
            for i, colour in enumerate(colours):
                self._stage.set_colour(f"{self._muscle(i)}/braid", [*colour, 1.0])

    def _cable(self, index: int) -> str:
        return f"/meshcat/{self.root}/cables/limb_{index + 1}"

    def _muscle(self, index: int) -> str:
        return f"/meshcat/{self.root}/muscles/limb_{index + 1}"

    def _load_worn(self, geometry: WristGeometry, see_through: bool) -> None:
        """Make harness and cuff, which carry joint centres."""
        node, arm = self._stage.viewer[self.root], np.asarray(geometry.platform_points)
        radius, bottom, top = sleeve_size(arm)
        wall = radius + WALL
        sleeve = lathe(np.array([(radius, bottom), (wall, bottom), (wall, top), (radius, top), (radius, bottom)]), 48)
        node["cuff/sleeve"].set_object(sleeve, matt_material(_CLOTH, _SEE_THROUGH if see_through else 1.0))
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
        for i in range(self.mechanism.limb_count):
            node = self._stage.viewer[self._muscle(i).removeprefix("/meshcat/")]
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
        path = self._muscle(index)
        self._stage.set_transform(f"{path}/braid", segment(start, end, radius))
        self._stage.set_transform(f"{path}/fitting_a", segment(a, start, _FITTING_RADIUS))
        self._stage.set_transform(f"{path}/fitting_b", segment(end, b, _FITTING_RADIUS))


def urdf_visuals(
    model: pin.Model, urdf: str | PathLike[str], instead: str
) -> tuple[pin.GeometryModel | None, list[str]]:
    """Visuals of a URDF or of its XML, on the links of the model that have the same names.

    None where they cannot be read, and then a note that says why, and how the robot is drawn ``instead``.
    """
    try:
        return _read_visuals(model, urdf), []
    except (RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        return None, [f"drawn {instead}: the URDF's visuals cannot be read ({reason:.200})"]


def _read_visuals(model: pin.Model, urdf: str | PathLike[str]) -> pin.GeometryModel:
    if isinstance(urdf, str) and urdf.lstrip().startswith("<"):
        return pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.VISUAL)
    folder = Path(urdf).resolve().parent
    folders = [str(folder), *(str(above) for above in list(folder.parents)[:2])]
    return pin.buildGeomFromUrdf(model, str(urdf), pin.GeometryType.VISUAL, package_dirs=folders)
