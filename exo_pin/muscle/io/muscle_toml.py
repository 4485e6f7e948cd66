"""TOML files: written whole or not at all, read with the key named that is wrong."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import tomli_w

from ...core.errors import FileFormatError
from ...core.files import write_text

__all__ = ["Reader", "as_number", "read_toml", "write_toml"]


def write_toml(content: Mapping[str, Any], path: str | PathLike[str]) -> None:
    """Write a TOML file, whole or not at all."""
    write_text(path, tomli_w.dumps(content))


def read_toml(path: str | PathLike[str]) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    FileFormatError
        If there is no such file or it is not TOML.
    """
    try:
        return tomllib.loads(Path(fspath(path)).read_text(encoding="utf-8"))
    except OSError as error:
        raise FileFormatError(f"cannot be read: {error.strerror or error}", path) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FileFormatError(f"is not TOML: {error}", path) from None


class Reader:
    """Takes keys out of a table and knows where it stands when one is missing or left over."""

    def __init__(self, table: Any, path: str | None, prefix: str = "") -> None:
        self.path = path
        self.prefix = prefix
        if not isinstance(table, dict):
            raise FileFormatError(f"expected {prefix.rstrip('.') or 'the file'} to be a table", path, prefix)
        self.left = dict(table)

    def take(self, key: str, default: Any = ...) -> Any:
        """Take a key out; without ``default`` a missing one raises FileFormatError."""
        if key in self.left:
            return self.left.pop(key)
        if default is ...:
            raise FileFormatError(f"key {self.prefix + key!r} is missing", self.path, self.prefix + key)
        return default

    def done(self, allowed: tuple[str, ...] = ()) -> None:
        """Raise FileFormatError if a key is left that is not allowed."""
        unknown = sorted(set(self.left) - set(allowed))
        if unknown:
            key = self.prefix + unknown[0]
            raise FileFormatError(f"unknown key {key!r}", self.path, key)


def as_number(value: Any, reader: Reader, key: str) -> float:
    """Return a number of the file as a float, or raise FileFormatError."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FileFormatError(f"expected {reader.prefix + key} to be a number, got {value!r}", reader.path, key)
    return float(value)
