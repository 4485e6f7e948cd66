"""A chain's constants as two arrays, because a kernel called from Python takes longer for an array than for its work.

Twenty arrays take 1.5 µs to hand over; windows on two are made within the kernel in a tenth of that.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....core.validation import FloatArray, frozen
from ..constant_axes import ConstantAxes
from ..topology import IntArray, Topology

#: How many arrays are packed of each kind.
_INTEGERS = 12


def packed_constants(topology: Topology, axes: ConstantAxes) -> tuple[IntArray, FloatArray]:
    """Where each array starts and all integers; all other numbers."""
    owners, carried, per_newton, length = topology.bodies
    joints, local, kinds, distances, rows, signs, supports, coupled, polynomials = topology.loops
    row_scale, column, blocks = topology.scales
    integers = joints, kinds, rows, coupled, *blocks, owners, *axes.tree
    numbers = np.array([length]), local, distances, signs, supports, polynomials, row_scale, column, carried, per_newton
    starts = [np.cumsum([0, *(part.size for part in parts)]) for parts in (integers, numbers)]
    starts[0] += len(starts[0]) + len(starts[1])
    whole = np.concatenate([*starts, *(part.ravel() for part in integers)]).astype(np.int64)
    return frozen(whole), frozen(np.concatenate([part.ravel() for part in numbers]))


@kernel(inline=True)
def _three(whole: Any, of: Any, k: int) -> Any:
    """Three windows; a kernel that makes no array may return several, and not one."""
    return of[whole[k] : whole[k + 1]], of[whole[k + 1] : whole[k + 2]], of[whole[k + 2] : whole[k + 3]]


@kernel(inline=True)
def unpacked_constants(whole: Any, numbers: Any) -> Any:
    """Windows on what :func:`packed_constants` returns.

    Returns
    -------
    tuple
        ``loops``, ``scales`` and ``bodies`` of :class:`exo_pin.chain.structure.topology.Topology`, and the ``tree`` of
        :class:`exo_pin.chain.structure.constant_axes.ConstantAxes`.
    """
    joints, kinds, rows = _three(whole, whole, 0)
    coupled, block_rows, block_columns = _three(whole, whole, 3)
    row_starts, column_starts, owners = _three(whole, whole, 6)
    blocks, tree, starts = (
        (block_rows, block_columns, row_starts, column_starts), _three(whole, whole, 9), whole[_INTEGERS + 1 :],
    )  # fmt: skip
    local, distances, signs = _three(starts, numbers, 1)
    supports, polynomials, row_scale = _three(starts, numbers, 4)
    column, carried, per_newton = _three(starts, numbers, 7)
    length, m, nv, couplings = numbers[0], len(kinds), len(column), len(coupled) // 5
    loops = (
        joints.reshape((m, 2)), local.reshape((m, 2, 4, 3)), kinds, distances, rows, signs.reshape((m, nv)),
        supports.reshape((m, 2, nv)), coupled.reshape((couplings, 5)), polynomials.reshape((couplings, 7)),
    )  # fmt: skip
    joints_of_chain = len(tree[2])
    return loops, (row_scale, column, blocks), (owners, carried.reshape((joints_of_chain, m)), per_newton, length), tree
