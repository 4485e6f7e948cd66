"""What is unique in wrenches of joints and closures, for many of them at once, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....core.compiled import kernel
from ....core.records import reduced_tuple
from ....core.validation import FloatArray, frozen


class Certified(NamedTuple):
    """Several wrenches with what is unique in them: see :class:`exo_pin.chain.JointReaction`."""

    columns: FloatArray  # (count, 6, 2 + k): the value, what z = 0 adds to it, the change per unit of z
    value: FloatArray  # (count, 6)
    unique: NDArray[np.bool_]  # (count, 6)
    ranges: FloatArray  # (count, 6, 2), without bounds
    basis: FloatArray  # (count, 6, min(6, k)), orthonormal in the metric, not scaled; zero beyond those that count
    counts: NDArray[np.int64]  # (count,), how many of the basis count

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


def certified(columns: FloatArray, length: float, sharpness: FloatArray) -> Certified:
    """Values and certificates of several wrenches.

    Parameters
    ----------
    columns : ndarray
        Shape (count, 6, 2 + k): the value, what z = 0 adds to it, and the change per unit of z.
    length : float
        Characteristic length, m, by which moments are divided.
    sharpness : ndarray
        Shape (count,), the share of a self-stress that is rounding.
    """
    columns = np.ascontiguousarray(columns)
    unique, basis, counts = _certificates(columns, length, sharpness)
    value = columns[:, :, 0].copy()
    ranges = np.stack([value, value], axis=-1)
    ranges[~unique] = -np.inf, np.inf
    return Certified(columns, frozen(value), frozen(unique), frozen(ranges), basis, counts)


@kernel(stack=True)
def _certificates(columns: Any, length: float, sharpness: Any) -> Any:
    """Which components are unique, and the directions in which the wrenches may change, with their number."""
    count, free = len(columns), columns.shape[2] - 2
    unique, counts = np.ones((count, 6), dtype=np.bool_), np.zeros(count, dtype=np.int64)
    basis, A = np.zeros((count, 6, min(6, free))), np.empty((6, free))
    for s in range(count):
        total = 0.0
        for i in range(6):
            unit = 1.0 if i < 3 else 1.0 / length
            for k in range(free):
                A[i, k] = columns[s, i, 2 + k] * unit
                total += A[i, k] * A[i, k]
                if not abs(A[i, k]) <= sharpness[s]:
                    unique[s, i] = False
        # The largest singular value is not above the root of the sum of squares.
        if not total > sharpness[s] * sharpness[s]:
            continue
        U, sizes, _ = np.linalg.svd(A, False)
        for k in range(len(sizes)):
            if sizes[k] > sharpness[s]:
                counts[s] += 1
                for i in range(6):
                    basis[s, i, k] = U[i, k] if i < 3 else U[i, k] * length
    return unique, basis, counts
