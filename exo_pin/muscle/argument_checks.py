"""A check of arguments that several modules of this room make."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite


def rising_times(name: str, value: ArrayLike) -> FloatArray:
    """Two or more rising times, shape (n,), s."""
    times = as_finite(name, value, (None,))
    if len(times) < 2 or (np.diff(times) <= 0).any():
        raise InvalidInput(f"expected {name} to rise from sample to sample, with at least two samples")
    return times
