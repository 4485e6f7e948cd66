"""From one orientation to another about one axis: the shortest way on the rotation group."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.fields import set_positive
from ...core.validation import FloatArray, as_finite, as_single_rotation
from .reference import Trajectory
from .time_laws import TimeLaw, as_time_law

__all__ = ["Turn", "point_to_point"]

#: More than three turns, rad, is an angle in degrees.
_LARGEST_TURN = 6.0 * np.pi
#: Turns this near to half a turn, rad, have no shortest way.
_HALF_TURN = np.pi - 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Turn(Trajectory):
    """A turn about an axis that is fixed in the base frame: R(t) = exp(s(t) d) R_0, ω = ṡ d, η = s̈ d.

    Attributes
    ----------
    first : Rotation
        R_0, single.
    rotation_vector : ndarray
        d, shape (3,), rad, base frame; it may be longer than half a turn. Zero holds the orientation.
    duration : float
        s.
    law : TimeLaw or str
        s(t); minimum jerk if left out.
    title : str
        What it is.
    """

    first: Rotation
    rotation_vector: FloatArray | ArrayLike
    duration: float
    law: TimeLaw | str = "minimum_jerk"
    title: str = ""

    def __post_init__(self) -> None:
        as_single_rotation("first", self.first)
        vector = as_finite("rotation_vector", self.rotation_vector, (3,))
        if np.linalg.norm(vector) > _LARGEST_TURN:
            raise InvalidInput(f"expected rotation_vector in rad, got {vector.tolist()} (degrees?)")
        object.__setattr__(self, "rotation_vector", vector)
        set_positive(self, "duration")
        object.__setattr__(self, "law", as_time_law(self.law))

    def _states(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        law, d = as_time_law(self.law), np.asarray(self.rotation_vector)
        s, rate, change = law.values(t, self.duration)
        turned = Rotation.from_rotvec(s[:, None] * d) * self.first
        return turned.as_quat(), rate[:, None] * d, change[:, None] * d


def point_to_point(
    start: Rotation, end: Rotation, duration: float, law: TimeLaw | str = "minimum_jerk", title: str = ""
) -> Turn:
    """Move from one orientation to another the shortest way.

    Parameters
    ----------
    start, end : Rotation
        Single, less than half a turn apart.
    duration : float
        s.
    law : TimeLaw or {"minimum_jerk", "constant_speed"}
        How the movement proceeds.
    title : str
        What it is.

    Returns
    -------
    Turn

    Raises
    ------
    InvalidInput
        If start and end are half a turn apart, where two ways are equally short.
    """
    vector = (as_single_rotation("end", end) * as_single_rotation("start", start).inv()).as_rotvec()
    if np.linalg.norm(vector) > _HALF_TURN:
        raise InvalidInput("start and end are half a turn apart: give a Turn with its rotation_vector")
    return Turn(start, vector, duration, law, title)
