"""Conventions of orientations by the names of their columns: angles, quaternions, matrices, coordinates of OpenSim.

OpenSim's axes are x forward, y up, z right; a joint turns by body-fixed rotations about its three axes in turn. A
vector (x, y, z) of {O_A} is (x, z, -y) there. In all models below the arm hangs where every coordinate is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import isb_rotation, mirrored, shoulder_rotation, thesis_rotation
from ...core.errors import FileFormatError, InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray
from .sources import Source, as_quaternions

#: From {O_A} to OpenSim's axes, with x forward, y up, z right.
Y_UP = Rotation.from_euler("x", -90.0, degrees=True)
#: Axes of arm26 [Holzbaur] and of MoBL-ARMS, OpenSim's axes.
_ARM26 = np.array([-0.058898, 0.0023, 0.998261])
_PLANE, _RAISED = np.array([0.0048, 0.99909, 0.0424]), np.array([-0.99826, 0.0023, 0.0589])
#: Length that a unit quaternion may be off.
_UNIT = 1e-3


class Convention(NamedTuple):
    """How columns give an orientation.

    Attributes
    ----------
    name : str
        In words.
    columns : tuple of str
        Names, without a unit where ``angles``.
    build : callable
        (values in rad or plain, side) to Rotation.
    angles : bool
        Whether the columns are angles.
    """

    name: str
    columns: tuple[str, ...]
    build: Callable[[FloatArray, str], Rotation]
    angles: bool = True


def _clinical(values: FloatArray, side: str) -> Rotation:
    flexion, abduction, internal = values.T
    return shoulder_rotation(flexion, abduction, internal, side)


def _thesis(values: FloatArray, _: str) -> Rotation:
    return thesis_rotation(*values.T)


def _isb(values: FloatArray, side: str) -> Rotation:
    plane, elevation, axial = values.T
    return isb_rotation(plane, elevation, axial, side)


def _quaternion(values: FloatArray, _: str) -> Rotation:
    size = np.linalg.norm(values, axis=1)
    if np.abs(size - 1.0).max(initial=0.0) > _UNIT:
        raise InvalidInput(f"expected unit quaternions, got one of length {size[np.abs(size - 1).argmax()]:g}")
    return Rotation.from_quat(values)


def _matrix(values: FloatArray, _: str) -> Rotation:
    return Rotation.from_quat(as_quaternions(values.reshape(-1, 3, 3), None))  # type: ignore[arg-type]


def from_opensim(turn: Rotation) -> Rotation:
    """An orientation in OpenSim's axes as one of {O_B} to {O_A}."""
    return Y_UP.inv() * turn * Y_UP


def _about(axis: FloatArray, angle: FloatArray) -> Rotation:
    return Rotation.from_rotvec(np.multiply.outer(angle, axis / np.linalg.norm(axis)))


def _arm26(values: FloatArray, side: str) -> Rotation:
    if side != "right":
        raise InvalidInput('r_shoulder_elev of arm26 is of the right arm: read it with side="right" (--side right)')
    return from_opensim(_about(_ARM26, values[:, 0]))


def _rajagopal(values: FloatArray, side: str) -> Rotation:
    sign = 1.0 if side == "right" else -1.0
    return from_opensim(Rotation.from_euler("ZXY", values * np.array([1.0, sign, sign])))


def _mobl(values: FloatArray, side: str) -> Rotation:
    plane, raised, axial = values.T
    right = _about(_PLANE, plane) * _about(_RAISED, raised) * _about(_PLANE, axial - plane)
    return from_opensim(right) if side == "right" else mirrored(from_opensim(right))


