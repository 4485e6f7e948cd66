"""Tables and paragraphs as text, for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

__all__ = ["WIDTH", "aligned", "filled", "indented", "under_verdict"]

#: Columns of a line.
WIDTH = 100


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table whose cells end below one another."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]


def filled(text: str) -> str:
    """A paragraph, broken into lines."""
    return textwrap.fill(text, WIDTH)


def indented(text: str) -> str:
    """The same, by two columns to the right."""
    return textwrap.fill(text, WIDTH, initial_indent="  ", subsequent_indent="  ")


def under_verdict(verdict: str, cautions: Iterable[str]) -> str:
    """A verdict with the cautions below it, each a paragraph; nothing for what is empty."""
    return "\n".join(filled(text) for text in (verdict, *(f"Caution: {each}" for each in cautions)) if text)
