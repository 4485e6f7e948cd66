"""Values of options that are written as text: numbers, a name with numbers, a file with an ending."""

from __future__ import annotations

import math
from pathlib import Path

from ...core.errors import InvalidInput
from ...core.files import is_stream

__all__ = ["in_si", "named_numbers", "numbers", "require_ending"]

#: Endings of a parameter's name that give its unit; the library takes SI.
_UNITS = {"_mm": 1e-3, "_m": 1.0, "_deg": math.pi / 180.0, "_rad": 1.0, "_kg": 1.0}


def numbers(text: str, expected: str, *counts: int, separator: str = ",", shown: str | None = None) -> list[float]:
    """The numbers of a text, as many as one of ``counts`` says, if any are given.

    Raises
    ------
    InvalidInput
        If it has others; the message says what was ``expected``, and the text, or what is ``shown`` for it.
    """
    try:
        values = [float(part) for part in text.split(separator)]
    except ValueError:
        values = []
    if not values or (counts and len(values) not in counts):
        raise InvalidInput(f"expected {expected}, got {shown or text!r}")
    return values


def named_numbers(text: str, expected: str, *counts: int, separator: str = ",") -> tuple[str, list[float]]:
    """Name and numbers of NAME=NUMBERS; it raises as :func:`numbers` does."""
    name, _, values = text.partition("=")
    return name, numbers(values, expected, *counts, separator=separator, shown=text)


def in_si(name: str) -> tuple[str, float]:
    """A parameter's name without the unit at its end, and the factor from that unit to SI."""
    ending = next((ending for ending in _UNITS if name.endswith(ending)), "")
    return name.removesuffix(ending), _UNITS.get(ending, 1.0)


def require_ending(option: str, path: Path | None, *endings: str) -> None:
    """Refuse a file with another ending; a pipe or a device needs none."""
    if path is not None and path.suffix.lower() not in endings and not is_stream(path):
        raise InvalidInput(f"expected {option} to end in {' or '.join(endings)}, got {path}")
