"""Kinds of options that most commands have: flags, numbers with a unit, files."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["add_count", "add_file", "add_flag", "add_number", "add_repeated"]


def add_flag(parser: argparse.ArgumentParser, name: str, text: str) -> None:
    """Add an option without a value."""
    parser.add_argument(name, action="store_true", help=text)


def add_number(parser: argparse.ArgumentParser, name: str, unit: str, text: str, default: float | None = None) -> None:
    """Add an option with a number; its help says the default, unless that is None."""
    said = text if default is None else f"{text} (default {default:g})"
    parser.add_argument(name, type=float, default=default, metavar=unit, help=said)


def add_count(parser: argparse.ArgumentParser, name: str, text: str, default: int) -> None:
    """Add an option with a whole number."""
    parser.add_argument(name, type=int, default=default, metavar="N", help=f"{text} (default {default})")


def add_repeated(parser: argparse.ArgumentParser, name: str, value: str, text: str) -> None:
    """Add an option that may be given more than once."""
    parser.add_argument(name, action="append", default=[], metavar=value, help=text)


def add_file(parser: argparse.ArgumentParser, name: str, text: str) -> None:
    """Add an option with the path of a file."""
    parser.add_argument(name, type=Path, metavar="FILE", help=text)
