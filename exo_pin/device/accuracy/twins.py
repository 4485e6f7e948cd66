"""Twins: poses far apart in which all drives of a device stand alike.

Of every pose the one is sought that lies at least so far away and in which the drives' positions differ least, by
damped least squares from several starts: poses at that distance and twice as far on either side along the weakest axis,
and those of a net over the range of motion whose positions are nearest. What was found is the best of poses that were
visited; a twin between the nodes of the net may be missed.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.conventions import MIRROR
from ...core.records import reduced_tuple
from ...core.validation import FloatArray
from ...load_case.case import BACKWARD, IN_FRONT, INTO_BODY, INWARD, OUTWARD, beyond_motion
from ...numerics.vectors import cross, dot, matrix, root, triple, turn, vector
from ...wrist.kinematics.assembly import rotate

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
    limbs: tuple[FloatArray, ...] | None = None,
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
    limbs : tuple of ndarray, optional
        Of a wrist, whose approach is compiled: A_i, B_i, and offsets of base and cuff, as :func:`.approach_limbs`
        takes them.
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
    if limbs is None:
        cost, best = _approached(scaled, starts, rows, matrices, own, side, least_angle)
    else:
        cost, best = np.empty(len(starts)), np.empty(starts.shape)
        outward = 1.0 if side == "left" else -1.0
        approach_limbs(starts, rows, matrices, own, *limbs, tolerance, least_angle, outward, cost, best)
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


@kernel(inline=True)
def _is_beyond(R: Any, outward: float) -> bool:
    """:func:`.beyond_motion` of one pose; ``outward``: 1 for a left shoulder, -1 for a right one."""
    forward, out = -R[0, 2], -outward * R[1, 2]
    turned = outward * math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
    through = out < -INTO_BODY and forward < IN_FRONT
    return forward < -BACKWARD or through or turned < INWARD or turned > OUTWARD


@kernel
def _differences(R: Any, base: Any, platform: Any, tolerance: Any, own: Any, rest: Any, rows: Any) -> float:
    """Fill the differences of the lengths over their tolerances and their rates; return the sum of squares."""
    total = 0.0
    for i in range(base.shape[0]):
        a, b = vector(base, i), turn(matrix(R), vector(platform, i))
        span = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
        length = root(dot(span, span))
        rest[i] = length / tolerance[i] - own[i]
        scale = 1.0 / max(length * tolerance[i], 1e-300)
        # b × s = -b × a over the length.
        row = cross(a, b)
        rows[i, 0], rows[i, 1], rows[i, 2] = row[0] * scale, row[1] * scale, row[2] * scale
        total += rest[i] * rest[i]
    return total


@kernel(inline=True)
def _step(rows: Any, rest: Any, damping: float) -> Any:
    """The damped step of least squares, no longer than the longest, rad."""
    xx = xy = xz = yy = yz = zz = gx = gy = gz = 0.0
    for i in range(rows.shape[0]):
        x, y, z = vector(rows, i)
        xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
        gx, gy, gz = gx + x * rest[i], gy + y * rest[i], gz + z * rest[i]
    more = (damping + 1e-12) * (xx + yy + zz) + 1e-300
    first, second, third = (xx + more, xy, xz), (xy, yy + more, yz), (xz, yz, zz + more)
    g, volume = (-gx, -gy, -gz), triple(first, second, third)
    x, y, z = triple(g, second, third) / volume, triple(first, g, third) / volume, triple(first, second, g) / volume
    size = root(x * x + y * y + z * z)
    cut = min(1.0, LONGEST / size) if size > 0.0 else 1.0
    return x * cut, y * cut, z * cut


@kernel
def _keep_away(R: Any, centre: Any, least: float) -> None:
    """Push a pose that is nearer to another than ``least`` out to that angle, along the same turn."""
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += R[i, j] * centre[i, j]
    cosine = min(1.0, max(-1.0, 0.5 * (trace - 1.0)))
    if cosine <= math.cos(least):
        return
    angle = math.acos(cosine)
    # Twice the sine times the axis, from R centreᵀ.
    x = dot(R[2], centre[1]) - dot(R[1], centre[2])
    y = dot(R[0], centre[2]) - dot(R[2], centre[0])
    z = dot(R[1], centre[0]) - dot(R[0], centre[1])
    size = root(x * x + y * y + z * z)
    if size > 0.0:
        more = (least - angle) / size
        rotate(R, x * more, y * more, z * more)


@kernel(stack=True, cost=8)
def approach_limbs(
    starts: Any, row: Any, matrices: Any, own: Any, base: Any, platform: Any, base_offset: Any, cuff_offset: Any,
    tolerance: Any, least: float, outward: float, difference: Any, place: Any,
) -> None:  # fmt: skip
    """Approach twins from S starts, each of the pose ``row`` of N.

    Parameters
    ----------
    starts : ndarray
        Shape (S, 3, 3).
    row : ndarray of int
        Shape (S,).
    matrices, own : ndarray
        Shape (N, 3, 3); lengths over tolerances, shape (N, n).
    base, platform, base_offset, cuff_offset : ndarray
        As of :func:`exo_pin.workspace.kernels.kinematic_stack`.
    tolerance : ndarray
        Shape (n,), m.
    least, outward : float
        Angle of a twin, rad; 1 for a left shoulder, -1 for a right one.
    difference, place : ndarray
        Written: least root of the sum of squares on the way within the range of motion, shape (S,), infinite if there
        was none; where, shape (S, 3, 3).
    """
    n, same = base.shape[0], base_offset.shape[0] == 1
    a, p = np.empty((n, 3)), np.empty((n, 3))
    rest, rows, new_rest, new_rows = np.empty(n), np.empty((n, 3)), np.empty(n), np.empty((n, 3))
    R, trial = np.empty((3, 3)), np.empty((3, 3))
    for k in range(starts.shape[0]):
        at = row[k]
        shift = 0 if same else at
        a[:, :], p[:, :] = base + base_offset[shift], platform + cuff_offset[shift]
        R[:, :] = starts[k]
        cost, damping = math.sqrt(_differences(R, a, p, tolerance, own[at], rest, rows)), 1e-3
        difference[k] = np.inf
        if not _is_beyond(R, outward):
            difference[k], place[k] = cost, R
        for _ in range(STEPS):
            step = _step(rows, rest, damping)
            trial[:, :] = R
            rotate(trial, step[0], step[1], step[2])
            _keep_away(trial, matrices[at], least)
            value = math.sqrt(_differences(trial, a, p, tolerance, own[at], new_rest, new_rows))
            if value < cost:
                gain, cost = cost - value, value
                R[:, :], rest[:], rows[:, :] = trial, new_rest, new_rows
                damping *= 0.2
                if cost < difference[k] and not _is_beyond(R, outward):
                    difference[k], place[k] = cost, R
                if gain <= LITTLE * max(cost, 1.0):
                    break
            else:
                damping *= 10.0
                if not damping < 1e3:
                    break
