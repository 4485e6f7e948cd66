"""Angles that look as if they were given in radians where degrees are expected."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import OutsideHumanRange

#: 30, 45, 60, 90 and 120° in radians, with two and three digits behind the point.
_ROUNDED = (0.52, 0.524, 0.79, 0.785, 1.05, 1.047, 1.57, 1.571, 2.09, 2.094)
#: So many angles are a stack of poses.
_MANY = 4


def warn_suspicious_angles(angles: Mapping[str, ArrayLike], stacklevel: int = 3) -> None:
    """Warn of angles beyond 180°, and of what looks like radians.

    That is whole degrees in radians, such as 1.0471975511965976 for 60°; the common angles with two or three digits,
    such as 1.05; and many angles none of which is above half a turn in radians, such as ``linspace(0, 1.57, 50)``.
    """
    suspects = {}
    for name, value in angles.items():
        values = np.asarray(value, dtype=np.float64).reshape(-1)
        if (np.abs(values) > 180.0).any():
            worst = float(values[np.abs(values).argmax()])
            warnings.warn(f"{name} = {worst:g}° is beyond half a turn", OutsideHumanRange, stacklevel=stacklevel)
        whole = np.degrees(values)
        likely = (np.abs(values) > 1e-3) & (np.abs(values) <= np.pi) & (np.abs(whole - np.rint(whole)) < 1e-9)
        # A whole number of degrees is what it says.
        likely &= values != np.rint(values)
        likely |= np.isin(np.abs(values), _ROUNDED)
        largest = float(np.abs(values).max(initial=0.0))
        if len(values) >= _MANY and 0.5 < largest <= np.pi and not largest.is_integer():
            likely |= np.abs(values) == largest
        if likely.any():
            suspects[name] = float(values[likely][0])
    if suspects:
        name, first = next(iter(suspects.items()))
        warnings.warn(
            f"{name} = {first:.6g}° is {np.degrees(first):.0f}° in radians; this function takes degrees",
            OutsideHumanRange,
            stacklevel=stacklevel,
        )
