"""The movements of the thesis's tests, and synthetic daily tasks.

Trajectories of daily tasks were measured by van Andel et al. (Gait & Posture 27, 2008, 120), the thesis's reference
[109]; they are not printed there and none is shipped. What :func:`daily_task` makes is synthetic: it fills a published
range of angles, no more.
"""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import as_side
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice, as_finite, as_positive
from ...load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES
from .paths import AnglePath, Turn

#: Published ranges of shoulder angles that synthetic tasks are made from.
DAILY_TASKS = MappingProxyType(
    {
        "feeding": DAILY_RANGES[2],
        "ten-daily-tasks": DAILY_RANGES[0],
        "daily-tasks": DAILY_RANGES[1],
        "daily-life-box": ADL_BOX,
    }
)


def abduction(angle: float = np.pi / 2, duration: float = 5.0, law: str = "constant_speed", side: str = "left") -> Turn:
    """Raise the arm sideways from rest, the first test of 5.4.1: θ_x from 0 to 90° in 5 s at constant speed.

    The thesis states constant speed and no ramps; at start and end the speed then jumps.
    With ``"minimum_jerk"`` it does not.

    Parameters
    ----------
    angle : float
        Abduction at the end, rad.
    duration : float
        s.
    law : {"constant_speed", "minimum_jerk"}
        How the movement proceeds.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    Turn
    """
    outward = 1.0 if as_side(side) == "left" else -1.0
    return _from_rest(angle, np.array([outward, 0.0, 0.0]), duration, law, "abduction")


def flexion(angle: float = np.pi / 2, duration: float = 5.0, law: str = "constant_speed", side: str = "left") -> Turn:
    """Raise the arm forward from rest, the second test of 5.4.1: θ_y from 0 to -90° in 5 s at constant speed.

    Parameters as in :func:`abduction`; ``angle`` is the flexion at the end, positive forward.

    Returns
    -------
    Turn
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

    Minimum jerk from waypoint to waypoint, so that every angle stays within its range once the arm has got there.
    Waypoints are the arm hanging, the corner with the lowest angles, the one with the highest, and back.

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
    """
    box = DAILY_TASKS[as_choice("daily task", name, DAILY_TASKS)]
    low, high = np.radians(np.array(box.intervals)).T
    hanging = np.zeros(3)
    waypoints = np.stack([hanging, low, high, low, hanging])
    times = np.linspace(0.0, as_positive("duration", duration), len(waypoints))
    title = f"synthetic task, corner to corner, within the range of {box.name}"
    return AnglePath(times, waypoints, as_side(side), "minimum_jerk", title)
