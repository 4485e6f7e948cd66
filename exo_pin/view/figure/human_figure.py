"""The person in the exoskeleton: the human figure of example-robot-data.

Its pelvis, legs, arms and hands are drawn; chest, neck, head and shoulders are those of :mod:`.bust`, because the
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

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ...core.errors import MissingExtra
from ...core.records import OneProcess
from ...core.validation import FloatArray
from ..stage.shapes import placement
from ..stage.stage import Stage
from .bust import CLOTH, SEE_THROUGH, SKIN, draw_bust

_PACKAGE = "example-robot-data"
_URDF = Path(_PACKAGE) / "robots" / "human_description" / "robots" / "human.urdf"
#: Takes the figure's axes to x forward, y left, z up.
_UPRIGHT = Rotation.from_euler("x", 90, degrees=True)
#: Shapes of the figure that the bust takes the place of.
_REPLACED = ("middle_abdomen", "middle_thorax", "middle_head", "left_upperarm_0", "right_upperarm_0")


def human_urdf() -> Path:
    """Where the human figure is installed.

    Raises
    ------
    MissingExtra
        If it is not.
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
        self._signs = np.array([self._sign(side, axis) for axis in "ZXY"])
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

    def _sign(self, side: str, axis: str) -> float:
        data = self._model.createData()
        q = pin.neutral(self._model)
        joint = self._model.getJointId(f"{side}_shoulder_{axis}")
        q[self._model.joints[joint].idx_q] = 0.1
        pin.forwardKinematics(self._model, data, q)
        turned: FloatArray = pin.log3(data.oMi[joint].rotation)
        return float(np.sign(turned["XYZ".index(axis)]))
