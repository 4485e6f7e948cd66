"""Wrenches of joints and closures about any point and in any axes.

Wrenches are columns: shape (6, sets), force above moment, N and N m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.records import Record
from ...core.validation import FloatArray, as_finite
from ..structure.topology import Topology
from .equations_of_motion import EquationsOfMotion

_COMPONENTS = ("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")


@dataclass(frozen=True, eq=False)
class JointReaction(Record):
    """Wrench that a joint or closure transmits, and which components equilibrium determines; prints as a table.

    Attributes
    ----------
    name : str
        Of the joint or closure.
    on : str
        The body that receives it.
    wrench : ndarray
        Shape (6,), force and moment, N and N m.
    unique : ndarray of bool
        Shape (6,): which components are the same in every solution of the equations of motion (Wojtyra's criterion:
        no self-stress of the chain changes them).
    directions : ndarray
        Shape (6, r), the directions in which the wrench may change without any motion: the image of the
        chain's self-stresses, orthonormal with moments divided by the characteristic length. r = 0 if it is unique.
    interval : ndarray
        Shape (6, 2), least and largest value of each component within the bounds; infinite where it is not bounded,
        twice the value where it is unique.
    """

    name: str
    on: str
    wrench: FloatArray
    unique: NDArray[np.bool_]
    directions: FloatArray
    interval: FloatArray

    @property
    def force(self) -> FloatArray:
        """Shape (3,), N."""
        return self.wrench[:3]

    @property
    def moment(self) -> FloatArray:
        """Shape (3,), N m, about the point given as ``at``."""
        return self.wrench[3:]

    @property
    def undetermined(self) -> int:
        """Number of independent directions in which the wrench is undetermined."""
        return self.directions.shape[1]

    def __str__(self) -> str:
        lines = [f"{self.name} on {self.on}"]
        for k, name in enumerate(_COMPONENTS):
            low, high = self.interval[k]
            reach = "can be any number" if np.isinf([low, high]).all() else f"from {low:.6g} to {high:.6g}"
            note = "unique" if self.unique[k] else f"undetermined, {reach}"
            # Rounded first, so that no -0.000000 is printed.
            lines.append(f"{name} {round(float(self.wrench[k]), 6) + 0.0:14.6f} {'N' if k < 3 else 'N m':4} {note}")
        return "\n".join(lines)


def own_frame(equations: EquationsOfMotion, index: int) -> tuple[FloatArray, FloatArray]:
    """Point (3,) and axes (3, 3), as rows, of a joint or closure, by :attr:`Part.place`.

    A joint's are those of its child link; a closure's point is frame b's origin and its axes are those of frame a.
    """
    joints = len(equations.poses) - 1
    if index >= joints:
        return closure_frame(equations.state.topology, equations.poses, index - joints)
    pose = equations.poses[1 + index]
    return pose[3], pose[:3]


def closure_frame(top: Topology, poses: FloatArray, index: int) -> tuple[FloatArray, FloatArray]:
    """A closure's point p_b and the axes of frame a, as rows; ``poses`` of joints as in :class:`EquationsOfMotion`."""
    (joint_a, joint_b), (local_a, local_b) = top.joints[index], top.local[index]
    point = local_b[3] @ poses[joint_b, :3] + poses[joint_b, 3]
    return point, local_a[:3] @ poses[joint_a, :3]


def shifted(wrenches: FloatArray, by: FloatArray) -> FloatArray:
    """Wrenches about a point that is ``by``, shape (3,), m, beyond theirs."""
    x, y, z = by
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.vstack([wrenches[:3], wrenches[3:] - cross @ wrenches[:3]])


def turned(wrenches: FloatArray, axes: FloatArray) -> FloatArray:
    """Wrenches in axes that are given as rows, shape (3, 3)."""
    return np.vstack([axes @ wrenches[:3], axes @ wrenches[3:]])


def axes_and_point(
    equations: EquationsOfMotion, own: tuple[FloatArray, FloatArray], at: str | ArrayLike, in_frame: str
) -> tuple[FloatArray, FloatArray]:
    """Point and axes in which a wrench is to be expressed.

    Parameters
    ----------
    own : tuple of ndarray
        Point (3,) and axes (3, 3), as rows.
    at : str or array_like
        "origin" for the own point, a frame's name for its origin, or a point (3,), m, world frame.
    in_frame : str
        "world", "local" for the own axes, or a frame's name.

    Raises
    ------
    UnknownName
        If a frame is not known.
    """
    names: tuple[Literal["origin", "world", "local"], ...] = ("origin", "world", "local")
    point, axes = own
    if isinstance(at, str):
        if at != "origin":
            point = _frame_pose(equations, at, "point or frame", names[:1])[0]
    else:
        point = as_finite("at", at, (3,))
    if in_frame == "world":
        return point, np.eye(3)
    return point, axes if in_frame == "local" else _frame_pose(equations, in_frame, "frame", names[1:])[1]


def _frame_pose(
    equations: EquationsOfMotion, name: str, what: str, others: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    frame = equations.state.model.frames[equations.state.frames.find(what, name, others=others)]
    pose = equations.poses[frame.parentJoint]
    return frame.placement.translation @ pose[:3] + pose[3], frame.placement.rotation.T @ pose[:3]
