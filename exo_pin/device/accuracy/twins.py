"""Twins: poses far apart in which all drives of a device stand alike.

Of every pose the one is sought that lies at least so far away and in which the drives' positions differ least, by
damped least squares from several starts: poses at that distance and twice as far on either side along the weakest axis,
and those of a net over the range of motion whose positions are nearest. What was found is the best of poses that were
visited; a twin between the nodes of the net may be missed.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ...core.conventions import MIRROR
from ...core.records import reduced_tuple
from ...core.validation import FloatArray
from ...load_case.case import beyond_motion

#: Angle from which a pose that looks alike counts as a twin, rad.
TWIN_ANGLE = float(np.radians(10.0))
#: Distance of the net's nodes, rad, of closed forms and of chains, whose poses take a hundred times as long.
SPACING, WIDE_SPACING = float(np.radians(10.0)), float(np.radians(40.0))
#: Steps of least squares, the longest of them, rad, and what is too little to go on.
STEPS, LONGEST, LITTLE = 12, 0.35, 1e-4
#: Starts along the weakest axis, in times of the least angle.
_ALONG = (1.0, -1.0, 2.0, -2.0)
#: Nodes that are looked at for each pose, how many of them are starts, and how far apart these are, rad.
_NEAREST, _STARTS, _APART = 24, 3, float(np.radians(25.0))

#: Positions (N, n) and their rates (N, n, 3) for an angular velocity of the arm, base frame, in poses (N, 3, 3); each
#: pose is asked for a pose of the question, of the numbers (N,).
Readings = Callable[[FloatArray, NDArray[np.intp]], tuple[FloatArray, FloatArray]]


class Twins(NamedTuple):
    """For each of N poses the one that lies far from it and looks most alike.

    Attributes
    ----------
    difference : ndarray
        Root of the sum of squares of the drives' differences, each over its share of the tolerance, shape (N,): at most
        1 of a twin; infinite where no pose was compared.
    matrices : ndarray
        The poses, shape (N, 3, 3); NaN where there is none.
    """

    difference: FloatArray
    matrices: FloatArray

    def __reduce__(self) -> tuple[object, ...]:
        return reduced_tuple(self)


@functools.lru_cache(maxsize=8)
def _net(spacing: float, side: str) -> FloatArray:
    """Poses over the range of motion about so far apart, shape (M, 3, 3); on the right the mirror image of the left."""
    if side == "right":
        return np.ascontiguousarray(MIRROR @ _net(spacing, "left") @ MIRROR)
    count = int(np.ceil(4.0 * np.pi / spacing**2))
    place = np.arange(count) + 0.5
    height, azimuth = 1.0 - 2.0 * place / count, np.pi * (1.0 + np.sqrt(5.0)) * place
    # From the hanging arm, straight to every direction of a spiral over the sphere.
    axis = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros(count)], axis=1)
    swings = Rotation.from_rotvec(np.arccos(height)[:, None] * axis)
    turns = Rotation.from_rotvec(np.outer(np.arange(-np.pi, np.pi, spacing), [0.0, 0.0, 1.0]))
    matrices = np.einsum("aij,bjk->abik", swings.as_matrix(), turns.as_matrix()).reshape(-1, 3, 3)
    return np.ascontiguousarray(matrices[~beyond_motion(matrices, "left")])


def find_twins(
    readings: Readings,
    matrices: FloatArray,
    tolerance: FloatArray,
    side: str,
    least_angle: float = TWIN_ANGLE,
    spacing: float = SPACING,
    centre: int = 0,
) -> Twins:
    """For each pose the one at least so far from it whose drives stand most alike.

    Parameters
    ----------
    readings : callable
        See :data:`Readings`.
    matrices : ndarray
        Shape (N, 3, 3).
    tolerance : ndarray
        Share of each drive, shape (n,), m or rad: poses are twins if the sum of squares of differences over it is at
        most 1.
    side : {"left", "right"}
        Side of the body, for the range of motion.
    least_angle : float
        rad.
    spacing : float
        Of the net's nodes, rad.
    centre : int
        Number of the pose for which the net is asked.
    """
    count = len(matrices)

    def scaled(poses: FloatArray, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        positions, rates = readings(poses, rows)
        return positions / tolerance, rates / tolerance[:, None]

    own, rates = scaled(matrices, np.arange(count))
    known = np.flatnonzero(np.isfinite(own).all(axis=1) & np.isfinite(rates).all(axis=(1, 2)))
    out = Twins(np.full(count, np.inf), np.full((count, 3, 3), np.nan))
    if not known.size:
        return out
    nodes = _net(spacing, side)
    at_nodes, _ = scaled(nodes, np.full(len(nodes), centre))
    starts, rows = _starts(own[known], rates[known], matrices[known], nodes, at_nodes, least_angle)
    rows = known[rows]
    cost, best = _approached(scaled, starts, rows, matrices, own, side, least_angle)
    order = np.argsort(cost)[: int(np.isfinite(cost).sum())]
    found, first = np.unique(rows[order], return_index=True)
    out.difference[found], out.matrices[found] = cost[order[first]], best[order[first]]
    return out


def _starts(
    own: FloatArray, rates: FloatArray, matrices: FloatArray, nodes: FloatArray, at_nodes: FloatArray, least: float
) -> tuple[FloatArray, NDArray[np.intp]]:
    """Where to begin, shape (S, 3, 3), and for which of N poses, shape (S,)."""
    weak = np.linalg.svd(rates)[2][:, 2]
    each = np.arange(len(matrices))
    found = [Rotation.from_rotvec(times * least * weak).as_matrix() @ matrices for times in _ALONG]
    rows = [each] * len(_ALONG)
    there = np.flatnonzero(np.isfinite(at_nodes).all(axis=1))
    if len(there) > _NEAREST:
        _, near = cKDTree(at_nodes[there]).query(own, _NEAREST)
        near = there[near]
        # Cosines of angles between poses, of which the trace is 1 + 2 cos.
        away = _cosines(nodes[near], matrices[:, None])
        open_ = away <= np.cos(least)
        for _ in range(_STARTS):
            first = open_.argmax(axis=1)
            some = open_[each, first]
            chosen = near[each, first]
            found.append(nodes[chosen[some]])
            rows.append(each[some])
            open_ &= _cosines(nodes[near], nodes[chosen][:, None]) <= np.cos(_APART)
    return np.concatenate(found), np.concatenate(rows)


def _cosines(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(0.5 * ((first * second).sum(axis=(-2, -1)) - 1.0))


def _approached(
    scaled: Readings, poses: FloatArray, rows: NDArray[np.intp], matrices: FloatArray, own: FloatArray, side: str,
    least: float,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Least differences on the way from S starts, shape (S,), infinite if none was allowed, and where, (S, 3, 3)."""
    at, J = scaled(poses, rows)
    r = at - own[rows]
    cost, damping = np.linalg.norm(r, axis=1), np.full(len(poses), 1e-3)
    cost[np.isnan(cost)] = np.inf
    best, place = np.where(beyond_motion(poses, side), np.inf, cost), poses.copy()
    live = np.flatnonzero(np.isfinite(cost))
    for _ in range(STEPS):
        if not live.size:
            break
        A = np.einsum("kni,knj->kij", J[live], J[live])
        size = np.trace(A, axis1=1, axis2=2)[:, None, None]
        A += (damping[live, None, None] * size + 1e-12 * size + 1e-300) * np.eye(3)
        step = -np.linalg.solve(A, np.einsum("kni,kn->ki", J[live], r[live])[..., None])[..., 0]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        step *= np.minimum(1.0, LONGEST / np.maximum(length, 1e-300))
        new = _kept_away(Rotation.from_rotvec(step).as_matrix() @ poses[live], matrices[rows[live]], least)
        at, slope = scaled(new, rows[live])
        rest = at - own[rows[live]]
        value = np.linalg.norm(rest, axis=1)
        better = value < cost[live]
        gain = np.where(better, cost[live] - value, np.inf)
        done = live[better]
        poses[done], r[done], J[done], cost[done] = new[better], rest[better], slope[better], value[better]
        damping[live] *= np.where(better, 0.2, 10.0)
        inside = done[(cost[done] < best[done]) & ~beyond_motion(poses[done], side)]
        best[inside], place[inside] = cost[inside], poses[inside]
        live = live[(gain > LITTLE * np.maximum(cost[live], 1.0)) & (damping[live] < 1e3)]
    return best, place


def _kept_away(poses: FloatArray, centres: FloatArray, least: float) -> FloatArray:
    """Poses, those nearer to their centre than ``least`` pushed out to it along the same turn."""
    near = np.flatnonzero(_cosines(poses, centres) > np.cos(least))
    if near.size:
        turn = Rotation.from_matrix(poses[near] @ centres[near].mT).as_rotvec()
        turn *= least / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-12)
        poses[near] = Rotation.from_rotvec(turn).as_matrix() @ centres[near]
    return poses
