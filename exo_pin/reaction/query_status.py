"""Status of the poses of a query."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..wrist.limbs import STATUS

__all__ = ["QUERY_STATUS", "answered"]

#: Status codes of the closed form, those of elastic devices, and why limits are not met.
QUERY_STATUS = (*STATUS, "no_equilibrium", "guide_overloaded", "infeasible", "out_of_stroke", "beyond_limits")
_SINGULAR = QUERY_STATUS.index("singular")


def answered(status: NDArray[np.int8]) -> NDArray[np.intp]:
    """Rows that have an equilibrium."""
    return (status < _SINGULAR).nonzero()[0]
