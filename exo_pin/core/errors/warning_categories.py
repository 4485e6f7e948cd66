"""Categories of warnings, and the place that a warning names."""

from __future__ import annotations

import sys
import warnings

from .base import shown


class ExoPinWarning(UserWarning):
    """Base of exo_pin's warnings: results are computed as requested, and may mislead or take longer than usual."""

    def __init__(self, *args: object) -> None:
        super().__init__(*(shown(str(arg)) for arg in args))


class CacheUnusable(ExoPinWarning):
    """Machine code cannot be read from the cache on disk or stored there: results are the same, and take longer."""


class NoisyMovement(ExoPinWarning):
    """Measurement noise makes up much of the forces along a movement."""


class OutsideHumanRange(ExoPinWarning):
    """A pose that a human shoulder of that side does not reach, or a number that looks like one in another unit."""


class SuspectMeasurements(ExoPinWarning):
    """Measurements look mislabelled, or given in another frame, order or unit than expected."""


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the line outside the package that has called it."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("exo_pin."):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)
