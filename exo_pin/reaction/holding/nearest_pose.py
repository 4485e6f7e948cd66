"""The nearest pose that the device can hold.

The search runs along great circles of the rotation group from the given pose, in directions spread evenly over the
sphere, and then shrinks the turn by a direct search around the best of them. The result is a pose that was checked; a
nearer one between two directions may have been missed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray
from .hold_check import HoldCheck

__all__ = ["NearestPose", "nearest_held_pose", "spread_directions"]

#: Directions of the search, and the step along each, rad.
_DIRECTIONS = 96
_STEP = np.radians(2.0)
#: Directions that are refined.
_REFINED = 3


class NearestPose(NamedTuple):
    """A pose that can be held.

    Attributes
    ----------
    pose : Rotation
        Single.
    distance : float
        Angle by which the arm must turn, rad.
    check : HoldCheck
        Of that pose.
    """

    pose: Rotation
    distance: float
    check: HoldCheck


def nearest_held_pose(
    check: Callable[[Rotation], HoldCheck], orientation: Rotation, reach: float = np.radians(60.0)
) -> NearestPose | None:
    """The nearest pose in which no limit is violated.

    Parameters
    ----------
    check : callable
        Gives the :class:`HoldCheck` of a stack of poses.
    orientation : Rotation
        Single.
    reach : float
        How far to search, rad.

    Returns
    -------
    NearestPose or None
        None if the search found no such pose.
    """
    angles = np.arange(_STEP, reach + 0.5 * _STEP, _STEP)
    directions = spread_directions(_DIRECTIONS)
    turns = directions[:, None] * angles[None, :, None]
    held = _held(check(Rotation.from_rotvec(turns.reshape(-1, 3)) * orientation)).reshape(turns.shape[:2])
    first = np.where(held.any(axis=1), held.argmax(axis=1), len(angles))
    order = np.argsort(first, kind="stable")[:_REFINED]
    candidates = [turns[k, first[k]] for k in order if first[k] < len(angles)]
    if not candidates:
        return None
    best = min((_shrunk(check, orientation, turn) for turn in candidates), key=lambda turn: float(turn @ turn))
    pose = Rotation.from_rotvec(best) * orientation
    return NearestPose(pose, float(np.linalg.norm(best)), check(pose))


def _held(check: HoldCheck) -> np.ndarray:
    return np.asarray(~check.violated & (check.can_hold | check.unknown))


def _shrunk(check: Callable[[Rotation], HoldCheck], orientation: Rotation, start: FloatArray) -> FloatArray:
    """A shorter rotation vector that still leads to a pose that can be held, by direct search from ``start``."""
    from scipy.optimize import minimize  # here, because its import takes long

    best = start

    def cost(turn: FloatArray) -> float:
        nonlocal best
        if not _held(check(Rotation.from_rotvec(turn) * orientation)):
            return 10.0 + float(np.linalg.norm(turn - start))
        if turn @ turn < best @ best:
            best = turn.copy()
        return float(np.linalg.norm(turn))

    minimize(
        cost, start, method="Nelder-Mead", options={"initial_simplex": _simplex(start), "xatol": 1e-4, "fatol": 1e-5}
    )
    return best


def _simplex(start: FloatArray) -> FloatArray:
    """The start, and three points a step away: one nearer to zero, two beside."""
    unit = start / np.linalg.norm(start)
    beside = np.cross(unit, np.eye(3)[np.abs(unit).argmin()])
    beside /= np.linalg.norm(beside)
    return start + _STEP * np.array([np.zeros(3), -unit, beside, np.cross(unit, beside)])


def spread_directions(count: int) -> FloatArray:
    """Unit vectors spread evenly over the sphere (a Fibonacci lattice), shape (count, 3)."""
    k = np.arange(count) + 0.5
    z, azimuth = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    radius = np.sqrt(1.0 - z**2)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1)
