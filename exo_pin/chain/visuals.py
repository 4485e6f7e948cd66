"""What the mechanism looks like: cylinders and balls, so that a URDF needs no mesh files."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..validation import FloatArray
from .xml import Picture

__all__ = ["arm_visuals", "dummy_visuals", "limb_visuals"]

_ARM_RADIUS, _ROD_RADIUS, _CROSS_RADIUS = 0.035, 0.006, 0.012
_OUTER_RADIUS, _INNER_RADIUS = 0.012, 0.007


def _point(values: FloatArray) -> tuple[float, ...]:
    return tuple(values.tolist())


def _loop(points: Sequence[FloatArray], origin: FloatArray, colour: str) -> list[Picture]:
    """A closed polygon of rods, seen from ``origin``."""
    corners = [np.asarray(point) - origin for point in points]
    nexts = corners[1:] + corners[:1]
    return [Picture(colour, _ROD_RADIUS, _point(one), _point(other)) for one, other in zip(corners, nexts, strict=True)]


def arm_visuals(points: FloatArray, with_platform: bool) -> list[Picture]:
    """The arm as a capsule down -z, and the platform's joints as a ring held by struts."""
    depth = float(min(points[:, 2].min(), -0.1))
    tip = np.array([0.0, 0.0, 1.4 * depth])
    pictures = [
        Picture("arm", _ARM_RADIUS, (0.0, 0.0, 0.0), _point(tip)),
        Picture("arm", _ARM_RADIUS, (0.0, 0.0, 0.0)),
        Picture("arm", _ARM_RADIUS, _point(tip)),
    ]
    if with_platform:
        pictures += _loop(list(points), np.zeros(3), "platform")
        pictures += [
            Picture("platform", _ROD_RADIUS, (0.0, 0.0, float(point[2])), _point(point))
            for point in points
            if np.hypot(point[0], point[1]) > _ARM_RADIUS
        ]
    return pictures


def limb_visuals(s: FloatArray, length: float, a: FloatArray, ring: Sequence[FloatArray]) -> dict[str, list[Picture]]:
    """Pictures of a limb's links: halves that telescope, crosses, and the base ring if ``ring`` has its corners."""
    zero = (0.0, 0.0, 0.0)
    return {
        "cross": [Picture("cross", _CROSS_RADIUS, zero)],
        "platform_body": [Picture("platform_half", _OUTER_RADIUS, zero, _point(-0.55 * length * s))],
        "base_body": [Picture("base_half", _INNER_RADIUS, zero, _point(0.75 * length * s))],
        "base": _loop(ring, a, "base") if ring else [Picture("base", _CROSS_RADIUS, zero)],
    }


def dummy_visuals() -> tuple[list[Picture], list[Picture], list[Picture], list[Picture]]:
    """Pictures of the dummy's torso, flange, cross and arm."""
    torso = [Picture("base", 0.06, (0.0, -0.2, -0.4), (0.0, -0.2, 0.05))]
    flange = [Picture("base_half", 0.03, (0.0, -0.14, 0.0), (0.0, -0.04, 0.0))]
    cross = [Picture("cross", 0.015, (-0.03, 0.0, 0.0), (0.03, 0.0, 0.0))]
    return torso, flange, cross, arm_visuals(np.array([[0.0, 0.0, -0.2]]), False)
