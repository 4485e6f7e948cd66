"""Checks of arguments that several modules of this room make."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite

__all__ = ["broadcast", "require_kind", "rising_times"]


def broadcast(**named: ArrayLike) -> tuple[FloatArray, ...]:
    """Finite arrays, named for the message, brought to one shape."""
    arrays = [as_finite(name, value, (), stack=True) for name, value in named.items()]
    try:
        return tuple(np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = ", ".join(str(a.shape) for a in arrays)
        raise InvalidInput(f"expected {', '.join(named)} to broadcast, got shapes {shapes}") from None


def rising_times(name: str, value: ArrayLike) -> FloatArray:
    """Two or more rising times, shape (n,), s."""
    times = as_finite(name, value, (None,))
    if len(times) < 2 or (np.diff(times) <= 0).any():
        raise InvalidInput(f"expected {name} to rise from sample to sample, with at least two samples")
    return times


def require_kind(name: str, value: object, kind: type) -> None:
    """Raise InvalidInput if a value is not of a kind."""
    if not isinstance(value, kind):
        raise InvalidInput(f"expected {name} to be a {kind.__name__}, got {type(value).__name__}")
