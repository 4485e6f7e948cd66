"""Rates and closing motions of all joints of a device for a turn of the arm, compiled.

The arm's three coordinates are given; the others are least in the sum of squares, metres over the characteristic
length, among those that keep the loops closed (:func:`solved_rows`). The volume of the loops' rows, the product of
their singular values, is zero at a singular configuration alone: its logarithm is what steps along a turn watch.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...chain.kinematics.kernels.closure_kernels import fill_residual, new_scratch
from ...chain.kinematics.kernels.tree_kernels import place_tree, step_tree, turn_quaternion
from ...core.compiled import kernel
from ...numerics.pivoted_qr import pivoted_qr, solve_triangle
from ...numerics.small_linear import solve_cholesky

#: Length of a column, relative to the longest, below which it depends on those taken before.
FREE = 1e-9
#: Residual of closed loops, m and rad, and the largest correction, rad and characteristic lengths, that is rounding.
CLOSED, _ROUNDING = 1e-12, 1e-13
#: Correction after which the next one is rounding.
_NEARLY = 1e-7
#: Newton's corrections to one configuration, and the largest ratio of each to the one before.
_CORRECTIONS, _CONTRACTION = 9, 0.35


@kernel
def new_room(tree: Any, column: Any, loops: Any) -> Any:
    """Arrays that the functions here fill again and again."""
    links, nv, rows = len(tree[0]), len(column), loops[4][-1]
    size = max(nv, rows) + 1
    return (
        (np.zeros((2, 4, 3)), np.zeros((links, 4, 3)), np.zeros((len(tree[3]), 4, 3)), np.zeros((nv, 6))),
        (new_scratch(), np.zeros(rows), np.zeros((rows, nv))),
        (np.zeros((nv + 3) * size), np.zeros(size), np.zeros(size), np.zeros(size, dtype=np.int64)),
        (np.ones(size, dtype=np.bool_), np.zeros((nv, nv)), np.zeros((nv, nv)), np.zeros((2, nv))),
        (np.zeros(nv), np.zeros(nv)),
    )


@kernel
def solved_rows(device: Any, u: Any, room: Any, least: Any, along: Any) -> float:
    """Fill the motion that closes the loops, and the one that goes with a turn of the arm; return the log volume.

    Parameters
    ----------
    device : tuple
        What :func:`exo_pin.device.turns.turn_arrays.turn_arrays` returns.
    u : ndarray
        Shape (3,), angular velocity of the arm in its own axes.
    room : tuple
        What :func:`new_room` makes, with the residual and Jacobian of the loops.
    least, along : ndarray
        Shape (nv,), filled, characteristic lengths and rad; zero of the arm.
    """
    _, _, (row_scale, column), (rows, cols, row_starts, col_starts), ranks, arm, _ = device
    _, (_, gap, jacobian), (buffer, diagonal, half, order), (allowed, gram, factor, part), _ = room
    least[:], along[:] = 0.0, 0.0
    volume = 0.0
    for b in range(len(ranks)):
        own, mine = rows[row_starts[b] : row_starts[b + 1]], cols[col_starts[b] : col_starts[b + 1]]
        m, n, rank = len(own), len(mine), ranks[b]
        if rank == 0:
            continue
        W, longest = buffer[: (n + 2) * m].reshape((n + 2, m)), 0.0
        for c in range(n):
            total = 0.0
            for i in range(m):
                W[c, i] = jacobian[own[i], mine[c]] * row_scale[own[i]] * column[mine[c]]
                total += W[c, i] * W[c, i]
            longest = max(longest, total)
        for i in range(m):
            r = own[i]
            W[n, i] = -row_scale[r] * gap[r]
            W[n + 1, i] = 0.0
            for k in range(3):
                W[n + 1, i] -= row_scale[r] * jacobian[r, arm[1] + k] * u[k]
        found = pivoted_qr(W, allowed[:n], order[:n], FREE * math.sqrt(longest), diagonal, half)
        if found < rank or not math.isfinite(longest):
            return -math.inf
        for i in range(rank):
            volume += math.log(abs(diagonal[i]))
        for c in range(rank, n + 2):
            solve_triangle(W, diagonal, rank, W[c])
        # The rest of the columns are motions of their own: dependent -W[rank + s], independent 1.
        free = n - rank
        for s in range(free):
            for t in range(s + 1):
                total = 1.0 if s == t else 0.0
                for i in range(rank):
                    total += W[rank + s, i] * W[rank + t, i]
                gram[s, t] = total
        for k in range(2):
            solution, out = W[n + k], least if k == 0 else along
            if free > 0:
                for s in range(free):
                    part[k, s] = 0.0
                    for i in range(rank):
                        part[k, s] -= W[rank + s, i] * solution[i]
                    for t in range(s + 1):
                        factor[s, t] = gram[s, t]
                solve_cholesky(factor[:free, :free], part[k, :free])
                for s in range(free):
                    for i in range(rank):
                        solution[i] += W[rank + s, i] * part[k, s]
                    out[mine[order[rank + s]]] = -part[k, s]
            for i in range(rank):
                out[mine[order[i]]] = solution[i]
        for s in range(free):
            volume += math.log(factor[s, s])
    return volume


@kernel
def rates(device: Any, q: Any, u: Any, room: Any, least: Any, along: Any) -> Any:
    """:func:`solved_rows` at a configuration, and the largest residual of the loops, m and rad."""
    tree, loops, _, _, _, _, _ = device
    (local, whole, poses, J), (scratch, gap, jacobian), _, _, _ = room
    place_tree(tree, q, local, whole, poses, J)
    worst = fill_residual(poses, J, loops, q, scratch, gap, jacobian)
    return worst, solved_rows(device, u, room, least, along)


@kernel
def closed_near(device: Any, q: Any, u: Any, room: Any, largest: float, passing: bool, along: Any) -> Any:
    """Newton's method towards closed loops with the arm held, in place; whether it contracts, and the log volume there.

    The volume and the rates are those before the last correction where the configuration is only passed.

    Parameters
    ----------
    device, u, room, along
        As for :func:`solved_rows`.
    q : ndarray
        Shape (nq,), changed.
    largest : float
        Largest first correction.
    passing : bool
        Whether a correction by :data:`_NEARLY` is the last one.
    """
    _, _, (_, column), _, _, _, loose = device
    least, move = room[4]
    last, volume = math.inf, 0.0
    for count in range(_CORRECTIONS):
        worst, volume = rates(device, q, u, room, least, along)
        size = 0.0
        for k in range(len(least)):
            size = max(size, abs(least[k]))
        if not math.isfinite(volume) or not math.isfinite(size) or not math.isfinite(worst):
            return False, volume
        if worst <= CLOSED or (size <= _ROUNDING and worst <= loose):
            return True, volume
        if size > (largest if count == 0 else _CONTRACTION * last):
            return size <= 1e3 * _ROUNDING and worst <= loose, volume
        last = size
        for k in range(len(least)):
            move[k] = least[k] * column[k]
        step_tree(device[0], move, q)
        if passing and size <= _NEARLY:
            return True, volume
    return False, volume


@kernel
def moved(device: Any, q: Any, motion: Any, base: Any, u: Any, share: float, room: Any, out: Any) -> None:
    """Fill a configuration from q along a motion, characteristic lengths and rad, with the arm a share along a turn.

    ``base`` is the arm's quaternion before the turn u, a rotation vector in its own axes.
    """
    _, _, (_, column), _, _, arm, _ = device
    move = room[4][1]
    out[:] = q
    for k in range(len(motion)):
        move[k] = motion[k] * column[k]
    step_tree(device[0], move, out)
    for k in range(4):
        out[arm[0] + k] = base[k]
    turn_quaternion(out, arm[0], share * u[0], share * u[1], share * u[2])
