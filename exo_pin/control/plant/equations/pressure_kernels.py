"""From wanted tensions to pressures, by the static muscle law of the plant, compiled."""

from __future__ import annotations

from typing import Any

from ....core.compiled import kernel
from .muscle_kernels import tension

#: Halvings of the interval of pressure: 4 bar to 4e-7 Pa.
_HALVINGS = 40


@kernel
def static_tensions(law: Any, muscles: Any, lengths: Any, pressure: float, out: Any) -> None:
    """Fill ``out`` (n,) with the tensions in N at rest, at limb lengths (n,) in m and one gauge pressure in Pa."""
    for i in range(lengths.shape[0]):
        out[i] = tension(law, muscles[i], i, lengths[i], 0.0, pressure, 0.0)[0]


@kernel
def pressures_for(law: Any, muscles: Any, lengths: Any, wanted: Any, highest: float, out: Any) -> None:
    """Fill ``out`` (n,) with the highest gauge pressures in Pa at which the muscles pull no more than wanted.

    ``wanted`` (n,) in N. A muscle that shall not pull gets the pressure at which it would begin to, to be ready; one
    that is too short to pull at any pressure is vented.
    """
    for i in range(lengths.shape[0]):
        row = muscles[i]
        if tension(law, row, i, lengths[i], 0.0, highest, 0.0)[0] <= 0.0:
            out[i] = 0.0
            continue
        low, high = 0.0, highest
        if tension(law, row, i, lengths[i], 0.0, high, 0.0)[0] <= wanted[i]:
            out[i] = high
            continue
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if tension(law, row, i, lengths[i], 0.0, middle, 0.0)[0] > wanted[i]:
                high = middle
            else:
                low = middle
        out[i] = low