#: The conventions; ``{side}`` is r or l.
CONVENTIONS = (
    Convention("clinical angles", ("flexion", "abduction", "internal_rotation"), _clinical),
    Convention("thesis angles (4-7)", ("theta_x", "theta_y", "theta_z"), _thesis),
    Convention("ISB angles", ("plane_of_elevation", "elevation", "axial_rotation"), _isb),
    Convention("quaternions", ("qx", "qy", "qz", "qw"), _quaternion, False),
    Convention("matrices", tuple(f"r{row}{column}" for row in "123" for column in "123"), _matrix, False),
)
#: Coordinates of models of OpenSim, whose unit is in the header.
MODELS = (
    Convention("coordinates of Rajagopal's model", ("arm_flex_{side}", "arm_add_{side}", "arm_rot_{side}"), _rajagopal),
    Convention("coordinates of MoBL-ARMS", ("elv_angle", "shoulder_elv", "shoulder_rot"), _mobl),
    Convention("coordinates of MoBL-ARMS", ("elv_angle_{side}", "shoulder_elv_{side}", "shoulder_rot_{side}"), _mobl),
    Convention("coordinates of arm26", ("r_shoulder_elev",), _arm26),
)
#: Names of the elbow's angle, flexion positive.
ELBOWS = ("elbow_flexion", "elbow_flex_{side}", "elbow_flexion_{side}", "{side}_elbow_flex")
_UNITS = {"_deg": np.pi / 180.0, "_rad": 1.0}


@dataclass(frozen=True, eq=False)
class Angles(Record):
    """Orientations of a table, before they are built.

    Attributes
    ----------
    convention : Convention
        Of the columns.
    values : ndarray
        Shape (N, k), as in the file, NaN where blank.
    scale : float
        Of the angles, to rad.
    elbow : ndarray or None
        Shape (N,), rad.
    """

    convention: Convention
    values: FloatArray
    scale: float
    elbow: FloatArray | None

    def poses(self, rows: np.ndarray, side: str, scale: float | None = None) -> Rotation:
        """Orientations of some rows; ``scale`` in place of the stated unit."""
        own = self.values[rows]
        factor = 1.0 if not self.convention.angles else self.scale if scale is None else scale
        return self.convention.build(own * factor, side) if len(own) else Rotation.identity(0)


def angles_of(source: Source, side: str) -> Angles | None:
    """The orientations that the columns of a table declare; None where it has none of the conventions.

    Raises
    ------
    FileFormatError
        If there are several, or coordinates of a model from which no orientation against the trunk follows.
    """
    names, found = set(source.names), []
    degrees = source.header.get("indegrees", "no").lower()
    of_model = _UNITS["_deg"] if degrees == "yes" else 1.0
    for convention in CONVENTIONS:
        for ending, scale in _UNITS.items() if convention.angles else {"": 1.0}.items():
            columns = [f"{name}{ending}" for name in convention.columns]
            if set(columns) <= names:
                found.append((convention, columns, scale))
    for convention in MODELS:
        columns = [name.format(side=side[0]) for name in convention.columns]
        if set(columns) <= names:
            found.append((convention, columns, of_model))
    if not found:
        _refuse_models(source, side)
        return None
    if len(found) > 1:
        raise FileFormatError(
            f"expected one of these sets of columns, of which it has {len(found)}: {known_columns()}; "
            f"got {', '.join(source.labels)}",
            source.path,
        )
    convention, columns, scale = found[0]
    return Angles(convention, source.numbers(columns), scale, _elbow(source, side, of_model))


def _elbow(source: Source, side: str, of_model: float) -> FloatArray | None:
    for name in (each.format(side=side[0]) for each in ELBOWS):
        for ending, scale in {**_UNITS, "": of_model}.items():
            if f"{name}{ending}" in source.names and (ending or "indegrees" in source.header):
                return np.asarray(source.numbers((f"{name}{ending}",))[:, 0] * scale)
    return None


def _refuse_models(source: Source, side: str) -> None:
    """Say why coordinates that are there are not read."""
    names, other = set(source.names), "left" if side == "right" else "right"
    if {"plane_elv", "axial_rot"} <= names:
        raise FileFormatError(
            "plane_elv, shoulder_elv and axial_rot of the thoracoscapular model turn the arm against the scapula, and "
            "its pose against the trunk needs that model: analyse it in OpenSim (BodyKinematics) and give the humerus",
            source.path,
        )
    if {f"arm_flex_{other[0]}", f"arm_add_{other[0]}", f"arm_rot_{other[0]}"} <= names:
        raise FileFormatError(
            f'has the coordinates of the {other} arm alone: read it with side="{other}" (--side {other})', source.path
        )


def known_columns() -> str:
    """The sets of columns, for messages."""
    sets: Sequence[str] = [
        ", ".join(f"{name}_deg" if each.angles else name for name in each.columns) for each in CONVENTIONS
    ]
    return "; ".join(sets) + " (angles also with _rad)"
