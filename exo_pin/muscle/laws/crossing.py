"""Where a curve of a force law reaches a value."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.validation import FloatArray

#: Points of the grid on which the inverses look for the interval that holds the answer.
_GRID = 129


def crossing(
    function: Callable[[FloatArray, FloatArray], FloatArray],
    other: FloatArray,
    target: FloatArray,
    interval: tuple[float, float],
    rising: bool,
) -> FloatArray:
    """First place in the interval where ``function(u, other)`` crosses ``target`` in one sense, NaN if none."""
    sign = 1.0 if rising else -1.0
    grid = np.linspace(*interval, _GRID).reshape((-1,) + (1,) * other.ndim)
    gap = sign * (function(grid, other[np.newaxis]) - target)
    enters = (gap[:-1] <= 0) & (gap[1:] >= 0)
    first = np.argmax(enters, axis=0)
    found = np.take_along_axis(enters, first[np.newaxis], axis=0)[0]
    low, high = grid.ravel()[first], grid.ravel()[first + 1]
    # A bracket with an end that is a root already is fine for the solver; where nothing was found the ends only
    # keep the shapes together and the answer is thrown away.
    from scipy.optimize import elementwise  # here, because its import takes long

    result = elementwise.find_root(lambda u, o, t: function(u, o) - t, (low, high), args=(other, target))
    return np.where(found & result.success, result.x, np.nan)
