"""Who wears the device in the scene: the wearer's skeleton, the mannequin, chest and head alone, or nobody.

The mannequin is the human figure of example-robot-data.
Its pelvis, legs, arms and hands are drawn; chest, neck, head and shoulders are those of :func:`draw_bust`, because the
figure has neither neck nor face and a gap at the shoulder. The package ships data and no loader. The figure is Y-up (x
forward, z to its right) and its shoulders turn about Z, X and Y in that order; the signs of the axes are read from the
URDF. It can be scaled to a person's stature, as a whole. Its Euler angles are made here, at the edge, and no result
depends on them.

Bones are the meshes of the installed package ``myo_sim`` (extra ``person``). Muscles are drawn along their paths:
straight between the points where the model bends them, so that the picture shows the lines of action that the forces
come from. Their thickness follows from their volume; it is for the picture only. The other arm hangs at rest.
"""

from __future__ import annotations

import importlib.metadata
import itertools
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import MissingExtra
from ...core.files.toml_tables import read_toml
from ...core.records import OneProcess
from ...core.validation import FloatArray, require_method
from ...person.limb.muscle_table import MUSCLES
from ...person.limb.skeleton import BONES, LimbShape, bone_meshes, limb_shape
from ...reaction import GlenoidCone
from ..colours import ACTIVATIONS, BLACK, SKY, scale_colours
from ..stage.force_arrows import PoseContact, round_up
from ..stage.shapes import draw_ground, flat_material, lathe, loft, matt_material, mesh_of, placement, segment, tube
from ..stage.stage import Stage, mg

if TYPE_CHECKING:
    from ...design import Wearer
    from ...person import Person


#: Stature that the sizes belong to, from soles to crown, and distance of the body's middle from the shoulder centre, m.
OWN_STATURE, MIDDLE = 1.787, 0.21
#: Opacity of the shoulder and arm that wear the device, which shows joints and forces in them.
SEE_THROUGH = 0.5
SKIN, CLOTH = (0.86, 0.70, 0.60), (0.62, 0.67, 0.73)
_EYE = (0.20, 0.17, 0.16)

_DATA = read_toml(Path(__file__).with_name("bust.toml"))
#: Sections from below: height, half width, half depth, how far forward its middle is, m.
_CHEST, _NECK, _HEAD = (_DATA.quantity("length", part, (None, 4)) for part in ("chest", "neck", "head"))
#: Centre and radii of balls, m.
_FEATURES, _EYES = (_DATA.quantity("length", part, (None, 6)) for part in ("nose_and_ears", "eyes"))
_DATA.finish()
#: Exponent of the superellipses: 2 is an ellipse, more is nearer to a rectangle.
_ROUND = 2.35
#: Radius of the rounding of a shoulder, m.
_SHOULDER = 0.060


def draw_bust(stage: Stage, side: str, scale: float) -> None:
    """Draw chest, neck, head and shoulders, in place once and for all.

    Parameters
    ----------
    stage : Stage
        Where.
    side : {"left", "right"}
        Which shoulder is at O.
    scale : float
        Of everything: stature over :data:`OWN_STATURE`.
    """
    node = stage.viewer["bust"]
    cloth, skin, dark = matt_material(CLOTH), matt_material(SKIN), matt_material(_EYE)
    for name, sections, material in (("chest", _CHEST, cloth), ("neck", _NECK, skin), ("head", _HEAD, skin)):
        node[name].set_object(loft(_rings(sections)), material)
    features = [*((shape, skin) for shape in _FEATURES), *((shape, dark) for shape in _EYES)]
    for k, (ball, material) in enumerate(features):
        _ball(node[f"feature_{k}"], ball[:3], ball[3:], material)
    own, other = (1.0, -1.0) if side == "left" else (-1.0, 1.0)
    _ball(node["shoulder"], (0.0, own * MIDDLE, 0.0), _SHOULDER, matt_material(SKIN, SEE_THROUGH))
    _ball(node["other_shoulder"], (0.0, other * MIDDLE, 0.0), _SHOULDER, cloth)
    stage.set_transform("/meshcat/bust", placement(scale, [0.0, -own * scale * MIDDLE, 0.0]))


def _rings(sections: FloatArray) -> FloatArray:
    """Closed rings over sections, a few between each two, shape (k, 48, 3)."""
    from scipy.interpolate import PchipInterpolator

    rows = np.arange(len(sections), dtype=float)
    fine = PchipInterpolator(rows, sections)(np.linspace(0.0, rows[-1], 4 * (len(sections) - 1) + 1))
    turn = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    x, y = (np.sign(part) * np.abs(part) ** (2.0 / _ROUND) for part in (np.cos(turn), np.sin(turn)))
    rings = [
        np.column_stack([forward + depth * x, width * y, np.full(48, height)]) for height, width, depth, forward in fine
    ]
    ends = [np.tile(rings[k].mean(axis=0), (48, 1)) for k in (0, -1)]
    return np.array([ends[0], *rings, ends[1]])


