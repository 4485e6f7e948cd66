"""Mechanisms as TOML files: reading, writing, and the published ones that come with the package."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from os import PathLike
from pathlib import Path

import tomli_w

from ...core.errors import ExoPinError, FileFormatError, UnknownName
from ...core.files import write_text
from ...core.files.tables import Table
from ..mechanism import Mechanism
from .mechanism_reading import read_root
from .mechanism_writing import SCHEMA, mechanism_table

__all__ = ["preset", "presets", "read_mechanism", "write_mechanism"]


def presets() -> list[str]:
    """Names of the published mechanisms that come with the package, sorted."""
    folder = files("exo_pin.design") / "presets"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def preset(name: str) -> Mechanism:
    """Load a published mechanism.

    Raises
    ------
    UnknownName
        If there is none of that name; the message lists those there are.
    """
    if name not in presets():
        raise UnknownName("preset", name, presets())
    text = (files("exo_pin.design") / "presets" / f"{name}.toml").read_text(encoding="utf-8")
    return _parse(text, f"{name}.toml")


def read_mechanism(path: str | PathLike[str]) -> Mechanism:
    """Load a mechanism from a TOML file.

    Parameters
    ----------
    path : path-like
        The file. Keys carry their units; the presets are examples of the format.

    Raises
    ------
    FileFormatError
        If the file is not TOML, or a key is unknown, missing or has a wrong value; the key is named.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError, TypeError) as error:
        raise FileFormatError(f"cannot be read: {error}", path) from error
    return _parse(text, path)


def write_mechanism(mechanism: Mechanism, path: str | PathLike[str]) -> None:
    """Save a mechanism as a TOML file in SI units, so that it loads back bit for bit.

    The file appears whole or not at all.
    """
    write_text(path, tomli_w.dumps(mechanism_table(mechanism)))


def _parse(text: str, path: str | PathLike[str]) -> Mechanism:
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        raise FileFormatError(f"not TOML: {error}", path) from error
    root = Table(data, path)
    schema = root.integer("schema")
    if schema != SCHEMA:
        raise root.error(f"this version reads schema {SCHEMA}, got {schema}", "schema")
    try:
        return read_root(root)
    except FileFormatError:
        raise
    except ExoPinError as error:
        # A value that its record refuses: say in which file.
        raise FileFormatError(str(error), path) from error
