"""Reading a TOML table whose keys carry their units, strictly: every key is used, or it is an error."""

from __future__ import annotations

import math
from os import PathLike
from typing import Any

import numpy as np

from ..errors import ExoPinError, FileFormatError
from ..validation import FloatArray, as_finite

__all__ = ["UNITS", "Table"]

#: Unit suffixes of keys, and the factor to SI.
UNITS: dict[str, dict[str, float]] = {
    "length": {"_m": 1.0, "_mm": 1e-3},
    "angle": {"_rad": 1.0, "_deg": math.pi / 180.0},
    "mass": {"_kg": 1.0, "_g": 1e-3},
    "inertia": {"_kg_m2": 1.0, "_g_mm2": 1e-9},
    "acceleration": {"_m_s2": 1.0},
    "stiffness": {"_N_m": 1.0, "_N_mm": 1e3},
    "twist stiffness": {"_N_m_rad": 1.0},
    "rigidity": {"_N_m2": 1.0},
    "number": {"": 1.0},
}


class Table:
    """A TOML table that hands out its keys one by one.

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
        self._path = path
        self.name = name
        self._asked: set[str] = set()

    def error(self, message: str, key: str) -> FileFormatError:
        """An error that names ``key`` in full."""
        full = f"{self.name}.{key}" if self.name else key
        return FileFormatError(f"{full}: {message}", self._path, full)

    def __contains__(self, key: str) -> bool:
        return key in self._data

    def quantity(self, kind: str, key: str, shape: tuple[int | None, ...] = (), required: bool = True) -> Any:
        """A quantity in SI, as a float or an array of ``shape``; None if absent and not required."""
        spellings = {key + suffix: factor for suffix, factor in UNITS[kind].items()}
        self._asked.update(spellings)
        found = [spelling for spelling in spellings if spelling in self._data]
        if not found:
            if required:
                raise self.error("missing", " or ".join(spellings))
            return None
        if len(found) > 1:
            raise self.error("given twice", " and ".join(found))
        try:
            array = as_finite(found[0], self._data.pop(found[0]), shape)
        except ExoPinError as error:
            raise self.error(str(error), found[0]) from None
        value: FloatArray = array * spellings[found[0]]
        return float(value) if shape == () else np.asarray(value)

    def text(self, key: str, required: bool = True, choices: tuple[str, ...] | None = None) -> str | None:
        """A string, from ``choices`` if they are given."""
        value = self._typed(key, str, required)
        if value is not None and choices is not None and value not in choices:
            raise self.error(f"expected one of {', '.join(choices)}, got {value!r}", key)
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of strings, empty if absent."""
        values = self._typed(key, list, False) or []
        if not all(isinstance(value, str) for value in values):
            raise self.error("expected a list of strings", key)
        return tuple(values)

    def mapping(self, key: str) -> dict[str, str]:
        """A table of strings whose keys are free, empty if absent."""
        values = self._typed(key, dict, False) or {}
        if not all(isinstance(value, str) for value in values.values()):
            raise self.error("expected a table of strings", key)
        return dict(values)

    def flag(self, key: str) -> bool:
        """A boolean, False if absent."""
        return bool(self._typed(key, bool, False))

    def get_flag(self, key: str) -> bool:
        """Look at a boolean without taking it."""
        return self._data.get(key) is True

    def integer(self, key: str) -> int:
        """A required integer."""
        value = self._typed(key, int, True)
        if isinstance(value, bool):
            raise self.error("expected an integer, got a boolean", key)
        return int(value)

    def table(self, key: str, required: bool = True) -> Table | None:
        """A sub-table."""
        value = self._typed(key, dict, required)
        return None if value is None else Table(value, self._path, self._join(key))

    def tables(self, key: str) -> list[Table]:
        """An array of tables, empty if absent."""
        values = self._typed(key, list, False) or []
        if not all(isinstance(value, dict) for value in values):
            raise self.error("expected an array of tables", key)
        return [Table(value, self._path, f"{self._join(key)}[{index}]") for index, value in enumerate(values)]

    def finish(self) -> None:
        """Raise if a key was not asked for.

        Raises
        ------
        FileFormatError
            Naming the first such key and those that the table may have.
        """
        for key in self._data:
            allowed = ", ".join(sorted(self._asked)) or "none"
            raise self.error(f"unknown key; this table may have: {allowed}", key)

    def _join(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def _typed(self, key: str, kind: type, required: bool) -> Any:
        self._asked.add(key)
        if key not in self._data:
            if required:
                raise self.error("missing", key)
            return None
        value = self._data.pop(key)
        if not isinstance(value, kind):
            raise self.error(f"expected {kind.__name__}, got {type(value).__name__}", key)
        return value