def _ball(node: Any, centre: ArrayLike, radii: ArrayLike, material: Any) -> None:
    node.set_object(mg.Sphere(1.0), material)
    node.set_transform(placement(radii, centre))


_PACKAGE = "example-robot-data"
_URDF = Path(_PACKAGE) / "robots" / "human_description" / "robots" / "human.urdf"
#: Takes the figure's axes to x forward, y left, z up.
_UPRIGHT = Rotation.from_euler("x", 90, degrees=True)
#: Shapes of the figure that the bust takes the place of.
_REPLACED = ("middle_abdomen", "middle_thorax", "middle_head", "left_upperarm_0", "right_upperarm_0")


def human_urdf() -> Path:
    """Where the human figure is installed.

    Returns
    -------
    Path

    Raises
    ------
    MissingExtra
        If it is not.

    Examples
    --------
    >>> from exo_pin.view import human_urdf
    >>> human_urdf().read_text().count("<link")  # parts of the figure
    37
    """
    for share in _shares():
        if (share / _URDF).is_file():
            return share / _URDF
    raise MissingExtra("human", _PACKAGE)


def _shares() -> Iterator[Path]:
    try:
        for file in importlib.metadata.files(_PACKAGE) or ():
            if file.name == "human.urdf":
                yield Path(str(file.locate())).parents[4]
    except importlib.metadata.PackageNotFoundError:
        pass  # a system package, perhaps
    for prefix in (*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix, "/usr/local", "/usr"):
        if prefix:
            yield Path(prefix) / "share"


class Human(OneProcess):
    """A person whose shoulder is at O and whose arm follows the pose.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    side : {"left", "right"}
        Which of its shoulders is the one.
    elbow_flexion : float
        rad.
    scale : float
        Stature over that of the figure.

    Raises
    ------
    MissingExtra
        If the figure is not installed.
    """

    PATH = "/meshcat/human"

    def __init__(self, stage: Stage, side: str, elbow_flexion: float, scale: float) -> None:
        urdf = human_urdf()
        share = str(urdf.parents[4])
        self._model = pin.buildModelFromUrdf(str(urdf))
        try:
            visuals = pin.buildGeomFromUrdf(self._model, str(urdf), pin.GeometryType.VISUAL, package_dirs=[share])
        except (RuntimeError, ValueError) as error:
            # An installation without its meshes.
            raise MissingExtra("human", _PACKAGE) from error
        for name in [shape.name for shape in visuals.geometryObjects if shape.name.startswith(_REPLACED)]:
            visuals.removeGeometryObject(name)
        for shape in visuals.geometryObjects:
            arm = shape.name.startswith((f"{side}_upperarm", f"{side}_lowerarm", f"{side}_hand"))
            bare = arm or "hand" in shape.name
            shape.meshColor = np.array([*(SKIN if bare else CLOTH), SEE_THROUGH if arm else 1.0])
        self._picture = stage.picture(self._model, visuals, "human")
        self._q = pin.neutral(self._model)
        joints = [self._model.joints[self._model.getJointId(f"{side}_shoulder_{axis}")] for axis in "ZXY"]
        self._index = [joint.idx_q for joint in joints]
        # A joint turns about the positive or the negative axis, given by its short name: RZ, or "about -x".
        turns = pin.computeJointJacobians(self._model, self._model.createData(), self._q)[3:]
        self._signs = np.sign(
            [turns["XYZ".index(axis), joint.idx_v] for axis, joint in zip("ZXY", joints, strict=True)]
        )
        elbow = self._model.joints[self._model.getJointId(f"{side}_elbow_Z")]
        self._q[elbow.idx_q] = elbow_flexion
        self._picture.display(self._q)
        pin.updateFramePlacements(self._model, self._picture.data)
        frame = self._model.getFrameId(f"{side}_upperarm")
        shoulder = self._picture.data.oMf[frame].translation
        turned = scale * _UPRIGHT.as_matrix()
        stage.set_transform(self.PATH, placement(turned, -turned @ shoulder))
        draw_bust(stage, side, scale)

    def show(self, poses: Rotation) -> None:
        """Turn the arm into a pose."""
        own = _UPRIGHT.inv() * poses * _UPRIGHT
        self._q[self._index] = self._signs * own.as_euler("ZXY", suppress_warnings=True)
        self._picture.display(self._q)


