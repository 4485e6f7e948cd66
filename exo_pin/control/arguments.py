"""A check of arguments that several parts of this room make."""

from __future__ import annotations

from ..core.errors import InvalidInput
from ..core.errors.base import echo


def require_callable(value: object, expected: str) -> None:
    """Raise InvalidInput if a value cannot be called; ``expected`` says in words what it should be."""
    if not callable(value):
        raise InvalidInput(f"expected {expected}, got {echo(value)}")
