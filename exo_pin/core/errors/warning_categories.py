"""Categories of warnings."""

from __future__ import annotations

__all__ = ["ExoPinWarning", "NoisyMovement"]


class ExoPinWarning(UserWarning):
    """Base of the warnings about results that are computed as requested, and may mislead."""


class NoisyMovement(ExoPinWarning):
    """Measurement noise makes up much of the forces along a movement."""