_BONE, _OTHER_ARM = (0.90, 0.87, 0.80), (0.85, 0.83, 0.79)
#: Parts of a muscle along its path: tendons at the ends are thin, the belly is thick. Radius over the belly's.
_PROFILE = np.array([0.34, 0.42, 0.62, 0.84, 0.97, 1.0, 0.97, 0.84, 0.62, 0.42, 0.34])
#: Specific tension, N/m² (Saul 2015), and the share of a muscle's volume that is drawn, so that bones stay in sight.
_TENSION, _DRAWN = 50.8e4, 0.30
#: Least top of the scale of activations; radius of the ball where the force passes through the socket, m; thickness of
#: the ring over its radius, and its height over the depth of the socket; and what is drawn so small is hidden.
_LEAST_TOP, _BALL, _RIM, _FLAT, _HIDDEN = 0.05, 0.0035, 0.10, 0.4, 1e-6


class WearerFigure(OneProcess):
    """Bones and muscles of a person whose shoulder is at O and whose arm follows the pose.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    person : Person
        Whose.

    Raises
    ------
    MissingExtra
        If the extra ``person`` is not installed.
    """

    PATH = "wearer"

    #: Top of the scale of activations; axes and depth of the socket.
    top: float
    _socket: tuple[FloatArray, float]

    def __init__(self, stage: Stage, person: Person) -> None:
        self._stage, self._person = stage, person
        other = "right" if person.side == "left" else "left"
        viewer = stage.viewer[self.PATH]
        meshes, mirrored = bone_meshes(person.side), bone_meshes(other)
        for name in BONES:
            viewer[f"bones/{name}"].set_object(mg.TriangularMeshGeometry(*meshes[name]), matt_material(_BONE))
            if name != "trunk":
                mesh = mg.TriangularMeshGeometry(*mirrored[name])
                viewer[f"other_arm/{name}"].set_object(mesh, matt_material(_OTHER_ARM))
        pieces = [_piece(low, high) for low, high in itertools.pairwise(_PROFILE)]
        for muscle in MUSCLES:
            for k, piece in enumerate(pieces):
                viewer[f"muscles/{muscle}/{k}"].set_object(piece, mg.MeshLambertMaterial(side=0))
        viewer["socket/rim"].set_object(_ring(), flat_material(SKY, on_top=True))
        viewer["socket/force"].set_object(mg.Sphere(1.0), flat_material(BLACK, on_top=True))
        for part in ("rim", "force"):
            stage.set_property(f"/meshcat/{self.PATH}/socket/{part}", "renderOrder", 9)
        self._volume = person.muscle_table.volume / _TENSION
        at_rest = limb_shape(np.eye(3), 0.0, 0.0, person.length_scale, other == "left").bones
        # Against the trunk, which both arms share.
        trunk = at_rest.pop("trunk")[:3, 3]
        self._other_arm = {name: placement(placed[:3, :3], placed[:3, 3] - trunk) for name, placed in at_rest.items()}

    def show(self, matrix: FloatArray) -> None:
        """Move bones, muscles and the rim of the socket into a pose, shape (3, 3)."""
        person = self._person
        angles, motion = (person.elbow_flexion, person.forearm_rotation), person.scapular_motion
        shape = limb_shape(matrix, *angles, person.length_scale, person.side == "left", motion)
        root = f"/meshcat/{self.PATH}"
        for name, placed in shape.bones.items():
            self._stage.set_transform(f"{root}/bones/{name}", placed)
        # The trunk moves against the shoulder's centre, and the other arm with it.
        for name, placed in self._other_arm.items():
            at = placed[:3, 3] + shape.bones["trunk"][:3, 3]
            self._stage.set_transform(f"{root}/other_arm/{name}", placement(placed[:3, :3], at))
        for muscle, path, volume in zip(MUSCLES, shape.paths, self._volume, strict=True):
            points, length = _resampled(path, len(_PROFILE))
            radius = np.sqrt(_DRAWN * volume / (np.pi * length * np.mean(_PROFILE**2)))
            for k in range(len(points) - 1):
                placed = segment(points[k], points[k + 1], radius)
                self._stage.set_transform(f"{root}/muscles/{muscle}/{k}", placed)
        self._show_socket(shape)

    @property
    def legend(self) -> list[dict[str, str]]:
        """What the ring at the socket is; the muscles have a bar of colours."""
        return [{"glyph": "ring", "colour": SKY, "text": "rim of the socket, and where the force passes"}]

    def plan(self, contacts: Sequence[PoseContact]) -> None:
        """Choose the top of the scale of activations for a pose or for all poses of a motion.

        It counts the arm without the device, so that colours show what the device takes over.
        """
        known = [each.most for each in contacts if np.isfinite(each.most)]
        self.top = min(max(round_up(max(known, default=1.0)), _LEAST_TOP), 1.0)

    def show_contact(self, contact: PoseContact | None) -> None:
        """Colour the muscles, grey where nothing is known, and mark where the force passes through the socket."""
        values = np.full(len(MUSCLES), np.nan) if contact is None else contact.activations
        for muscle, colour in zip(MUSCLES, scale_colours(values, 0.0, self.top, ACTIVATIONS), strict=True):
            self._stage.set_colour(f"/meshcat/{self.PATH}/muscles/{muscle}", [*colour, 1.0])
        axes, depth = self._socket
        ball = placement(_HIDDEN)
        if contact is not None and axes[0] @ contact.force > 0.0:
            ball = placement(_BALL, -depth * contact.force / (axes[0] @ contact.force))
        self._stage.set_transform(f"/meshcat/{self.PATH}/socket/force", ball)

    def _show_socket(self, shape: LimbShape) -> None:
        """Place the rim that the contact force stays inside: an ellipse in the plane of the socket."""
        outward, superior, anterior = shape.socket_axes
        depth = -float(outward @ shape.socket_centre)
        self._socket = shape.socket_axes, depth
        cone = GlenoidCone()
        ring = depth * np.column_stack([cone.anterior * anterior, cone.superior * superior, _FLAT * outward])
        self._stage.set_transform(f"/meshcat/{self.PATH}/socket/rim", placement(ring, -depth * outward))


