"""Paths from rest to rest: turns about a fixed axis, paths through clinical angles, tests and tasks made of them.

How far along a path the arm is, s from 0 to 1 over the share of the time:

* ``"constant_speed"``: s = τ with τ = t/T, without ramps: the speed jumps at both ends, where no arm can follow it.
* ``"minimum_jerk"``: s = 10 τ³ - 15 τ⁴ + 6 τ⁵, which has the least ∫ (d³s/dt³)² dt of all that start and end at rest;
  the peak speed is 15/8 of the mean speed.

Thesis Section 5.4.1 for constant speed; T. Flash, N. Hogan, J. Neurosci. 5 (1985) 1688 for minimum jerk.

Trajectories of daily tasks were measured by van Andel et al. (Gait & Posture 27, 2008, 120), the thesis's reference
[109]; they are not printed there and none is shipped: :func:`daily_task` is synthetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.conventions import Side, as_side
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice, as_finite, as_positive, as_single_rotation, set_positive
from ...load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES
from .reference import Trajectory

#: Names of the laws.
TIME_LAWS = ("constant_speed", "minimum_jerk")
#: More than three turns, rad, is an angle in degrees.
_LARGEST_TURN = 6.0 * np.pi
#: Angles beyond this, rad, were given in degrees.
_LARGEST = 2.0 * np.pi + 1e-9
#: Waypoints nearer in time than this, s, are one.
_SHORTEST = 1e-6
#: Published ranges of shoulder angles that synthetic tasks are made from.
DAILY_TASKS = MappingProxyType(
    {
        "feeding": DAILY_RANGES[2],
        "ten-daily-tasks": DAILY_RANGES[0],
        "daily-tasks": DAILY_RANGES[1],
        "daily-life-box": ADL_BOX,
    }
)


def progress(law: str, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """S, ds/dτ and d²s/dτ², shape (N,) each, at shares τ of the time from 0 to 1, shape (N,), by a name of the laws."""
    if law == "constant_speed":
        return x.copy(), np.ones_like(x), np.zeros_like(x)
    s = x**3 * (10.0 + x * (6.0 * x - 15.0))
    rate = 30.0 * x**2 * (1.0 - x) ** 2
    return s, rate, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)


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
        s(t), see ``progress``.
    title : str
        What it is.

    Examples
    --------
    >>> from exo_pin import control
    >>> turn = control.Turn(ep.load("four-cables").pose(), [0.0, -np.pi / 2, 0.0], 2.0)
    >>> round(float(np.linalg.norm(turn(1.0).angular_velocity) / (np.pi / 4)), 3)  # least jerk: 15/8 of the mean speed
    1.875
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


@dataclass(frozen=True, eq=False, repr=False)
class AnglePath(Trajectory):
    """Clinical angles from waypoint to waypoint, with minimum jerk at rest at each.

    Between two waypoints all three angles follow the same law, so none of them leaves the interval between its two
    values. Angles describe the path only; R, ω and η come from the product of the three turns and are exact also
    where the angles lock (90° of abduction).

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

    Examples
    --------
    >>> from exo_pin import control
    >>> path = control.AnglePath([0.0, 2.0, 3.0], np.radians([[0, 0, 0], [0, 60, 0], [0, 60, 30]]))
    >>> path.duration, ep.shoulder_angles(path(2.0).orientation, degrees=True).round(3).tolist()
    (3.0, [0.0, 60.0, 0.0])
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
        """Clinical angles and their first two derivatives at times from 0 to ``duration``, shape (N, 3) each.

        Parameters
        ----------
        t : ndarray
            Shape (N,), s.

        Returns
        -------
        tuple of ndarray
            Shape (N, 3) each, rad, rad/s and rad/s².

        Examples
        --------
        >>> from exo_pin.control import AnglePath
        >>> path = AnglePath([0.0, 2.0], np.radians([[0, 0, 0], [90, 0, 0]]))
        >>> angles, rates, _ = path.angles_at(np.array([1.0]))
        >>> np.rad2deg([angles[0, 0], rates[0, 0]]).round(3)  # degrees, and a second: 15/8 of the mean speed
        array([45.   , 84.375])
        """
        times, angles = np.asarray(self.times), np.asarray(self.angles)
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        span = times[k + 1] - times[k]
        s, rate, change = progress(self.law, (t - times[k]) / span)
        step = angles[k + 1] - angles[k]
        return (angles[k] + s[:, None] * step, (rate / span)[:, None] * step, (change / span**2)[:, None] * step)

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


