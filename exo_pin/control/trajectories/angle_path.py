"""Movements from rest to rest through clinical shoulder angles: each angle by its own, within a box of angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.conventions import Side, as_side
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice, as_finite
from .reference import Trajectory
from .time_laws import TIME_LAWS, progress

#: Angles beyond this, rad, were given in degrees.
_LARGEST = 2.0 * np.pi + 1e-9
#: Waypoints nearer in time than this, s, are one.
_SHORTEST = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class AnglePath(Trajectory):
    """Clinical angles from waypoint to waypoint, with minimum jerk at rest at each.

    Between two waypoints all three angles follow the same law, so none of them leaves the interval between its two
    values: a path between waypoints of a box stays in the box. Angles describe the path only; R, ω and η come from the
    product of the three turns and are exact also where the angles lock (90° of abduction).

    Attributes
    ----------
    times : ndarray
        Shape (N,), s, from 0, rising.
    angles : ndarray
        Shape (N, 3), rad: flexion, abduction, internal rotation at the waypoints, positive as named
        (:func:`exo_pin.shoulder_rotation`).
    side : {"left", "right"}
        Side of the body.
    law : {"minimum_jerk", "constant_speed"}
        Between two waypoints.
    title : str
        What it is.
    """

    times: FloatArray | ArrayLike
    angles: FloatArray | ArrayLike
    side: Side = "left"
    law: str = "minimum_jerk"
    title: str = ""

    def __post_init__(self) -> None:
        times, angles = as_finite("times", self.times, (None,)), as_finite("angles", self.angles, (None, 3))
        if len(times) != len(angles) or len(times) < 2:
            raise InvalidInput(f"expected one time for each of two or more waypoints, got {len(times)}, {len(angles)}")
        if times[0] != 0.0 or not (np.diff(times) > _SHORTEST).all():
            raise InvalidInput(f"expected times in s that start at 0 and rise, got {times}")
        if np.abs(angles).max() > _LARGEST:
            raise InvalidInput(f"expected angles in rad, got {np.abs(angles).max():g} (degrees?)")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "angles", angles)
        object.__setattr__(self, "side", as_side(self.side))
        as_choice("time law", self.law, TIME_LAWS)

    @property
    def duration(self) -> float:  # type: ignore[override]
        """s."""
        return float(np.asarray(self.times)[-1])

    def angles_at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Clinical angles and their first two derivatives at times from 0 to ``duration``, shape (N, 3) each."""
        times, angles = np.asarray(self.times), np.asarray(self.angles)
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        span = times[k + 1] - times[k]
        s, rate, change = progress(self.law, (t - times[k]) / span)
        step = angles[k + 1] - angles[k]
        return (
            angles[k] + s[:, None] * step,
            (rate / span)[:, None] * step,
            (change / span**2)[:, None] * step,
        )

    def _states(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        outward = 1.0 if self.side == "left" else -1.0
        # Of shoulder_rotation: Ry(-flexion) Rx(abduction) Rz(-internal) on the left side.
        turns = [values * np.array([-1.0, outward, -outward]) for values in self.angles_at(t)]
        pose = Rotation.identity(len(t))
        velocity, acceleration = np.zeros((len(t), 3)), np.zeros((len(t), 3))
        for k, axis in enumerate((np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))):
            direction = pose.apply(axis)
            own = turns[1][:, k, None] * direction
            acceleration += turns[2][:, k, None] * direction + np.cross(velocity, own)
            velocity += own
            pose = pose * Rotation.from_rotvec(turns[0][:, k, None] * axis)
        return pose.as_quat(), velocity, acceleration
