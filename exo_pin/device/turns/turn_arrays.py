"""What the compiled steps along a turn take of a device, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...chain.kinematics.rank import rank_tolerance
from ...chain.structure.topology import blocks_of
from ...chain.structure.tree_arrays import tree_arrays
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
    rows, cols, row_starts, col_starts = blocks = blocks_of(signs, top.rows)
    work.linearise(start)
    scaled = work.jacobian * top.row_scale[:, None] * top.column
    ranks = []
    for b in range(len(row_starts) - 1):
        own = scaled[np.ix_(rows[row_starts[b] : row_starts[b + 1]], cols[col_starts[b] : col_starts[b + 1]])]
        s = np.linalg.svd(own, compute_uv=False)
        cut = max(FREE, rank_tolerance(own.shape, 1.0, state.model.njoints, state.tolerance))
        ranks.append(int((s > cut * s.max(initial=0.0)).sum()))
    arm = np.array([model.arm_q.start, model.arm_v.start])
    found = np.array(ranks, dtype=np.int64)
    tree, scales = tree_arrays(state.axes), (top.row_scale, top.column)
    return (tree, top.loops, scales, blocks, found, arm, float(state.closed)), len(model.moving) - int(found.sum())
