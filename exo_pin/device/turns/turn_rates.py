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
from ...numerics.small_linear import pivoted_qr, solve_cholesky, solve_triangle

#: Length of a column, relative to the longest, below which it depends on those taken before.
FREE = 1e-9
#: The same of a closure's own columns that are taken before those of other closures are seen.
_CLEAR = 1e-3
#: Residual of closed loops, m and rad, and the largest correction, rad and characteristic lengths, that is rounding.
CLOSED, _ROUNDING = 1e-12, 1e-13
#: Correction after which the next one is rounding.
_NEARLY = 3e-7
#: Newton's corrections to one configuration, and the largest ratio of each to the one before.
_CORRECTIONS, _CONTRACTION = 9, 0.35


@kernel
def new_room(tree: Any, column: Any, loops: Any) -> Any:
    """Arrays that the functions here fill again and again."""
    links, nv, starts, most = len(tree[0]), len(column), loops[4], 0
    rows = starts[-1]
    for c in range(len(starts) - 1):
        most = max(most, starts[c + 1] - starts[c])
    size = max(nv, rows) + 1
    return (
        (np.zeros((2, 4, 3)), np.zeros((links, 4, 3)), np.zeros((nv, 6))),
        (new_scratch(), np.zeros(rows), np.zeros((rows, nv))),
        (np.zeros((len(starts), nv + 2, most)), np.zeros((nv + 2) * rows), np.ones(size, dtype=np.bool_)),
        (np.zeros(size), np.zeros(size), np.zeros(size, dtype=np.int64), np.zeros(size, dtype=np.int64)),
        (np.zeros((nv, nv)), np.zeros((nv, nv)), np.zeros((nv, nv)), np.zeros(nv)),
        (np.zeros(size), np.zeros(size, dtype=np.int64), np.zeros(size), np.zeros(size)),
        (np.zeros(nv), np.zeros(nv)),
    )


@kernel(inline=True, fills=True)
def _closure_columns(device: Any, c: int, own: Any, shared: Any, u: Any, room: Any, W: Any) -> float:
    """Fill the scaled columns of one closure: its own coordinates, those it shares, turn of the arm and gap.

    The square of the longest column of coordinates is returned.
    """
    first, (row_scale, column), arm = device[1][4][c], device[2], device[5][1]
    n, m, longest = len(own) + len(shared), device[1][4][c + 1] - first, 0.0
    gap, jacobian, scale = room[1][1][first:], room[1][2][first:], row_scale[first:]
    for k in range(n):
        v, total = own[k] if k < len(own) else shared[k - len(own)], 0.0
        out, size = W[k], column[v]
        for i in range(m):
            out[i] = jacobian[i, v] * scale[i] * size
            total += out[i] * out[i]
        longest = max(longest, total)
    turn = W[n]
    for i in range(m):
        turn[i] = -scale[i] * (jacobian[i, arm] * u[0] + jacobian[i, arm + 1] * u[1] + jacobian[i, arm + 2] * u[2])
    if len(W) > n + 1:
        for i in range(m):
            W[n + 1, i] = -scale[i] * gap[i]
    return longest


@kernel(inline=True, fills=True)
def solved_rows(device: Any, u: Any, room: Any, least: Any, along: Any, closing: bool) -> float:
    """Fill the motion that goes with a turn of the arm, and the one that closes the loops; return the log volume.

    The coordinates of each closure alone are solved for first, and leave few rows for those that closures share, as
    a platform's on its limbs.

    Parameters
    ----------
    device : tuple
        What :func:`exo_pin.device.turns.turn_stack.turn_arrays` returns.
    u : ndarray
        Shape (3,), angular velocity of the arm in its own axes.
    room : tuple
        What :func:`new_room` makes, with the residual and Jacobian of the loops.
    least, along : ndarray
        Shape (nv,), filled, characteristic lengths and rad; zero of the arm.
    closing : bool
        Whether the motion that closes the loops is wanted; else it is zero.
    """
    ranks, motions, sides = device[4], room[4][0], 2 if closing else 1
    least[:], along[:] = 0.0, 0.0
    volume = 0.0
    for b in range(len(ranks)):
        wide, high, rank, longest, part = _own_eliminated(device, b, u, room, sides)
        V = room[2][1][: (wide + sides) * high].reshape((wide + sides, high))
        _left_over(device, b, room, V, sides)
        diagonal, half, order = room[5][0], room[3][1], room[5][1][:wide]
        found = 0
        if ranks[b] > rank:
            found = pivoted_qr(V, room[2][2][:wide], order, FREE * longest, diagonal, half)
            if found < ranks[b] - rank:
                return -math.inf
            found = ranks[b] - rank
        else:
            for k in range(wide):
                order[k] = k
        part += _log_product(diagonal, found)
        if not math.isfinite(part):
            return -math.inf
        free = wide - found
        for k in range(found, wide + sides):
            solve_triangle(V, diagonal, found, V[k])
            out = motions[k - found] if k < wide else along if k == wide else least
            if k < wide:
                out[:] = 0.0
            _spread(device, b, room, V, found, k, sides, order, out)
        if free > 0:
            part += _shortened(motions[:free], room, least, along, closing)
        volume += part
    return volume


