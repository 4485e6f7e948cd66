"""TOML files, read strictly: keys carry their units, and every key is used or is an error.

Parsing is :mod:`tomllib`, writing :mod:`tomli_w`. Beyond TOML a file is refused if it nests deeper than
:data:`DEEPEST` levels, or holds an integer of more than 64 bits, which TOML leaves to the reader.

Units that keys of files end in.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from typing import Any

import numpy as np
import tomli_w

from ..errors import ExoPinError, FileFormatError, UnknownName
from ..errors.base import echo
from ..errors.inputs import hint, nearest
from ..validation import FloatArray, as_finite, as_real
from .atomic import read_text, write_text

#: Unit suffixes of keys, and the factor to SI.
UNITS: dict[str, dict[str, float]] = {
    "length": {"_m": 1.0, "_mm": 1e-3},
    "angle": {"_rad": 1.0, "_deg": math.pi / 180.0},
    "area": {"_m2": 1.0, "_cm2": 1e-4, "_mm2": 1e-6},
    "mass": {"_kg": 1.0, "_g": 1e-3},
    "inertia": {"_kg_m2": 1.0, "_g_mm2": 1e-9},
    "speed": {"_m_s": 1.0, "_mm_s": 1e-3},
    "rate": {"_rad_s": 1.0, "_deg_s": math.pi / 180.0},
    "power": {"_W": 1.0},
    "acceleration": {"_m_s2": 1.0},
    "stiffness": {"_N_m": 1.0, "_N_mm": 1e3},
    "twist stiffness": {"_N_m_rad": 1.0},
    "coupling stiffness": {"_N": 1.0},
    "couple": {"_N_m": 1.0},
    "rigidity": {"_N_m2": 1.0},
    "force": {"_N": 1.0, "_kN": 1e3},
    "pressure": {"_Pa": 1.0, "_bar": 1e5},
    "number": {"": 1.0},
}


#: Levels of tables and arrays in a file.
DEEPEST = 32
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
#: Characters of a text that a terminal would obey.
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]")
#: A dotted key of more parts, on which tomllib's work grows with the square of their number.
_LONG_KEY = re.compile(rf"""(?<![\w"'-])(?:{_PART}){{{DEEPEST}}}""")

#: What TOML calls a value of a Python type.
_KINDS = {
    str: "a string",
    list: "an array",
    dict: "a table",
    bool: "true or false",
    int: "an integer",
    float: "a number",
}


def read_toml(path: str | PathLike[str]) -> TomlTable:
    """The root table of a TOML file.

    Raises
    ------
    FileFormatError
        If the path is no regular file, the text is not UTF-8 (a byte-order mark is allowed) or not TOML, or the file
        nests too deep or holds an integer of more than 64 bits.
    """
    return parse_toml(read_text(path), path)


def parse_toml(text: str, path: str | PathLike[str] | None) -> TomlTable:
    """The root table of a TOML text; ``path`` is for messages. It raises as :func:`read_toml` does."""
    if _LONG_KEY.search(text):
        raise FileFormatError(f"not TOML that can be read: a key of more than {DEEPEST} parts", path)
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise FileFormatError(f"not TOML that can be read: nested deeper than {DEEPEST} levels", path) from None
    except ValueError as error:  # also an integer of more digits than Python converts
        raise FileFormatError(f"not TOML: {error}", path) from error
    _check_size(data, path)
    return TomlTable(data, path)


def write_toml(path: str | PathLike[str], content: Mapping[str, Any]) -> None:
    """Write a TOML file as :func:`exo_pin.core.files.write_text` does: whole or not at all.

    Raises
    ------
    FileFormatError
        For texts with control characters, which :func:`read_toml` would refuse.
    """
    _check_size(dict(content), path)
    write_text(path, toml_text(content))


def toml_text(content: Mapping[str, Any]) -> str:
    """The text of a TOML file."""
    return tomli_w.dumps(content)


@contextmanager
def naming_file(path: str | PathLike[str] | None) -> Iterator[None]:
    """Turn the error of a record that refuses a value into a :class:`FileFormatError` that names the file.

    An :class:`UnknownName` stays what it is: it names the choices.
    """
    try:
        yield
    except UnknownName:
        raise
    except FileFormatError as error:
        if error.path is not None:
            raise
        raise FileFormatError(str(error), path, error.key) from error
    except ExoPinError as error:
        raise FileFormatError(str(error), path) from error


def _check_size(data: dict[str, Any], path: str | PathLike[str] | None) -> None:
    """Refuse deep nesting and long integers, without recursion: both would break later, in numpy or a message."""
    left: list[tuple[str, Any, int]] = [("", data, 0)]
    while left:
        name, value, depth = left.pop()
        if depth > DEEPEST:
            raise FileFormatError(f"{name:.40}...: nested deeper than {DEEPEST} levels", path, name)
        if isinstance(value, dict):
            left += [(f"{name}.{key}" if name else key, item, depth + 1) for key, item in value.items()]
        elif isinstance(value, list):
            left += [(f"{name}[{index}]", item, depth + 1) for index, item in enumerate(value)]
        elif isinstance(value, str) and (found := _CONTROL.search(value)):
            raise FileFormatError(f"{name}: expected a text without control characters, got {found[0]!r}", path, name)
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise FileFormatError(
                f"{name}: expected an integer of at most 64 bits; write 1e20 for a number", path, name
            )


def _holds_flag(value: Any) -> bool:
    # numpy would read [true, 2.0] as [1.0, 2.0].
    return isinstance(value, bool) or (isinstance(value, list) and any(_holds_flag(item) for item in value))


class TomlTable:
    """A TOML table whose keys are taken one by one, so that :meth:`finish` can name the unknown ones.

    Parameters
    ----------
    data : dict
        The parsed table.
    path : path-like or None
        The file, for messages.
    name : str
        Dotted name of the table, empty for the root.
    """

    def __init__(self, data: dict[str, Any], path: str | PathLike[str] | None, name: str = "") -> None:
        self._data = dict(data)
        self.path = path
        self.name = name
        self._known: set[str] = set()

    def error(self, message: str, key: str) -> FileFormatError:
        """An error that names ``key`` in full."""
        full = self._join(key)
        return FileFormatError(f"{full}: {message}", self.path, full)

    def __contains__(self, key: str) -> bool:
        return key in self._data

    def require_schema(self, schema: int) -> None:
        """Read the version of the format, and raise FileFormatError if it is not ``schema``."""
        found = self.integer("schema")
        if found != schema:
            raise self.error(f"this version reads schema {schema}, got {found}", "schema")

    def quantity(self, kind: str, key: str, shape: tuple[int | None, ...] = (), required: bool = True) -> Any:
        """A finite quantity in SI, as a float or an array of ``shape``; None if absent and not required.

        ``kind`` is a key of :data:`~exo_pin.core.files.toml_tables.UNITS`. Sizes beyond 1e12 in SI are refused.
        """
        spellings = {key + suffix: factor for suffix, factor in UNITS[kind].items()}
        found = [spelling for spelling in spellings if spelling in self._data]
        if len(found) > 1:
            raise self.error("given twice", " and ".join(found))
        # The bare key is no spelling of a quantity with a unit.
        value = self._take(found[0] if found else next(iter(spellings)), spellings, required)
        if value is None:
            return None
        try:
            array = as_finite(found[0], self._without_flags(found[0], value), shape)
        except FileFormatError:
            raise
        except ExoPinError as error:
            raise self.error(str(error), found[0]) from None
        converted: FloatArray = array * spellings[found[0]]
        return float(converted) if shape == () else np.asarray(converted)

    def coefficient(self, key: str) -> float:
        """A required finite number of any size, for keys whose unit is no plain one, such as ``a_N_per_m_bar2``."""
        return self._numbers(key, 0)

    def coefficients(self, key: str) -> list[float]:
        """A required array of finite numbers of any size."""
        return self._numbers(key, 1)

    def text(self, key: str, required: bool = True, choices: Iterable[str] | None = None) -> str | None:
        """A string, from ``choices`` if they are given; None if absent and not required."""
        value = self._typed(key, str, required)
        if value is not None and choices is not None and value not in (names := tuple(choices)):
            raise self.error(f"expected one of {', '.join(names)}; got {echo(value)}{hint(value, names)}", key)
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """An array of strings, empty if absent."""
        values = self._typed(key, list, False) or []
        if not all(isinstance(value, str) for value in values):
            raise self.error("expected an array of strings", key)
        return tuple(values)

    def mapping(self, key: str) -> dict[str, str]:
        """A table of strings with free keys, empty if absent."""
        values = self._typed(key, dict, False) or {}
        if not all(isinstance(value, str) for value in values.values()):
            raise self.error("expected a table of strings", key)
        return dict(values)

    def flag(self, key: str) -> bool:
        """A boolean, False if absent."""
        return bool(self._typed(key, bool, False))

    def is_true(self, key: str) -> bool:
        """Whether a key is ``true``; the key does not count as used."""
        return self._data.get(key) is True

    def is_text(self, key: str) -> bool:
        """Whether a key holds a string; the key does not count as used."""
        return isinstance(self._data.get(key), str)

    def integer(self, key: str) -> int:
        """A required integer."""
        return int(self._typed(key, int, True))

    def table(self, key: str) -> TomlTable | None:
        """A sub-table; None if absent."""
        return self.required_table(key) if key in self else self._take(key, (key,), False)

    def required_table(self, key: str) -> TomlTable:
        """A sub-table."""
        return TomlTable(self._typed(key, dict, True), self.path, self._join(key))

    def tables(self, key: str) -> list[TomlTable]:
        """An array of tables, empty if absent."""
        values = self._typed(key, list, False) or []
        if not all(isinstance(value, dict) for value in values):
            raise self.error("expected an array of tables", key)
        return [TomlTable(value, self.path, f"{self._join(key)}[{index}]") for index, value in enumerate(values)]

    def skip(self, *keys: str) -> None:
        """Leave out keys that other programs may use; whatever they hold is allowed."""
        for key in keys:
            self._take(key, (key,), False)

    @property
    def content(self) -> dict[str, Any]:
        """What has not been taken."""
        return dict(self._data)

    @property
    def is_used_up(self) -> bool:
        """Whether every key has been taken."""
        return not self._data

    def finish(self) -> None:
        """Raise if a key has not been used.

        Raises
        ------
        FileFormatError
            Naming the first such key, the one that may be meant, and those that the table may have.
        """
        for key in self._data:
            allowed = ", ".join(sorted(self._known)) or "none"
            raise self.error(f"unknown key{hint(key, self._known)}; this table may have: {allowed}", key)

    def _join(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def _take(self, key: str, spellings: Iterable[str], required: bool) -> Any:
        """Take a value out; None if it is absent. ``spellings`` are all names that it may have."""
        self._known.update(spellings)
        if key in self._data:
            return self._data.pop(key)
        if not required:
            return None
        unused = [name for name in self._data if name not in self._known]
        near = next((match for match in (nearest(name, unused) for name in spellings) if match), None)
        found = "" if near is None else f"; the file has {near!r}, which is no known key"
        raise self.error(f"missing{found}", " or ".join(spellings))

    def _typed(self, key: str, kind: type, required: bool) -> Any:
        value = self._take(key, (key,), required)
        if value is not None and (not isinstance(value, kind) or (kind is int and isinstance(value, bool))):
            raise self.error(f"expected {_KINDS[kind]}, got {echo(value)}", key)
        return value

    def _without_flags(self, key: str, value: Any) -> Any:
        if _holds_flag(value):
            raise self.error(f"expected numbers, got {echo(value)}", key)
        return value

    def _numbers(self, key: str, dimensions: int) -> Any:
        value = self._without_flags(key, self._take(key, (key,), True))
        try:
            array = as_real(key, value)
        except ExoPinError as error:
            raise self.error(str(error), key) from None
        if array.ndim != dimensions or not np.isfinite(array).all():
            what = "an array of finite numbers" if dimensions else "a finite number"
            raise self.error(f"expected {what}, got {echo(value)}", key)
        return array.tolist()
