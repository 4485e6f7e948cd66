"""Categories of warnings."""

from __future__ import annotations

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
