"""Categories of warnings."""

from __future__ import annotations

__all__ = ["ExoPinWarning", "NoisyMovement", "OutsideHumanRange"]


class ExoPinWarning(UserWarning):
    """Base of the warnings about results that are computed as requested, and may mislead."""


class NoisyMovement(ExoPinWarning):
    """Measurement noise makes up much of the forces along a movement."""


class OutsideHumanRange(ExoPinWarning):
    """A pose that a human shoulder of that side does not reach, or an angle in the wrong unit."""