@kernel(inline=True, fills=True)
def _log_product(diagonal: Any, count: int) -> float:
    """Logarithm of the absolute product of the first numbers, at most six at a time."""
    total, product = 0.0, 1.0
    for i in range(count):
        product *= diagonal[i]
        if i % 6 == 5:
            total, product = total + math.log(abs(product)), 1.0
    return total + math.log(abs(product))


@kernel(inline=True, fills=True)
def _own_eliminated(device: Any, b: int, u: Any, room: Any, sides: int) -> Any:
    """Take the coordinates of each closure of a block that are its own.

    Returns
    -------
    tuple
        How many coordinates and rows are left, how many coordinates were taken, the length of the longest column and
        the log volume of what was taken.
    """
    rows, (closures, closure_starts, owned, own_starts, joint, joint_starts) = device[1][4], device[3]
    rank_of = device[4]
    buffer, _, allowed = room[2]
    diagonal, half, order, taken = room[3]
    shared = joint[joint_starts[b] : joint_starts[b + 1]]
    wide, high, rank, longest, volume = len(shared), 0, 0, 0.0, 0.0
    for e in range(closure_starts[b], closure_starts[b + 1]):
        first = own_starts[e]
        own, m = owned[first : own_starts[e + 1]], rows[closures[e] + 1] - rows[closures[e]]
        n = len(own)
        W = buffer[e, : n + len(shared) + sides]
        longest = max(longest, math.sqrt(_closure_columns(device, closures[e], own, shared, u, room, W)))
        # Of what is not clear the rest of the block decides.
        cut = FREE if len(shared) == 0 else _CLEAR
        found = pivoted_qr(W, allowed[:n], order[first : first + n], cut * longest, diagonal[first : first + n], half)
        found = min(found, rank_of[b] - rank)
        taken[e], rank = found, rank + found
        wide, high = wide + n - found, high + m - found
        volume += _log_product(diagonal[first:], found)
    return wide, high, rank, longest, volume


@kernel(inline=True, fills=True)
def _left_over(device: Any, b: int, room: Any, V: Any, sides: int) -> None:
    """Fill the columns of a block that are left: shared coordinates, own ones that were not taken, turn and gap."""
    rows, (closures, closure_starts, _, own_starts, _, joint_starts), taken = device[1][4], device[3], room[3][3]
    shared = joint_starts[b + 1] - joint_starts[b]
    V[:] = 0.0
    filled, left, wide = 0, shared, len(V) - sides
    for e in range(closure_starts[b], closure_starts[b + 1]):
        n, m, found = own_starts[e + 1] - own_starts[e], rows[closures[e] + 1] - rows[closures[e]], taken[e]
        W = room[2][0][e]
        for i in range(found, m):
            for k in range(shared):
                V[k, filled] = W[n + k, i]
            for k in range(found, n):
                V[left + k - found, filled] = W[k, i]
            for k in range(sides):
                V[wide + k, filled] = W[n + shared + k, i]
            filled += 1
        left += n - found


