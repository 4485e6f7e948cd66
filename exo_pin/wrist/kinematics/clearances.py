"""How far limbs keep from the arm and from each other, as lines between their joint centres."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray, as_positive
from ...design import WristGeometry
from .inverse import LimbState, inverse_kinematics

__all__ = ["arm_clearance", "limb_clearance"]


def arm_clearance(geometry: WristGeometry, orientation: Rotation, length: float = 0.3) -> FloatArray:
    """Distance of each limb's line from the arm's axis.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).
    length : float
        Of the axis, from O down the arm, m.

    Returns
    -------
    ndarray
        Shape (..., n), m. A limb clears the arm if this is more than the radii of both; what stands on the arm besides
        it, and the trunk, are not looked at.
    """
    down = np.array([0.0, 0.0, -as_positive("length", length)])
    a, b = _ends(inverse_kinematics(geometry, orientation), geometry)
    hand = np.broadcast_to((orientation.as_matrix() @ down)[..., None, :], b.shape)
    return _segment_distance(a, b, np.zeros_like(b), hand)


def limb_clearance(geometry: WristGeometry, orientation: Rotation) -> FloatArray:
    """Distance of each limb's line from that of its nearest neighbour.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    ndarray
        Shape (..., n), m.
    """
    a, b = _ends(inverse_kinematics(geometry, orientation), geometry)
    count = geometry.limb_count
    between = np.full((*b.shape[:-2], count, count), np.inf)
    i, j = np.triu_indices(count, 1)
    between[..., i, j] = between[..., j, i] = _segment_distance(a[..., i, :], b[..., i, :], a[..., j, :], b[..., j, :])
    return np.asarray(between.min(axis=-1))


def _ends(state: LimbState, geometry: WristGeometry) -> tuple[FloatArray, FloatArray]:
    """Both ends of every limb, shape (..., n, 3) each."""
    b = state.platform_points
    return np.broadcast_to(geometry.base_points, b.shape), b


def _segment_distance(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> FloatArray:
    """Distance between segments from p to q and from r to s, shape (..., 3) each.

    Of two segments that do not meet one end is always the closest point, or both closest points are inside: the best of
    the four ends and, where the lines are not parallel, of the lines themselves, if their closest points lie inside.
    """
    ends = [
        _point_distance(p, r, s),
        _point_distance(q, r, s),
        _point_distance(r, p, q),
        _point_distance(s, p, q),
    ]
    u, v, w = q - p, s - r, p - r
    uu, uv, vv = (u * u).sum(axis=-1), (u * v).sum(axis=-1), (v * v).sum(axis=-1)
    uw, vw = (u * w).sum(axis=-1), (v * w).sum(axis=-1)
    crossed = uu * vv - uv**2
    apart = crossed > 1e-12 * uu * vv
    size = np.where(apart, crossed, 1.0)
    along, beside = (uv * vw - vv * uw) / size, (uu * vw - uv * uw) / size
    inside = apart & (along >= 0) & (along <= 1) & (beside >= 0) & (beside <= 1)
    gap = np.linalg.norm(w + along[..., None] * u - beside[..., None] * v, axis=-1)
    return np.asarray(np.min([*ends, np.where(inside, gap, np.inf)], axis=0))


def _point_distance(x: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Distance of points from segments, shape (..., 3) each."""
    line = end - start
    share = ((x - start) * line).sum(axis=-1) / (line * line).sum(axis=-1)
    return np.asarray(np.linalg.norm(x - start - np.clip(share, 0.0, 1.0)[..., None] * line, axis=-1))
