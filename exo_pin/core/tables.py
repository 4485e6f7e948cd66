"""Tables and paragraphs: text for a terminal, HTML for notebooks, made of text that is never taken for markup."""

from __future__ import annotations

import math
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence
from html import escape

#: Columns of a line.
WIDTH = 100

#: How sentences begin that are notes below an answer, and no cautions above it.
NOTES = ("Not ", "Posture: ")


#: What no identifier has.
_NO_WORD = re.compile(r"\W")


def html_table(
    header: Sequence[str],
    rows: Iterable[Sequence[str]],
    above: Iterable[str] = (),
    below: Iterable[str] = (),
    numbers: bool = True,
) -> str:
    """A table with paragraphs above, in bold, and below; its first column is words.

    Parameters
    ----------
    header : sequence of str
        Heads of the columns; no line of heads if all are empty.
    rows : iterable of sequences of str
        Cells, as many as heads.
    above, below : iterable of str
        Paragraphs.
    numbers : bool
        Whether the other columns are numbers, which stand on the right.
    """

    def line(cells: Sequence[str], tag: str) -> str:
        sides = ["left", *["right" if numbers else "left"] * (len(cells) - 1)]
        return "".join(
            f'<{tag} style="text-align:{side};vertical-align:top">{escape(cell.strip())}</{tag}>'
            for cell, side in zip(cells, sides, strict=True)
        )

    head = f"<thead><tr>{line(header, 'th')}</tr></thead>" if any(header) else ""
    body = "".join(f"<tr>{line(row, 'td')}</tr>" for row in rows)
    before = "".join(f"<p><b>{escape(text)}</b></p>" for text in above)
    after = "".join(f"<p>{escape(text)}</p>" for text in below)
    return f"{before}<table>{head}<tbody>{body}</tbody></table>{after}"


def aligned(rows: Sequence[Sequence[str]], words: int = 0) -> list[str]:
    """Lines of a table whose cells end below one another, but for the first columns of words, which begin so."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    sides = [str.ljust] * words + [str.rjust] * (len(widths) - words)
    cells = ([side(cell, width) for side, cell, width in zip(sides, row, widths, strict=True)] for row in rows)
    return ["  ".join(row).rstrip() for row in cells]


def three_digits(value: float) -> str:
    """A number with three significant digits, and six decimals at most; whole from 100 on."""
    size = abs(value)
    return "0" if size < 5e-7 else f"{value:.{min(6, max(0, 2 - math.floor(math.log10(size))))}f}"


def newtons(value: float) -> str:
    """A force, or a share in percent, for reading: whole from 10 on, else with one decimal."""
    text = f"{value:.0f}" if abs(value) >= 9.95 else f"{value:.1f}"
    return "0" if float(text) == 0.0 else text


def percent(share: float, decimals: int = 1) -> str:
    """A share in percent, never rounded to all or to none: "87.5 %", "100 %"."""
    least = 10.0**-decimals
    value = min(max(100.0 * share, least * (share > 0.0)), 100.0 - least * (share < 1.0))
    return f"{value:.{decimals}f}".removesuffix(".0") + " %"


def effort_column(name: str, unit: str) -> str:
    """Column of the effort of a drive, an identifier that ends in its unit: "f_2_N" of limb 2."""
    return _NO_WORD.sub("_", f"{name.replace('limb ', 'f_')}_{unit}")


def position_column(name: str, unit: str) -> str:
    """Column of the position of a drive whose effort is in ``unit``: "length_2_m" of limb 2."""
    own = name.replace("limb ", "length_") if name.startswith("limb ") else f"{name}_position"
    return _NO_WORD.sub("_", f"{own}_{'rad' if unit == 'N m' else 'm'}")


def screen_width(most: int) -> int:
    """Columns of the terminal, 60 at least, and at most so many; these where the output is no terminal."""
    if not (sys.stdout and sys.stdout.isatty()):
        return most
    return min(most, max(60, shutil.get_terminal_size((most, 24)).columns))


def in_blocks(rows: Sequence[Sequence[str]], width: int, repeated: int = 1) -> list[list[list[str]]]:
    """A table as several of at most ``width`` columns of text, each with the first ``repeated`` columns.

    A column that is too wide for that stands alone with them.
    """
    columns = [list(column) for column in zip(*rows, strict=True)]
    first, blocks = columns[:repeated], [columns[:repeated]]
    for column in columns[repeated:]:
        block = [*blocks[-1], column]
        if len(blocks[-1]) > repeated and sum(max(map(len, each)) + 2 for each in block) - 2 > width:
            blocks.append(block := [*first, column])
        blocks[-1] = block
    return [[list(row) for row in zip(*block, strict=True)] for block in blocks]


def filled(text: str) -> str:
    """A paragraph, broken into lines."""
    return textwrap.fill(text, screen_width(WIDTH))


def indented(text: str) -> str:
    """The same, by two columns to the right."""
    return textwrap.fill(text, screen_width(WIDTH), initial_indent="  ", subsequent_indent="  ")


def under_verdict(verdict: str, cautions: Iterable[str]) -> str:
    """A verdict with the cautions below it, each a paragraph; nothing for what is empty."""
    return "\n".join(filled(text) for text in (verdict, *(f"Caution: {each}" for each in cautions)) if text)


def enumerated(words: Iterable[str]) -> str:
    """Words with commas, and "and" before the last; "none" of no words."""
    *first, last = list(words) or ["none"]
    return f"{', '.join(first)} and {last}" if first else last


def limb_list(numbers: Iterable[int]) -> str:
    """The limbs of these numbers, counted from 1, in words: "limbs 1 and 3"; "no limb" of none."""
    every = [str(number) for number in numbers]
    return f"limb{'s' * (len(every) > 1)} {enumerated(every)}" if every else "no limb"


def drive_list(drive_units: Sequence[tuple[str, str]], rows: Iterable[int]) -> str:
    """Drives of these rows by their names, from 0: "flexion and abduction", or "limbs 1 and 3"."""
    names = [drive_units[row][0] for row in rows]
    numbers = [name.removeprefix("limb ") for name in names]
    return limb_list(map(int, numbers)) if all(map(str.isdigit, numbers)) else enumerated(names)
