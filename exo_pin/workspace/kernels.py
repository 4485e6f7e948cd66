"""Lengths, joint angles and singularity of limbs, and the shoulder's range, over stacks of poses; the way from rest.

Which poses of a grid can be reached from rest without coming near a singular pose.

The margin of a pose is the best, over all paths on the grid from rest to the pose, of the least margin on the path: the
widest path. Nodes are taken in the order of falling margin and joined to the neighbours that were taken before
(union-find); a pose has the margin at which it and rest come together.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.compiled import kernel
from ..core.validation import FloatArray
from ..numerics.vectors import add, limb, matrix, root, triple, turn, vector
from ..wrist.limbs import margin_of_limbs


@kernel(inline=True)
def _bend(frame: Any, direction: Any) -> Any:
    """Cosine and sine of |ψx| + |ψy| of a universal joint, an angle of 0 to 270°.

    The rows of ``frame`` are the joint's axes; in them ``direction`` is Ry(ψy) Rx(ψx) e_z =
    (cos ψx sin ψy, -sin ψx, cos ψx cos ψy), (4-25).
    """
    x, y, z = turn(frame, direction)
    x, y = abs(x), abs(y)
    level = max(root(x * x + z * z), 1e-300)
    return z - x * y / level, x + y * z / level


@kernel(inline=True)
def _larger(first: Any, second: Any) -> Any:
    """Of two angles of 0 to 270°, given by cosine and sine, the larger one."""
    # A number that rises with the angle and needs no arc tangent.
    p, q = first[0] / (abs(first[0]) + abs(first[1])), second[0] / (abs(second[0]) + abs(second[1]))
    p = 1.0 - p if first[1] >= 0.0 else 3.0 + p
    q = 1.0 - q if second[1] >= 0.0 else 3.0 + q
    return first if p > q else second


@kernel(stack=True)
def kinematic_stack(
    R: Any, base: Any, platform: Any, base_offset: Any, cuff_offset: Any, base_frames: Any, platform_frames: Any,
    half: Any, length: Any, bend: Any, margin: Any,
) -> None:  # fmt: skip
    """Fill lengths, margins of the universal joints and of the moments of the limbs.

    Parameters
    ----------
    R : ndarray
        Shape (N, 3, 3).
    base, platform : ndarray
        A_i in the base frame and B_i in the arm frame, shape (n, 3), m, about the device's own centre.
    base_offset, cuff_offset : ndarray
        Where that centre lies, seen from O: held by the base, base frame, and carried by the cuff, arm frame; shape
        (N, 3), or (1, 3) for all poses, m.
    base_frames, platform_frames : ndarray
        Shape (n, 3, 3): axes of the joints as rows, the third of them along the limb where the joint is straight.
    half : ndarray
        Half diagonals of the joints' diamonds, shape (n,), rad; infinite for a joint without a limit.
    length, bend, margin : ndarray
        Written: l_i (N, n), m; least of half_i - |ψx| - |ψy| over the joints (N,), rad; :func:`.margin_of_limbs` (N,),
        of three limbs with the sign of det[X_1 X_2 X_3].

    Notes
    -----
    Source: thesis (C-2), Table 5-6.
    """
    n = base.shape[0]
    X, reach, same = np.empty((n, 3)), np.empty(n), base_offset.shape[0] == 1
    for k in range(R.shape[0]):
        pose, columns = matrix(R[k]), matrix(R[k].T)
        held, carried = vector(base_offset, 0 if same else k), vector(cuff_offset, 0 if same else k)
        least = np.inf
        for i in range(n):
            ends = add(vector(base, i), held), add(vector(platform, i), carried)
            _, s, X_i, length[k, i], reach[i], _ = limb(pose, ends[0], ends[1])
            X[i, 0], X[i, 1], X[i, 2] = X_i
            if half[i] < np.inf:
                back = turn(columns, (-s[0], -s[1], -s[2]))
                both = _larger(_bend(matrix(base_frames[i]), s), _bend(matrix(platform_frames[i]), back))
                angle = math.atan2(both[1], both[0])
                least = min(least, half[i] - (angle if angle >= 0.0 else angle + 2.0 * math.pi))
        bend[k] = least
        margin[k] = margin_of_limbs(X, reach)
        if n == 3 and triple(vector(X, 0), vector(X, 1), vector(X, 2)) < 0.0:
            margin[k] = -margin[k]


@kernel(stack=True)
def shoulder_stack(R: Any, centre: float, half: float, outward: float, margin: Any) -> None:
    """Fill the margin to the diamond |θx - centre| + |θz| < half of Table 5-6, shape (N,), rad.

    The angles are the shoulder's Y-X-Z angles. Of the two triples that describe one orientation the better one counts.
    ``outward`` is 1 for a left shoulder, -1 for a right one.
    """
    for k in range(R.shape[0]):
        abduction = math.asin(min(1.0, max(-1.0, -outward * R[k, 1, 2])))
        # At 90° of abduction the pose says nothing of the axial turn, but for rounding: any may be meant; none is best.
        axial = abs(math.atan2(R[k, 1, 0], R[k, 1, 1])) if math.hypot(R[k, 1, 0], R[k, 1, 1]) > 1e-6 else 0.0
        first = abs(abduction - centre) + axial
        second = abs(math.pi - abduction - centre) + math.pi - axial
        margin[k] = half - min(first, second)


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
