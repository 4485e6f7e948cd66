"""Values of options that are written as text: numbers, a name with numbers; and options that exclude each other."""

from __future__ import annotations

import argparse
import math
from typing import Any

from ...core.errors import InvalidInput
from ...core.validation import as_positive

#: Longest duration of a simulation or animation with samples at even steps, s; more would fill the memory.
_LONGEST = 1000.0


def numbers(
    text: str, expected: str, *counts: int, separator: str = ",", shown: str | None = None, finite: bool = False
) -> list[float]:
    """The numbers of a text, as many as one of ``counts`` says, if any are given.

    Raises
    ------
    InvalidInput
        If it has others, or one that is not ``finite`` where all must be; the message says what was ``expected``, and
        the text, or what is ``shown`` for it.
    """
    try:
        values = [float(part) for part in text.split(separator)]
    except ValueError:
        values = []
    if finite and not all(map(math.isfinite, values)):
        values = []
    if not values or (counts and len(values) not in counts):
        raise InvalidInput(f"expected {expected}, got {shown or text!r}")
    return values


def named_numbers(text: str, expected: str, *counts: int, **more: Any) -> tuple[str, list[float]]:
    """Name and numbers of NAME=NUMBERS; arguments and errors are those of :func:`numbers`."""
    name, _, values = text.partition("=")
    return name, numbers(values, expected, *counts, shown=text, **more)


def duration(option: str, value: float) -> float:
    """A duration, s, that may be sampled."""
    seconds = as_positive(option, value)
    if seconds > _LONGEST:
        raise InvalidInput(f"expected {option} of at most {_LONGEST:g} s, got {seconds:g}")
    return seconds


def refuse(options: argparse.Namespace, why: str, *names: str) -> None:
    """Refuse options that mean nothing together with others; those that were not given are None, False or 0."""
    given = [f"--{name.replace('_', '-')}" for name in names if getattr(options, name) not in (None, False, 0.0)]
    if given:
        raise InvalidInput(f"{why}: leave out {', '.join(given)}")