@kernel(inline=True, fills=True)
def _spread(device: Any, b: int, room: Any, V: Any, found: int, k: int, sides: int, order: Any, out: Any) -> None:
    """Fill a motion of the coordinates of a block from a solved column of what was left.

    From column k of the coordinates that are independent this is the motion with that one at 1, and from the last
    columns the solutions with all of them at zero.
    """
    _, closure_starts, owned, own_starts, joint, joint_starts = device[3]
    diagonal, _, own_order, taken = room[3]
    x, y = room[5][2], room[5][3]
    shared, wide = joint[joint_starts[b] : joint_starts[b + 1]], len(V) - sides
    sign = 1.0 if k >= wide else -1.0
    for j in range(wide):
        x[j] = 0.0
    for i in range(found):
        x[order[i]] = sign * V[k, i]
    if k < wide:
        x[order[k]] = 1.0
    for j in range(len(shared)):
        out[shared[j]] = x[j]
    left = len(shared)
    for e in range(closure_starts[b], closure_starts[b + 1]):
        W, first, rank = room[2][0][e], own_starts[e], taken[e]
        n = own_starts[e + 1] - first
        for i in range(rank):
            y[i] = W[n + len(shared) + k - wide, i] if k >= wide else 0.0
        for j in range(len(shared)):
            column = W[n + j]
            for i in range(rank):
                y[i] -= column[i] * x[j]
        for j in range(rank, n):
            out[owned[first + own_order[first + j]]] = x[left + j - rank]
            for i in range(rank):
                y[i] -= W[j, i] * x[left + j - rank]
        left += n - rank
        solve_triangle(W, diagonal[first:], rank, y)
        for i in range(rank):
            out[owned[first + own_order[first + i]]] = y[i]


@kernel(inline=True, fills=True)
def _shortened(motions: Any, room: Any, least: Any, along: Any, closing: bool) -> float:
    """Take what is along free motions, shape (k, nv), out of two others; the logarithm of the volume of the motions."""
    _, gram, factor, part = room[4]
    free, volume = len(motions), 0.0
    for s in range(free):
        for t in range(s + 1):
            gram[s, t] = 0.0
            for c in range(len(least)):
                gram[s, t] += motions[s, c] * motions[t, c]
    for which in range(2 if closing else 1):
        out = along if which == 0 else least
        for s in range(free):
            part[s] = 0.0
            for c in range(len(least)):
                part[s] += motions[s, c] * out[c]
            for t in range(s + 1):
                factor[s, t] = gram[s, t]
        solve_cholesky(factor[:free, :free], part[:free])
        for s in range(free):
            for c in range(len(least)):
                out[c] -= part[s] * motions[s, c]
    for s in range(free):
        volume += math.log(factor[s, s])
    return volume


@kernel(inline=True, fills=True)
def _gap(device: Any, q: Any, room: Any) -> float:
    """Fill residual and Jacobian of the loops at a configuration; the largest residual, m and rad."""
    tree, loops, _, _, _, _, _ = device
    (local, poses, J), (scratch, gap, jacobian), _, _, _, _, _ = room
    place_tree(tree, q, local, poses, J)
    return fill_residual(poses, J, loops, q, scratch, gap, jacobian)


@kernel(fills=True)
def rates(device: Any, q: Any, u: Any, room: Any, least: Any, along: Any, closing: bool) -> Any:
    """:func:`solved_rows` at a configuration, and the largest residual of the loops, m and rad."""
    worst = _gap(device, q, room)
    return worst, solved_rows(device, u, room, least, along, closing)


@kernel(fills=True)
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
    least, move = room[6]
    last, volume = math.inf, 0.0
    for count in range(_CORRECTIONS):
        worst, volume = rates(device, q, u, room, least, along, True)
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
            # Rows that contradict each other leave a gap that no correction shows.
            return _gap(device, q, room) <= loose, volume
    return False, volume


@kernel(fills=True)
def moved(device: Any, q: Any, motion: Any, base: Any, u: Any, share: float, room: Any, out: Any) -> None:
    """Fill a configuration from q along a motion, characteristic lengths and rad, with the arm a share along a turn.

    ``base`` is the arm's quaternion before the turn u, a rotation vector in its own axes.
    """
    _, _, (_, column), _, _, arm, _ = device
    move = room[6][1]
    for k in range(len(q)):
        out[k] = q[k]
    for k in range(len(motion)):
        move[k] = motion[k] * column[k]
    step_tree(device[0], move, out)
    for k in range(4):
        out[arm[0] + k] = base[k]
    turn_quaternion(out, arm[0], share * u[0], share * u[1], share * u[2])
