"""What the compiled steps along a turn take of a device, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...chain.kinematics.kernels.tree_kernels import tree_arrays
from ...chain.kinematics.rank import rank_tolerance
from ...chain.structure.topology import IntArray, blocks_of
from ...core.validation import FloatArray
from ..device_model import DeviceModel
from .turn_rates import FREE

__all__ = ["turn_arrays"]


def turn_arrays(model: DeviceModel, start: FloatArray) -> tuple[Any, int]:
    """The tree, loops, scales, blocks, ranks, arm and tolerance for the kernels, and the number of idle freedoms.

    Where the arm is given, limbs that have no joint in common are blocks of their own. Ranks are those at ``start``.
    """
    state = model.held
    top, work = state.topology, state.buffers
    signs = np.zeros_like(top.signs)
    signs[:, model.moving] = top.signs[:, model.moving]
    rows, cols, row_starts, col_starts = blocks_of(signs, top.rows)
    work.linearise(start)
    scaled = work.jacobian * top.row_scale[:, None] * top.column
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
