"""The base of all errors."""

from __future__ import annotations

__all__ = ["ExoPinError"]


class ExoPinError(Exception):
    """Base of every error that exo_pin raises on purpose."""
