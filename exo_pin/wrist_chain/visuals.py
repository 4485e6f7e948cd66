"""Pictures of the mechanism: cylinders and balls, so that a URDF needs no mesh files."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..chain.formats.urdf.urdf_document import Picture
from ..core.validation import FloatArray

_ARM_RADIUS, _ROD_RADIUS, _CROSS_RADIUS = 0.035, 0.006, 0.012
_OUTER_RADIUS, _INNER_RADIUS = 0.012, 0.007
#: Rods of a ring turn by at most so much each, and a gap wider than this stays open, rad.
_LONGEST_ARC, _OPEN_GAP = np.radians(15.0), np.radians(150.0)


def _point(values: FloatArray) -> tuple[float, ...]:
    return tuple(values.tolist())


def _ring(points: Sequence[FloatArray], axis: FloatArray | None, origin: FloatArray, colour: str) -> list[Picture]:
    """Rods through the points, seen from ``origin``: round ``axis`` through zero, or straight where there is none.

    A wide gap between neighbours on the ring has no rod, so that the ring can be put on from the side.
    """
    corners = [np.asarray(point) for point in points]
    closed = True
    if axis is not None:
        corners, closed = _bent(np.array(corners), axis)
    nexts = corners[1:] + corners[: 1 if closed else 0]
    return [
        Picture(colour, _ROD_RADIUS, _point(one - origin), _point(other - origin))
        for one, other in zip(corners, nexts, strict=False)
    ]


def _bent(points: FloatArray, axis: FloatArray) -> tuple[list[FloatArray], bool]:
    """Corners of short rods round an axis from point to point, and whether they close."""
    heights = points @ axis
    spokes = points - heights[:, None] * axis
    radii = np.linalg.norm(spokes, axis=1)
    x = spokes[0] / radii[0]
    y = np.cross(axis, x)
    angles = np.arctan2(spokes @ y, spokes @ x)
    order = np.argsort(angles)
    gaps = np.diff(angles[order], append=angles[order[0]] + 2 * np.pi)
    widest = int(np.argmax(gaps))
    closed = bool(gaps[widest] < _OPEN_GAP)
    # Start behind the widest gap.
    turn = [*order[widest + 1 :], *order[: widest + 1]]
    if closed:
        turn.append(turn[0])
    corners = [points[turn[0]]]
    for one, other in itertools.pairwise(turn):
        span = (angles[other] - angles[one]) % (2 * np.pi)
        count = max(int(np.ceil(span / _LONGEST_ARC)), 1)
        for share in np.arange(1, count + 1) / count:
            angle = angles[one] + share * span
            radius = radii[one] + share * (radii[other] - radii[one])
            height = heights[one] + share * (heights[other] - heights[one])
            corners.append(radius * (np.cos(angle) * x + np.sin(angle) * y) + height * axis)
        corners[-1] = points[other]
    return (corners[:-1] if closed else corners), closed


def arm_visuals(points: FloatArray, with_platform: bool, axis: FloatArray | None = None) -> list[Picture]:
    """The arm as a capsule down -z, and the platform's joints as a ring about ``axis``, held by struts."""
    depth = float(min(points[:, 2].min(), -0.1))
    tip = np.array([0.0, 0.0, 1.4 * depth])
    pictures = [
        Picture("arm", _ARM_RADIUS, (0.0, 0.0, 0.0), _point(tip)),
        Picture("arm", _ARM_RADIUS, (0.0, 0.0, 0.0)),
        Picture("arm", _ARM_RADIUS, _point(tip)),
    ]
    if with_platform:
        pictures += _ring(list(points), axis, np.zeros(3), "platform")
        pictures += [
            Picture("platform", _ROD_RADIUS, (0.0, 0.0, float(point[2])), _point(point))
            for point in points
            if np.hypot(point[0], point[1]) > _ARM_RADIUS
        ]
    return pictures


def limb_visuals(
    s: FloatArray, length: float, a: FloatArray, ring: Sequence[FloatArray], axis: FloatArray | None = None
) -> dict[str, list[Picture]]:
    """Pictures of a limb's links: halves that telescope, crosses, and the base ring if ``ring`` has its joints."""
    zero = (0.0, 0.0, 0.0)
    return {
        "cross": [Picture("cross", _CROSS_RADIUS, zero)],
        "platform_body": [Picture("platform_half", _OUTER_RADIUS, zero, _point(-0.55 * length * s))],
        "base_body": [Picture("base_half", _INNER_RADIUS, zero, _point(0.75 * length * s))],
        "base": _ring(ring, axis, a, "base") if ring else [Picture("base", _CROSS_RADIUS, zero)],
    }
