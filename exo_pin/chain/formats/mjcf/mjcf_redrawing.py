"""A compiled MuJoCo model with other places and directions that its file would have written with the same digits."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ....core.validation import FloatArray
from ..rounding.rounded_numbers import Redrawn

#: Fields that are places, which the compiled model has as they are written.
_PLACES = ("body_pos", "jnt_pos", "site_pos")
#: Fields that are quaternions.
_TURNS = ("body_quat", "site_quat")
#: Largest error of a quaternion that is meant to be a multiple of a right angle about an axis.
_SQUARE = 1e-14


def redrawn(model: Any, digits: Redrawn, rounding: float) -> Any:
    """A copy of a mjModel with its bodies, joints, sites and equalities moved.

    How a direction was written is lost: it is turned by up to the rounding about any axis, unless it is along the axes.

    Parameters
    ----------
    model : mujoco.MjModel
        Not changed.
    digits : Redrawn
        Moves places.
    rounding : float
        Half a unit of the last decimal of the file, m and rad.
    """
    other = copy.copy(model)
    for name in _PLACES:
        values = getattr(other, name)
        values[:] = [[float(digits.number(repr(value))) for value in row] for row in values.tolist()]
    for name in _TURNS:
        for row in getattr(other, name):
            row[:] = _turned(row, digits, rounding)
    for axis in other.jnt_axis:
        if np.count_nonzero(axis) > 1:
            axis[:] = _turn(digits, rounding).apply(axis)
    for row in other.eq_data:
        row[:6] = [float(digits.number(repr(value))) for value in row[:6].tolist()]
    return other


def _turn(digits: Redrawn, rounding: float) -> Rotation:
    return Rotation.from_rotvec(digits.rng.uniform(-rounding, rounding, 3))


def _turned(quaternion: FloatArray, digits: Redrawn, rounding: float) -> FloatArray:
    """A quaternion with its scalar first, turned; as it is if it is a multiple of a right angle about an axis."""
    squares = np.square(quaternion)
    if np.abs(squares * (squares - 0.5) * (squares - 1.0)).max() < _SQUARE:
        return quaternion
    turned = _turn(digits, rounding) * Rotation.from_quat(quaternion, scalar_first=True)
    return np.asarray(turned.as_quat(scalar_first=True))
