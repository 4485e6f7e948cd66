"""Warnings: results that are right as computed and probably not what was meant."""

from __future__ import annotations

__all__ = ["ExoPinWarning", "OutsideHumanRange"]


class ExoPinWarning(UserWarning):
    """Base of all warnings of this package."""


class OutsideHumanRange(ExoPinWarning):
    """A pose that a human shoulder of that side does not reach, or an angle in the wrong unit."""
