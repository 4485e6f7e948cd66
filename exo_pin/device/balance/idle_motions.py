"""Motions of a device in a stack of poses: those that turn the arm, and idle ones, which leave it where it is.

Equilibrium is a sum of zero over every motion that the loops allow. An idle motion on which a drive or brake acts has a
row of equilibrium beside the three of the arm's turns. One on which nothing acts must not be loaded, because nobody
holds it: the spin of a limb between two ball joints is not, a slide that stands upright is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from ...numerics.rank_factors import solve_and_span
from ..device_model import DeviceModel
from .least_loads import NONE

__all__ = []


class LoopMotions(NamedTuple):
    """What the loops of a device allow in N poses, over all coordinates but the arm's translation and fixed joints.

    Coordinates and rows are scaled by the characteristic length.

    Attributes
    ----------
    multipliers : ndarray
        The least ones that carry each of some loads as far as loops can, shape (N, rows, k).
    stresses : ndarray
        Orthonormal multipliers that load no coordinate, shape (N, rows, s); zero columns where a pose has fewer.
    self_stresses : ndarray of int
        Their number, shape (N,).
    turning : ndarray
        Shape (N, rest, 3): the least motion of all joints for a turn of 1 rad of the arm about each axis of the base
        frame, as far as the loops allow it.
    freedom : ndarray
        Shape (N,): turn about the worst axis over the motion that it needs, from 0 to 1.
    idle : ndarray or None
        Projector on motions that leave the arm where it is, shape (N, rest, rest); None where no pose has any.
    idle_count : ndarray of int
        Their number, shape (N,).
    """

    multipliers: FloatArray
    stresses: FloatArray
    self_stresses: NDArray[np.intp]
    turning: FloatArray
    freedom: FloatArray
    idle: FloatArray | None
    idle_count: NDArray[np.intp]


def loop_motions(model: DeviceModel, jacobian: FloatArray, R: FloatArray, loads: FloatArray) -> LoopMotions:
    """Motions and self-stresses of N poses.

    Parameters
    ----------
    model : DeviceModel
        The device.
    jacobian : ndarray
        Of the loops of the free tree, shape (N, rows, nv).
    R : ndarray
        Orientations of the arm, shape (N, 3, 3).
    loads : ndarray
        Generalised forces, scaled, shape (N, rest, k).
    """
    rest, top = model.rest, model.free.topology
    J = jacobian[:, :, rest] * (top.row_scale[:, None] * top.column[rest])
    count, rows, size = J.shape
    multipliers, rank = np.empty((count, loads.shape[2], rows)), np.empty(count, dtype=np.intp)
    null, left = np.empty((count, size, size)), np.empty((count, rows, rows))
    solve_and_span(J, np.ascontiguousarray(loads.mT), NONE, multipliers, null, left, rank)
    least = int(rank.min(initial=min(rows, size)))
    motions = null[:, least:].mT
    u, w, vt = np.linalg.svd(R @ motions[:, model.rest_angular], full_matrices=False)
    turns = w > NONE
    along = motions @ (vt.mT * turns[:, None])
    inverse = np.divide(1.0, w, out=np.zeros_like(w), where=turns)
    idle_count = size - rank - turns.sum(axis=1)
    return LoopMotions(
        multipliers.mT,
        left[:, least:].mT,
        rows - rank,
        along * inverse[:, None] @ u.mT,
        w[:, -1] if w.shape[1] == 3 else np.zeros(count),
        motions @ motions.mT - along @ along.mT if idle_count.any() else None,
        idle_count,
    )


def held_motions(
    idle: FloatArray, efforts: FloatArray, moments: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
    """Idle motions on which efforts act, and the number of these.

    Parameters
    ----------
    idle : ndarray
        Projector on idle motions, shape (N, rest, rest).
    efforts : ndarray
        Generalised force of a unit of each effort, scaled, shape (N, rest, p).
    moments : ndarray
        Moments of the efforts on the arm, shape (N, 3, p), beside which an effect may be rounding.

    Returns
    -------
    held : ndarray
        Shape (N, rest, d), orthonormal; zero columns where a pose has fewer.
    free : ndarray
        Projector on those on which no effort acts, shape (N, rest, rest).
    count : ndarray of int
        Shape (N,).
    """
    U, s, _ = np.linalg.svd(idle @ efforts, full_matrices=False)
    scale = np.maximum(np.abs(moments).max(axis=(1, 2), initial=0.0), s.max(axis=1, initial=0.0))
    counts = s > NONE * scale[:, None]
    count = counts.sum(axis=1)
    held = (U * counts[:, None])[:, :, : int(count.max(initial=0))]
    return held, idle - held @ held.mT, count
