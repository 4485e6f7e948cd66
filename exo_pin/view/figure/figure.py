"""Who wears the device in the scene: the wearer's skeleton, the mannequin, chest and head alone, or nobody.

The mannequin is the human figure of example-robot-data.
Its pelvis, legs, arms and hands are drawn; chest, neck, head and shoulders are those of :func:`draw_bust`, because the
figure has neither neck nor face and a gap at the shoulder. The package ships data and no loader. The figure is Y-up (x
forward, z to its right) and its shoulders turn about Z, X and Y in that order; the signs of the axes are read from the
URDF. It can be scaled to a person's stature, as a whole. Its Euler angles are made here, at the edge, and no result
depends on them.
"""

from __future__ import annotations

import importlib.metadata
import os
import sys
from collections.abc import Iterator
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
from ..stage.shapes import draw_ground, loft, matt_material, placement
from ..stage.stage import Stage, mg

if TYPE_CHECKING:
    from ...design import Wearer
    from ...person import Person
    from .wearer_figure import WearerFigure


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
            from .wearer_figure import WearerFigure  # here, because it needs an extra

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
            self.notes.append(f"chest and head alone, no human figure: {error}")
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
