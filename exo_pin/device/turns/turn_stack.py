"""What the compiled steps along a turn take of a device, as arrays.

A stack of poses of a device: straight turns from rest, and short turns from poses that have been followed.

The reference of a pose is the straight turn: the configuration there is a function of the rotation vector, and smooth
where no straight turn to a pose nearby meets a singular configuration. Where a device has no idle freedoms, a
configuration of a given pose has no others near it, so that a turn from a neighbour arrives at the reference if no
singular configuration is in the triangle between rest, the neighbour and the pose. Poses are sorted into cells of
rotation vectors. The pose in the middle of each cell is followed from rest in verified steps, and in each of these the
clearance from singular configurations is probed, from the volume of the loops' rows and its slope about all axes. The
others within that clearance are reached from it in one step of the same tests, and all that fail are tried in smaller
cells, at last from rest. Where freedoms are idle the configuration depends on the way: each pose has its own straight
turn in verified steps.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...chain.kinematics.closing import nearest_closed
from ...chain.kinematics.closing_steps import closed_stack
from ...chain.kinematics.kernels.tree_kernels import tree_arrays
from ...chain.kinematics.rank import rank_tolerance
from ...chain.structure.topology import IntArray, blocks_of
from ...core.compiled import kernel
from ...core.errors import LoopNotClosed
from ...core.progress import track
from ...core.validation import FloatArray
from ..device_model import REACHED, SINGULAR_BEFORE, UNREACHED, DeviceModel
from .own_ways import lacks_turns, own_way
from .turn_rates import FREE, new_room
from .turn_steps import followed

__all__ = ["followed_turns", "turn_arrays"]


def turn_arrays(model: DeviceModel, start: FloatArray) -> tuple[Any, int]:
    """The tree, loops, scales, blocks, ranks, arm and tolerance for the kernels, and the number of idle freedoms.

    Where the arm is given, limbs that have no joint in common are blocks of their own. Ranks are those at ``start``.
    """
    state = model.held
    top, scaled = state.topology, model.scaled_rows(start)
    signs = np.zeros_like(top.signs)
    signs[:, model.moving] = top.signs[:, model.moving]
    rows, cols, row_starts, col_starts = blocks_of(signs, top.rows)
    ranks = []
    for b in range(len(row_starts) - 1):
        own = scaled[np.ix_(rows[row_starts[b] : row_starts[b + 1]], cols[col_starts[b] : col_starts[b + 1]])]
        s = np.linalg.svd(own, compute_uv=False)
        cut = max(FREE, rank_tolerance(own.shape, 1.0, state.model.njoints, state.tolerance))
        ranks.append(int((s > cut * s.max(initial=0.0)).sum()))
    blocks = _blocks(signs, top.rows, rows, row_starts, cols, col_starts)
    arm, found = np.array([model.arm_q.start, model.arm_v.start]), np.array(ranks, dtype=np.int64)
    tree, scales = tree_arrays(state.model), (top.row_scale, top.column)
    return (tree, top.loops, scales, blocks, found, arm, float(state.closed)), len(model.moving) - int(found.sum())


def _blocks(
    signs: FloatArray,
    closure_rows: IntArray,
    rows: IntArray,
    row_starts: IntArray,
    cols: IntArray,
    col_starts: IntArray,
) -> tuple[IntArray, ...]:
    """Closures of each block, coordinates of each closure alone, and coordinates of several closures of each block.

    Each as the numbers one after the other and where those of each closure or block start.
    """
    closures, own, shared = [], [], []
    for b in range(len(row_starts) - 1):
        inside = np.isin(closure_rows[:-1], rows[row_starts[b] : row_starts[b + 1]])
        members = np.flatnonzero(inside & (np.diff(closure_rows) > 0))
        mine = cols[col_starts[b] : col_starts[b + 1]]
        count = (signs[np.ix_(members, mine)] != 0.0).sum(axis=0)
        closures.append(members)
        own += [mine[(count == 1) & (signs[c, mine] != 0.0)] for c in members]
        shared.append(mine[count > 1])
    return tuple(part for groups in (closures, own, shared) for part in _joined(groups))


def _joined(groups: list[IntArray]) -> tuple[IntArray, IntArray]:
    whole = np.concatenate([np.zeros(0, dtype=np.int64), *groups]).astype(np.int64)
    return whole, np.cumsum([0, *(len(group) for group in groups)]).astype(np.int64)


#: Edges of the cells of rotation vectors, rad; poses that one call of the kernel takes.
_CELLS, _BLOCK = (0.4, 0.2), 256
#: Turn of the arm, rad, over which the end of a followed turn may be crossed to a pose that is singular itself.
_LAST = 2e-5
#: Units of work of a pose: to compile the steps takes as long as tens of poses uncompiled.
_COST = 30
#: Turn beyond the end of a followed turn, rad, at which loops are tried, and change of joints, rad and lengths.
_BEYOND, _NEAR = 1e-3, 0.3
#: Most steps there to closed loops.
_CORRECTIONS = 60


@kernel(stack=True, cost=_COST)
def follow_turns(q: Any, device: Any, idle: bool, turns: Any, checked: bool, share: Any, clearance: Any) -> None:
    """Follow one turn from each configuration.

    Parameters
    ----------
    q : ndarray
        Shape (N, nq), closed; on return the last configuration that was reached.
    device : tuple
        What :func:`exo_pin.device.turns.turn_stack.turn_arrays` returns.
    idle : bool
        Whether freedoms of the device leave the arm at rest.
    turns : ndarray
        Shape (N, 3), rotation vectors in the arm's axes.
    checked : bool
        Whether each step is verified; else a turn is followed in steps of the first length or not at all.
    share : ndarray
        Shape (N,), filled: the share of each turn that was followed.
    clearance : ndarray
        Shape (N,), filled: how far the end of another turn from the same start may be from that of this one, rad, so
        that no singular configuration is between the two. Shape (0,) if it is not wanted.
    """
    tree, loops, (_, column), _, _, _, _ = device
    room, nv, nq = new_room(tree, column, loops), len(column), q.shape[1]
    node = np.zeros(nq), np.zeros(nv), np.zeros(nv)
    full = np.zeros(nq), np.zeros(nv), np.zeros(nv)
    half = np.zeros(nq), np.zeros(nv), np.zeros(nv)
    end = np.zeros(nq), np.zeros(nv), np.zeros(nv)
    spare = np.zeros(nq), np.zeros(nv), np.zeros(3)
    memory = np.zeros((13, nv)), np.zeros(4), node, full, half, end, spare
    for k in range(len(q)):
        share[k], left = followed(device, idle, q[k], turns[k], checked, len(clearance) > 0, room, memory)
        if len(clearance) > 0:
            clearance[k] = left


def followed_turns(
    model: DeviceModel, start: FloatArray, matrices: FloatArray, progress: bool = False
) -> tuple[FloatArray, FloatArray, NDArray[np.int8]]:
    """Follow a device from rest to poses.

    Parameters
    ----------
    model : DeviceModel
        The device.
    start : ndarray
        Closed configuration with the arm hanging, shape (nq,).
    matrices : ndarray
        Shape (N, 3, 3).
    progress : bool
        Whether to show a bar.

    Returns
    -------
    q : ndarray
        Configurations at the ends of the turns, shape (N, nq).
    share : ndarray
        Shape (N,), of each turn that was followed.
    why : ndarray of int8
        Shape (N,): :data:`REACHED`, :data:`UNREACHED` or :data:`SINGULAR_BEFORE`.
    """
    count = len(matrices)
    why = np.full(count, REACHED, dtype=np.int8)
    if not count:
        return np.tile(start, (0, 1)), np.zeros(0), why
    poses = Rotation.from_matrix(matrices)
    stack = _Stack(model, start, poses, progress)
    left = np.arange(count)
    for edge in () if stack.idle else _CELLS:
        left = stack.in_cells(left, edge) if left.size else left
    stack.straight(left, np.zeros(0))
    _end(model, stack, why)
    if "lacks_turns" not in model.kept:
        model.kept["lacks_turns"] = lacks_turns(model, start)
    if model.kept["lacks_turns"]:
        _own_ways(model, stack, why)
    there = stack.share == 1.0
    stack.q[np.ix_(there, np.arange(model.arm_q.start, model.arm_q.stop))] = poses.as_quat()[there]
    return stack.q, stack.share, why


class _Stack:
    """Poses of one device, some of them followed."""

    def __init__(self, model: DeviceModel, start: FloatArray, poses: Rotation, progress: bool) -> None:
        self.poses, self.turns, self.progress = poses, poses.as_rotvec(), progress
        if "turns" not in model.kept:
            model.kept["turns"] = turn_arrays(model, start)
        self.arrays, idle = model.kept["turns"]
        self.idle = idle > 0
        self.start, self.q, self.share = start, np.tile(start, (len(self.turns), 1)), np.zeros(len(self.turns))

    def in_cells(self, rows: NDArray[np.intp], edge: float) -> NDArray[np.intp]:
        """Follow the poses of cells with more than one, and return those that are left."""
        places = self.turns[rows] / edge
        cells = np.floor(places)
        _, own, size = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
        own = own.ravel()
        off = np.linalg.norm(places - cells - 0.5, axis=1)
        order = np.lexsort((*places.T, off, own))
        firsts = order[np.concatenate([[True], np.diff(own[order]) > 0])]
        centre = firsts[own]  # of each row's cell
        anchors = firsts[size > 1]
        clearance = np.zeros(len(rows))
        clearance[anchors] = self.straight(rows[anchors], np.zeros(len(anchors)))
        member = (size[own] > 1) & (centre != np.arange(len(rows)))
        away = np.linalg.norm(self.turns[rows] - self.turns[rows[centre]], axis=1)
        near = np.flatnonzero(member & (self.share[rows[centre]] == 1.0) & (away < clearance[centre]))
        if near.size:
            # Poses within the clearance of others.
            some, others = rows[near], rows[centre[near]]
            turns = (self.poses[others].inv() * self.poses[some]).as_rotvec()
            self._run(some, self.q[others], turns, False, np.zeros(0))
        done = self.share[rows] == 1.0
        done[anchors] = True
        return rows[~done]

    def straight(self, rows: NDArray[np.intp], clearance: FloatArray) -> FloatArray:
        """Follow straight turns from rest, verified."""
        self._run(rows, np.tile(self.start, (len(rows), 1)), self.turns[rows], True, clearance)
        return clearance

    def _run(
        self, rows: NDArray[np.intp], q: FloatArray, turns: FloatArray, checked: bool, clearance: FloatArray
    ) -> None:
        share = np.zeros(len(rows))
        blocks: Iterable[int] = range(0, len(rows), _BLOCK)
        for first in track(blocks, "poses of the device", True) if self.progress else blocks:
            own = slice(first, first + _BLOCK)
            follow_turns(q[own], self.arrays, self.idle, turns[own], checked, share[own], clearance[own])
        kept = np.ones(len(rows), dtype=bool) if checked else share == 1.0
        self.q[rows[kept]], self.share[rows[kept]] = q[kept], share[kept]


def _end(model: DeviceModel, stack: _Stack, why: NDArray[np.int8]) -> None:
    """Say of turns that were not followed to their end why, in place.

    A pose that is singular itself is reached, if the loops close there next to where the turn ends.
    """
    rows = np.flatnonzero(stack.share < 1.0)
    angle = np.linalg.norm(stack.turns[rows], axis=1)
    last = rows[(1.0 - stack.share[rows]) * angle <= _LAST]
    there, good = _closed_beside(model, stack.q[last], stack.turns[last])
    stack.q[last[good]], stack.share[last[good]] = there[good], 1.0
    rows, angle = rows[stack.share[rows] < 1.0], angle[stack.share[rows] < 1.0]
    beyond = np.minimum(1.0, stack.share[rows] + _BEYOND / angle)
    closes = _closed_beside(model, stack.q[rows], stack.turns[rows] * beyond[:, None])[1]
    why[rows] = np.where(closes, SINGULAR_BEFORE, UNREACHED)


def _own_ways(model: DeviceModel, stack: _Stack, why: NDArray[np.int8]) -> None:
    """Reach poses that no straight turn reaches, in place."""
    rows = np.flatnonzero(stack.share < 1.0)
    for k in track(rows, "poses of the device", stack.progress):
        q, arrived = own_way(model, stack.start, stack.poses[k].as_quat())
        if arrived:
            stack.q[k], stack.share[k], why[k] = q, 1.0, REACHED


def _closed_beside(model: DeviceModel, q: FloatArray, turns: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The closed configurations next to others, with the arm turned, and which of them are near."""
    state = model.held
    there = q.copy()
    if not len(q):
        return there, np.zeros(0, dtype=np.bool_)
    there[:, model.arm_q] = Rotation.from_rotvec(turns).as_quat()
    weight = state.topology.weight.copy()
    weight[model.fixed] = 0.0
    closed, done = there.copy(), np.zeros(len(q), dtype=np.bool_)
    if not state.tolerance:
        closed, done = closed_stack(state, there, weight, state.closed, _CORRECTIONS, False)
    for k in np.flatnonzero(~done) if state.tolerance else ():
        with suppress(LoopNotClosed):
            closed[k], done[k] = nearest_closed(state, there[k], model.fixed, state.closed, _CORRECTIONS)[0], True
    # Two quaternions are one rotation.
    closed[:, model.arm_q] = there[:, model.arm_q]
    return closed, done & (np.abs(closed - there).max(axis=1) <= _NEAR)