def _piece(low: float, high: float) -> Any:
    """A part of a muscle between z = 0 and 1, with rounded ends that reach into its neighbours."""
    below, above = [[_HIDDEN, -0.12], [0.8 * low, -0.08]], [[0.8 * high, 1.08], [_HIDDEN, 1.12]]
    return lathe(np.array([*below, [low, 0.0], [high, 1.0], *above]), 10)


def _ring() -> Any:
    """A round bar along the unit circle about z; its thickness is that of the rim on a socket of common size."""
    turn = np.linspace(0.0, 2 * np.pi, 49)
    return mesh_of([tube(np.column_stack([np.cos(turn), np.sin(turn), np.zeros(49)]), _RIM, 8)])


def _resampled(path: FloatArray, count: int) -> tuple[FloatArray, float]:
    """Points at equal steps along a path, shape (count, 3), and its length."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, path[:, axis]) for axis in range(3)], axis=1), float(along[-1])


#: Height of the ground under O for the figure's own stature, and how far it reaches, m.
_GROUND, _GROUND_RADIUS = -1.385, 2.6


class Figure(OneProcess):
    """The one who wears the device.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    side : {"left", "right"}
        Which of its shoulders is at O.
    human : bool or None
        Whether somebody is drawn; None draws the mannequin where it is installed.
    worn_by : Wearer or None
        Whose height and bend of the elbow the mannequin has.
    person : Person or None
        Whose skeleton and muscles are drawn in place of the mannequin.

    Attributes
    ----------
    person : Person or None
        With the arm of this side.
    wearer : WearerFigure or None
        The skeleton.
    is_there : bool
        Whether somebody is drawn.
    scale : float
        Stature over that of the mannequin.
    notes : list of str
        What could not be drawn, and why.

    Raises
    ------
    MissingExtra
        If what is wanted is not installed.
    """

    def __init__(
        self, stage: Stage, side: str, human: bool | None, worn_by: Wearer | None, person: Person | None
    ) -> None:
        if person is not None:
            require_method("person", person, "joint_contact", "a Person")
        shown = worn_by if person is None else person
        self.person = None if person is None else person.on_side(side)
        self.wearer: WearerFigure | None = None
        self._human: Human | None = None
        self.is_there = human is not False
        self.scale = 1.0 if shown is None else shown.height / OWN_STATURE
        self.notes: list[str] = []
        if self.person is not None and self.is_there:
            # Without legs it stands on no ground.
            self.wearer = WearerFigure(stage, self.person)
            return
        draw_ground(stage, self.scale * _GROUND, _GROUND_RADIUS)
        if not self.is_there:
            return
        try:
            self._human = Human(stage, side, 0.0 if shown is None else shown.elbow_flexion, self.scale)
        except MissingExtra as error:
            if human:
                raise
            # A saved page is no place to install packages from.
            self.notes.append(f"chest and head alone: a human figure needs the extra {error.extra!r}")
            draw_bust(stage, side, self.scale)

    @property
    def has_arm(self) -> bool:
        """Whether it brings an arm of its own."""
        return self._human is not None or self.wearer is not None

    def show(self, poses: Rotation) -> None:
        """Turn the arm into a pose."""
        if self._human is not None:
            self._human.show(poses)
        if self.wearer is not None:
            self.wearer.show(poses.as_matrix())
