"""Numbers in the XML of a robot: a strict reading, and how far a printed number may be from the one that was meant."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors.base import echo
from ...core.validation import FloatArray
from .xml_elements import Element

#: Entries of an inertia by their names.
MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
#: A position, angles or a direction that is left out.
NOTHING = (0.0, 0.0, 0.0)

#: What C and Python both read, and read alike: no hexadecimal, no underscores, no digits but 0 to 9, no "nan", "inf".
_DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_BLANKS = " \t\r\n"


def numbers(element: Element, attribute: str, count: int) -> list[float]:
    """The numbers of an attribute, of which there have to be ``count``.

    Raises
    ------
    FileFormatError
        If there are more or fewer, or one is not a finite decimal number.
    """
    return numbers_of(element, element.attributes[attribute], count, attribute)


def numbers_of(element: Element, text: str, count: int, attribute: str = "") -> list[float]:
    """The numbers of a text in an element, of which there have to be ``count``; the attribute is for messages.

    Raises
    ------
    FileFormatError
        As for :func:`numbers`.
    """
    words = re.split(f"[{_BLANKS}]+", text.strip(_BLANKS))
    words = [] if words == [""] else words
    if len(words) != count:
        expected = "a number" if count == 1 else f"{count} numbers"
        raise element.error(f"expected {expected}, got {echo(text)}", attribute)
    return [_finite(element, attribute, word) for word in words]


def number(element: Element, attribute: str, default: float | None = None) -> float:
    """The number of an attribute; the default where it is absent and a default is given."""
    if attribute not in element.attributes:
        if default is None:
            raise element.error(f"the attribute {attribute!r} is missing")
        return default
    return numbers(element, attribute, 1)[0]


def vector(element: Element | None, attribute: str, default: tuple[float, ...]) -> FloatArray:
    """The numbers of an attribute as an array; the default where the element or the attribute is absent."""
    if element is None or attribute not in element.attributes:
        return np.array(default)
    return np.array(numbers(element, attribute, len(default)))


def as_numbers(values: ArrayLike) -> str:
    """Numbers with blanks between them, so that they read back bit for bit (but for the sign of zero)."""
    return " ".join(repr(float(value) + 0.0) for value in np.ravel(values))


def half_unit(text: str) -> float:
    """Half a unit of the last digit of a printed number: how far the number before printing may be from it.

    A number without a point and an exponent, and any zero, counts as exact.
    """
    mantissa, _, exponent = text.strip(_BLANKS).lower().partition("e")
    decimals = mantissa.partition(".")[2]
    if float(text) == 0.0 or not (exponent or decimals):
        return 0.0
    return 0.5 * 10.0 ** (int(exponent or 0) - len(decimals))


def _finite(element: Element, attribute: str, word: str) -> float:
    if not _DECIMAL.fullmatch(word):
        hint = ""
        if "," in word:
            hint = " (decimals come after a point, numbers are separated by blanks)"
        elif "$" in word:
            hint = " (expand the file with xacro first)"
        raise element.error(f"expected a decimal number, got {echo(word)}{hint}", attribute)
    value = float(word)
    if not math.isfinite(value):
        raise element.error(f"expected a finite number, got {echo(word)}", attribute)
    return value
