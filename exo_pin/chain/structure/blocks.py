"""Blocks of the constraint Jacobian: loops that share no coordinate are independent of each other.

The Jacobian of a chain is block diagonal after its rows and columns are sorted by block. Its singular values are those
of the blocks, and so are ranks, self-stresses and least solutions: work on it grows with the number of loops, not with
its cube. The blocks of usual robots are small enough that LAPACK works on them in one thread.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ...core.validation import FloatArray, frozen

IntArray = NDArray[np.int64]
#: Rows and columns, block by block, and where each block starts in either, with the end in the last place; shapes
#: (rows,), (columns,), (blocks + 1,), (blocks + 1,). Coordinates that move no loop are left out. A plain tuple, because
#: Numba takes it ten times faster than a named one.
Blocks = tuple[IntArray, IntArray, IntArray, IntArray]


def blocks_of(signs: FloatArray, rows: IntArray) -> Blocks:
    """Blocks of a chain, given which coordinates move which closure and the closures' first rows.

    Parameters
    ----------
    signs, rows : ndarray
        Shapes (m, nv) and (m + 1,), as in :class:`~exo_pin.chain.structure.topology.Topology`.
    """
    moved = csr_array(signs != 0.0, dtype=np.int64)
    count, block = connected_components(moved @ moved.T, directed=False) if len(signs) else (0, np.zeros(0, int))
    by_row = np.repeat(block, np.diff(rows))
    row_groups = [np.flatnonzero(by_row == b) for b in range(count)]
    column_groups = [np.flatnonzero(signs[block == b].any(axis=0)) for b in range(count)]
    return _joined(row_groups), _joined(column_groups), _starts(row_groups), _starts(column_groups)


def _joined(groups: list[IntArray]) -> IntArray:
    return frozen(np.concatenate([np.zeros(0, dtype=np.int64), *groups]).astype(np.int64))


def _starts(groups: list[IntArray]) -> IntArray:
    return frozen(np.cumsum([0, *(len(group) for group in groups)]).astype(np.int64))
