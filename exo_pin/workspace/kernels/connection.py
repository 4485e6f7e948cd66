"""Which poses of a grid can be reached from rest without coming near a singular pose.

The margin of a pose is the best, over all paths on the grid from rest to the pose, of the least margin on the path: the
widest path. Nodes are taken in the order of falling margin and joined to the neighbours that were taken before
(union-find); a pose has the margin at which it and rest come together.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.validation import FloatArray

#: Steps, rad, in which the way from rest to the nearest node of the grid is checked.
_STEP = np.radians(1.0)


@kernel(inline=True)
def _root_of(parent: Any, node: int) -> int:
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


@kernel(cost=301)
def widest_path(value: Any, order: Any, shape: Any, start: int, out: Any) -> None:
    """Fill, for every node of a grid of three dimensions, the greatest least value on a path from ``start``.

    Parameters
    ----------
    value, order : ndarray
        Values of the nodes, shape (N,), and the nodes in the order of falling value, N integers.
    shape : tuple of int
        Of the grid; nodes are numbered as in a flattened array, and neighbours share a face.
    start : int
        A node.
    out : ndarray
        Shape (N,), written.
    """
    count, d1, d2 = value.shape[0], shape[1] * shape[2], shape[2]
    parent, taken = np.arange(count), np.zeros(count, dtype=np.uint8)
    # Members of a set as a ring, so that a whole set can be given its margin when rest joins it.
    ring, size = np.arange(count), np.ones(count, dtype=np.int64)
    for k in range(count):
        node = order[k]
        taken[node] = True
        i, j, l = node // d1, (node // d2) % shape[1], node % d2  # noqa: E741
        out[node] = value[node] if node == start else -np.inf
        ahead = ((i + 1 < shape[0], node + d1), (j + 1 < shape[1], node + d2), (l + 1 < shape[2], node + 1))
        behind = ((i > 0, node - d1), (j > 0, node - d2), (l > 0, node - 1))
        for inside, other in ahead + behind:
            if not inside or taken[other] == 0:
                continue
            a, b = _root_of(parent, node), _root_of(parent, other)
            if a == b:
                continue
            here, there = out[a] > -np.inf, out[b] > -np.inf
            if here != there:
                # One of the sets holds rest: every member of the other comes together with it now.
                first = b if here else a
                member = first
                while True:
                    out[member] = value[node]
                    member = ring[member]
                    if member == first:
                        break
            if size[a] < size[b]:
                a, b = b, a
            parent[b], size[a] = a, size[a] + size[b]
            ring[a], ring[b] = ring[b], ring[a]


def connection_margin(
    on_way: Callable[[FloatArray], FloatArray], matrices: FloatArray, shape: tuple[int, ...], value: FloatArray
) -> FloatArray:
    """Greatest least margin on a path of the grid from rest, shape (N,).

    Rest, the pose of zero angles, need not be a node: the way to the node nearest to it is checked in steps of 1°.

    Parameters
    ----------
    on_way : callable
        Margin to a singular pose, negative beyond it, shape (N,), of orientations, shape (N, 3, 3).
    matrices : ndarray
        Shape (N, 3, 3).
    shape : tuple of int
        Of the grid, three dimensions.
    value : ndarray
        The same of the nodes, shape (N,).
    """
    node = nearest_to_rest(matrices)
    turn = Rotation.from_matrix(matrices[node]).as_rotvec()
    steps = np.linspace(0.0, 1.0, int(np.ceil(np.linalg.norm(turn) / _STEP)) + 1)
    way = on_way(Rotation.from_rotvec(steps[:, None] * turn).as_matrix())
    # NaN, where the margin is not known, is no way.
    clean = np.where(np.isnan(value), -np.inf, value)
    out = np.empty(len(value))
    widest_path(clean, np.argsort(-clean), tuple(shape), node, out)
    return np.minimum(out, np.nan_to_num(way, nan=-np.inf).min())


def nearest_to_rest(matrices: FloatArray) -> int:
    """Index of the pose nearest to rest, the pose of zero angles."""
    return int((matrices[:, 0, 0] + matrices[:, 1, 1] + matrices[:, 2, 2]).argmax())


def largest_region(inside: NDArray[np.bool_], sign: NDArray[np.float64] | None = None) -> NDArray[np.bool_]:
    """The largest set of neighbouring poses of a grid, shape of ``inside``.

    Parameters
    ----------
    inside : ndarray of bool
        Grid of three dimensions; neighbours share a face.
    sign : ndarray, optional
        Same shape: poses of different sign are not neighbours.
    """
    best = np.zeros(inside.shape, dtype=bool)
    parts = [inside] if sign is None else [inside & (sign > 0.0), inside & (sign < 0.0)]
    for part in parts:
        labels, count = ndimage.label(part)
        if count:
            sizes = np.bincount(labels.ravel())
            sizes[0] = 0
            if sizes.max() > best.sum():
                best = labels == sizes.argmax()
    return best
