"""What of a design is drawn, and from where it is looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...core.validation import FloatArray
from ..stage.force_arrows import GOOD_LENGTH
from ..stage.stage import seen_along, widened

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

#: The camera's field of view that the default distance goes with, and how much more than the chain it shows.
_HALF_VIEW, _ROOM = np.radians(16.0), 1.35
#: A chain that is thinner than this share of its size is looked at from its flat side.
_FLAT = 0.08


def viewpoint(
    exo: ShoulderExo, corners: FloatArray, figure: bool, towards: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, list[float]]:
    """Camera, target and extents of a device with these corners, (k, 3), on a figure or alone; maybe from a side."""
    outward = 1.0 if exo.side == "left" else -1.0
    # Before the shoulder and outside of it, a little from above.
    away = np.array([1.04, 1.32 * outward, 0.42])
    if towards is not None:
        away = np.linalg.norm(away) * towards / np.linalg.norm(towards)
    arm, points = exo.device.arm, [corners]
    if figure:
        # Head and elbow are in the picture.
        target, extent = np.array([0.05, -0.04 * outward, -0.02]), (0.36, 0.46)
    else:
        target, extent = np.array([0.05, 0.02 * outward, -0.06]), (0.28, 0.32)
        points += [] if arm is None else [arm.centre_of_mass[None] - np.array([0.0, 0.0, GOOD_LENGTH])]
    target, shown = widened(np.concatenate(points), target, away, extent)
    return target + away, target, shown


def drawable(exo: ShoulderExo) -> tuple[ShoulderExo, list[str]]:
    """The device; of a wrist whose robot is no device its limbs alone, and a note about them."""
    if exo.has_arm or exo.wrist is None:
        # Of a robot that is no device the error says what it lacks.
        _ = exo.device
        return exo, []
    return type(exo).from_device(exo.wrist.limbs_alone()), ["no forces: the robot is no device"]


def viewpoint_of_points(
    points: FloatArray, size: float, side: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, list[float]]:
    """Camera, target and extents of a chain of a size, m, whose corners are ``points``, shape (n, 3), m."""
    target = (points.min(axis=0) + points.max(axis=0)) / 2
    spread, axes = np.linalg.eigh(np.cov(points.T))
    towards = np.array([1.3, 1.25, 0.7])
    if side is not None:
        towards = side.copy()
    elif spread[0] < _FLAT**2 * spread[2]:
        # From the side that shows, a little aside so that depth is visible; a flat one that lies has its y upwards.
        flat = axes[:, 0] * np.sign(axes[np.abs(axes[:, 0]).argmax(), 0])
        towards = flat + 0.15 * np.array([0.0, -1.0, 0.3])
    towards /= np.linalg.norm(towards)
    away = _ROOM * size / 2 / np.sin(_HALF_VIEW)
    aside, above = (float(np.abs((points - target) @ axis).max()) for axis in seen_along(towards))
    room = 0.12 * size
    return target + away * towards, target, [aside + room, above + room]
