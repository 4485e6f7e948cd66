"""Checks of arguments that several parts of this room make."""

from __future__ import annotations

from types import UnionType
from typing import Any

from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import as_positive, as_rotation

__all__ = ["as_single_rotation", "require_callable", "require_type", "set_positive"]


def require_type(name: str, value: object, kind: type | UnionType, expected: str) -> None:
    """Raise InvalidInput if a value is not of a class; ``expected`` says in words what it should be."""
    if not isinstance(value, kind):
        raise InvalidInput(f"expected {name} to be {expected}, got {type(value).__name__}")


def require_callable(value: object, expected: str) -> None:
    """Raise InvalidInput if a value cannot be called; ``expected`` says in words what it should be."""
    if not callable(value):
        raise InvalidInput(f"expected {expected}, got {value!r:.60}")


def as_single_rotation(name: str, value: Any) -> Rotation:
    """Return ``value`` if it is a Rotation that is no stack, else raise InvalidInput."""
    if as_rotation(name, value).shape != ():
        raise InvalidInput(f"expected {name} to be a single rotation, got a stack of shape {value.shape}")
    return value


def set_positive(record: object, *names: str, zero: bool = False) -> None:
    """Check fields of a frozen dataclass as numbers above zero (or not below it, with ``zero``), and keep floats."""
    for name in names:
        object.__setattr__(record, name, as_positive(name, getattr(record, name), zero))
