"""Turns about one axis that is fixed in the base frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.fields import set_positive
from ...core.validation import FloatArray, as_choice, as_finite, as_single_rotation
from .reference import Trajectory
from .time_laws import TIME_LAWS, progress

#: More than three turns, rad, is an angle in degrees.
_LARGEST_TURN = 6.0 * np.pi


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
    law : {"minimum_jerk", "constant_speed"}
        s(t), see :func:`exo_pin.control.trajectories.time_laws.progress`.
    title : str
        What it is.
    """

    first: Rotation
    rotation_vector: FloatArray | ArrayLike
    duration: float
    law: str = "minimum_jerk"
    title: str = ""

    def __post_init__(self) -> None:
        as_single_rotation("first", self.first)
        vector = as_finite("rotation_vector", self.rotation_vector, (3,))
        if np.linalg.norm(vector) > _LARGEST_TURN:
            raise InvalidInput(f"expected rotation_vector in rad, got {vector.tolist()} (degrees?)")
        object.__setattr__(self, "rotation_vector", vector)
        set_positive(self, "duration")
        as_choice("time law", self.law, TIME_LAWS)

    def _states(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        d = np.asarray(self.rotation_vector)
        s, rate, change = progress(self.law, t / self.duration)
        turned = Rotation.from_rotvec(s[:, None] * d) * self.first
        return turned.as_quat(), (rate / self.duration)[:, None] * d, (change / self.duration**2)[:, None] * d
