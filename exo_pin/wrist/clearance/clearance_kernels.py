"""Distances of limbs to bodies and to one another, over stacks of poses: segments with a radius (capsules)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.vectors import add, dot, matrix, root, turn, vector

#: Squared length, m², below which a segment is a point.
_POINT = 1e-18


@kernel(inline=True)
def _clamp(x: float) -> float:
    return min(1.0, max(0.0, x))


@kernel
def segment_distance(p: Any, q: Any, r: Any, t: Any) -> float:
    """Distance between the segments pq and rt, m.

    Where the lines are parallel any point of the first serves; else the nearest points of the lines, clamped to the
    first segment, then to the second, then to the first again (C. Ericson, Real-Time Collision Detection, 5.1.9).
    """
    d1, d2 = (q[0] - p[0], q[1] - p[1], q[2] - p[2]), (t[0] - r[0], t[1] - r[1], t[2] - r[2])
    w = (p[0] - r[0], p[1] - r[1], p[2] - r[2])
    a, e, c, f = dot(d1, d1), dot(d2, d2), dot(d1, w), dot(d2, w)
    u = v = 0.0
    if a > _POINT:
        if e > _POINT:
            b = dot(d1, d2)
            across = a * e - b * b
            if across > 1e-12 * a * e:
                u = _clamp((b * f - c * e) / across)
            v = (b * u + f) / e
            if v < 0.0:
                v, u = 0.0, _clamp(-c / a)
            elif v > 1.0:
                v, u = 1.0, _clamp((b - c) / a)
        else:
            u = _clamp(-c / a)
    elif e > _POINT:
        v = _clamp(f / e)
    gap = (w[0] + u * d1[0] - v * d2[0], w[1] + u * d1[1] - v * d2[1], w[2] + u * d1[2] - v * d2[2])
    return root(dot(gap, gap))


@kernel(inline=True)
def _on_torso(end: Any, displacement: Any) -> Any:
    """An end of a capsule of the torso, displaced with it, unless it is the shoulder itself, which is in O."""
    at = (end[0], end[1], end[2])
    return at if dot(at, at) < _POINT else add(at, displacement)


@kernel(stack=True)
def clearance_stack(
    R: Any, base: Any, platform: Any, base_offset: Any, cuff_offset: Any, radius: Any, still: Any, moving: Any, gap: Any
) -> None:
    """Fill the least distances between surfaces, m, negative where they overlap: (N, 3) to arm, torso, other limbs.

    Parameters
    ----------
    R : ndarray
        Shape (N, 3, 3).
    base, platform : ndarray
        Shape (n, 3), m, about the device's own centre.
    base_offset, cuff_offset : ndarray
        Where that centre lies, seen from O: held by the base, base frame, and carried by the cuff, arm frame; shape
        (N, 3), or (1, 3) for all poses, m. The torso is displaced by their difference
        (:mod:`exo_pin.workspace.pose_offsets`), but for ends in O: those are the shoulder itself.
    radius : ndarray
        Of the limbs, shape (n,), m.
    still, moving : ndarray
        Capsules of the torso in the base frame and of the arm in the arm frame, shape (K, 7): two ends and a radius, m.
    """
    n = base.shape[0]
    starts, ends, same = np.empty((n, 3)), np.empty((n, 3)), base_offset.shape[0] == 1
    for k in range(R.shape[0]):
        pose = matrix(R[k])
        held, carried = vector(base_offset, 0 if same else k), vector(cuff_offset, 0 if same else k)
        torso = (held[0] - carried[0], held[1] - carried[1], held[2] - carried[2])
        for i in range(n):
            starts[i, 0], starts[i, 1], starts[i, 2] = add(vector(base, i), held)
            ends[i, 0], ends[i, 1], ends[i, 2] = turn(pose, add(vector(platform, i), carried))
        to_arm = to_torso = to_limb = np.inf
        for j in range(moving.shape[0]):
            r = turn(pose, (moving[j, 0], moving[j, 1], moving[j, 2]))
            t = turn(pose, (moving[j, 3], moving[j, 4], moving[j, 5]))
            for i in range(n):
                distance = segment_distance(vector(starts, i), vector(ends, i), r, t)
                to_arm = min(to_arm, distance - radius[i] - moving[j, 6])
        for j in range(still.shape[0]):
            r, t = _on_torso(still[j, 0:3], torso), _on_torso(still[j, 3:6], torso)
            for i in range(n):
                distance = segment_distance(vector(starts, i), vector(ends, i), r, t)
                to_torso = min(to_torso, distance - radius[i] - still[j, 6])
        for i in range(n):
            for j in range(i):
                distance = segment_distance(vector(starts, i), vector(ends, i), vector(starts, j), vector(ends, j))
                to_limb = min(to_limb, distance - radius[i] - radius[j])
        gap[k, 0], gap[k, 1], gap[k, 2] = to_arm, to_torso, to_limb