def abduction(angle: float = np.pi / 2, duration: float = 5.0, law: str = "constant_speed", side: str = "left") -> Turn:
    """Raise the arm sideways from rest, the first test of 5.4.1: θ_x from 0 to 90° in 5 s at constant speed.

    Parameters
    ----------
    angle : float
        Abduction at the end, rad, positive outward on either side of the body.
    duration : float
        From rest to the end, s.
    law : {"constant_speed", "minimum_jerk"}
        How the movement proceeds.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    Turn

    Examples
    --------
    >>> from exo_pin import control
    >>> reference = control.abduction()  # 0 to 90° in 5 s
    >>> ep.shoulder_angles(reference(2.5).orientation, degrees=True).round(3) + 0.0
    array([ 0., 45.,  0.])
    """
    outward = 1.0 if as_side(side) == "left" else -1.0
    return _from_rest(angle, np.array([outward, 0.0, 0.0]), duration, law, "abduction")


def flexion(angle: float = np.pi / 2, duration: float = 5.0, law: str = "constant_speed", side: str = "left") -> Turn:
    """Raise the arm forward from rest, the second test of 5.4.1: θ_y from 0 to -90° in 5 s at constant speed.

    Parameters
    ----------
    angle : float
        Flexion at the end, rad, positive forward.
    duration, law, side
        Of the movement (s) and of the body, as for :func:`abduction`.

    Returns
    -------
    Turn

    Examples
    --------
    >>> from exo_pin import control
    >>> np.degrees(control.flexion()(1.0).angular_velocity).round(3) + 0.0  # about -y
    array([  0., -18.,   0.])
    """
    as_side(side)
    return _from_rest(angle, np.array([0.0, -1.0, 0.0]), duration, law, "flexion")


def _from_rest(angle: float, axis: FloatArray, duration: float, law: str, name: str) -> Turn:
    value = float(as_finite("angle", angle, ()))
    if abs(value) > np.pi:
        raise InvalidInput(f"expected angle in rad within half a turn, got {value:g} (degrees?)")
    return Turn(Rotation.identity(), value * axis, duration, law, f"{name} to {np.degrees(value):g} degrees")


def daily_task(name: str = "feeding", duration: float = 10.0, side: str = "left") -> AnglePath:
    """A synthetic daily task within a published range of angles; no measured trajectory.

    Minimum jerk between the arm hanging, the corner with the lowest angles, the one with the highest, and back, so that
    every angle stays within its range once the arm has got there.

    Parameters
    ----------
    name : str
        Of :data:`DAILY_TASKS`.
    duration : float
        Of it all, s, shared equally between the waypoints.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    AnglePath
        Its title says that it is synthetic, and names the source of the range.

    Raises
    ------
    UnknownName
        If there is no such range.

    Examples
    --------
    >>> from exo_pin import control
    >>> sorted(control.DAILY_TASKS)[:2]
    ['daily-life-box', 'daily-tasks']
    """
    box = DAILY_TASKS[as_choice("daily task", name, DAILY_TASKS)]
    low, high = np.radians(np.array(box.intervals)).T
    hanging = np.zeros(3)
    waypoints = np.stack([hanging, low, high, low, hanging])
    times = np.linspace(0.0, as_positive("duration", duration), len(waypoints))
    title = f"synthetic task, corner to corner, within the range of {box.name}"
    return AnglePath(times, waypoints, as_side(side), "minimum_jerk", title)
