"""Mechanisms as TOML files, and the published mechanisms of the package."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.resources import files
from os import PathLike

from ...core.files.toml_tables import TomlTable, naming_file, parse_toml, read_toml, toml_text, write_toml
from ...core.validation import as_choice
from ..mechanism import Mechanism
from .mechanism_reading import read_root
from .mechanism_writing import SCHEMA, mechanism_table

#: The design that a question takes where none is named: of all presets the one that holds most daily poses clear of
#: everyone from a woman's 5th to a man's 95th percentile while the elbow bends to 130°.
DEFAULT_PRESET = "four-linear-actuators-worn"
#: Folders of the mechanisms that come with the package: published ones, and those that a search has found.
_PUBLISHED, _FOUND = ("presets",), ("presets", "found")


def presets() -> list[str]:
    """Names of the mechanisms that come with the package, sorted: published ones and found ones."""
    return sorted([*published(), *_names(_FOUND)])


def published() -> list[str]:
    """Names of the mechanisms that the thesis publishes, sorted."""
    return _names(_PUBLISHED)


def _names(folder: tuple[str, ...]) -> list[str]:
    entries = files("exo_pin.design").joinpath(*folder).iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml"))


def preset(name: str) -> Mechanism:
    """Load a mechanism that comes with the package.

    Raises
    ------
    UnknownName
        If there is none of that name; the message lists those there are.
    """
    return _loaded(as_choice("preset", name, presets()))


def preset_file(name: str) -> str:
    """Text of the file of a mechanism that comes with the package.

    Raises
    ------
    UnknownName
        If there is none of that name; the message lists those there are.
    """
    folder = _PUBLISHED if as_choice("preset", name, presets()) in published() else _FOUND
    return files("exo_pin.design").joinpath(*folder, f"{name}.toml").read_text(encoding="utf-8")


@cache
def _loaded(name: str) -> Mechanism:
    """A mechanism is frozen throughout, so that all who load it may share it."""
    return _mechanism(parse_toml(preset_file(name), f"{name}.toml"))


def read_mechanism(path: str | PathLike[str]) -> Mechanism:
    """Load a mechanism from a TOML file.

    Parameters
    ----------
    path : path-like
        The file. Keys carry their units; the presets are examples of the format.

    Raises
    ------
    FileFormatError
        If the path is no regular file, the file is not TOML, or a key is unknown, missing or has a wrong value; the
        key is named.
    """
    return _mechanism(read_toml(path))


def write_mechanism(mechanism: Mechanism, path: str | PathLike[str]) -> None:
    """Save a mechanism as a TOML file in SI units, so that it loads back bit for bit.

    The file appears whole or not at all.
    """
    write_toml(path, mechanism_table(mechanism))


def mechanism_hash(mechanism: Mechanism) -> str:
    """SHA-256 of the file that :func:`write_mechanism` writes: the same design has the same, on any machine."""
    return hashlib.sha256(toml_text(mechanism_table(mechanism)).encode("utf-8")).hexdigest()


def _mechanism(root: TomlTable) -> Mechanism:
    root.require_schema(SCHEMA)
    with naming_file(root.path):
        return read_root(root)
