"""Wrenches of joints and closures about any point and in any axes.

Wrenches are columns: shape (6, sets), force above moment, N and N m.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import UnknownName
from ...core.validation import FloatArray, as_finite
from .equations_of_motion import EquationsOfMotion

__all__ = ["axes_and_point", "own_frame", "shifted", "turned"]


def own_frame(equations: EquationsOfMotion, index: int) -> tuple[FloatArray, FloatArray]:
    """Point (3,) and axes (3, 3), as rows, of a joint or closure, by :attr:`Part.place`.

    A joint's are those of its child link; a closure's point is frame b's origin and its axes are those of frame a.
    """
    joints = len(equations.poses) - 1
    if index >= joints:
        return equations.closure_frame(index - joints)
    pose = equations.poses[1 + index]
    return pose[3], pose[:3]


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
    frames = equations.state.frames
    if not isinstance(name, str) or name not in frames:
        raise UnknownName(what, name, (*others, *frames))
    frame = equations.state.model.frames[frames[name]]
    pose = equations.poses[frame.parentJoint]
    return frame.placement.translation @ pose[:3] + pose[3], frame.placement.rotation.T @ pose[:3]
