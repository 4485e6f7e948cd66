"""CSV tables, read strictly: the header names the columns with their units, one line is one row.

Lines that start with ``#`` are comments, blank lines are left out. Cells are separated by commas and may be quoted as
:mod:`csv` does it, within their line; numbers have a decimal point. Every row has as many cells as the header.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..errors import FileFormatError
from ..errors.base import echo
from ..records import Record
from ..validation import FloatArray, frozen
from .atomic import read_text

# A number: float() alone would read 1_000, digits of other scripts, inf and nan.
NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
#: A text that would be a spreadsheet's formula without the apostrophe before it.
_FORMULA = re.compile(r"^'('*[=+@-])")
#: Ends of lines, tabs and what a terminal would obey.
CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
#: Cells without a number, in small letters, where these are allowed.
NO_NUMBER = ("", "nan", "na", "n/a", "null")


@dataclass(frozen=True)
class CsvTable(Record):
    """A table of text cells.

    Attributes
    ----------
    path : path-like or None
        The file, for messages.
    columns : tuple of str
        Names in the header, all different.
    rows : tuple of tuple of str
        Cells, without the blanks around them.
    lines : tuple of int
        Line of each row in the file, from 1.
    comments : tuple of str
        Comment lines without their ``#`` and the blanks around them.
    """

    path: str | PathLike[str] | None
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    comments: tuple[str, ...]

    def numbers(self, columns: Sequence[str], gaps: bool = False) -> FloatArray:
        """Columns as finite numbers.

        Parameters
        ----------
        columns : sequence of str
            Their names; other columns are not read.
        gaps : bool
            Whether a cell may be blank or say that there is no number (NaN, NA, null), which gives NaN.

        Returns
        -------
        ndarray
            Shape (n, len(columns)), read-only.

        Raises
        ------
        FileFormatError
            If a column is missing, or a cell is no finite number; the message names its line and column.
        """
        missing = [name for name in columns if name not in self.columns]
        if missing:
            raise FileFormatError(
                f"expected the columns {', '.join(columns)}; missing: {', '.join(missing)}; "
                f"the header has {', '.join(self.columns)}",
                self.path,
            )
        places = [self.columns.index(name) for name in columns]
        values = np.empty((len(self.rows), len(places)))
        for index, (line, row) in enumerate(zip(self.lines, self.rows, strict=True)):
            for column, place in enumerate(places):
                cell = row[place]
                value = float(cell) if NUMBER.fullmatch(cell) else np.nan
                if not np.isfinite(value) and not (gaps and cell.lower() in NO_NUMBER):
                    expected = f"line {line}: expected a finite number in column {columns[column]}"
                    raise FileFormatError(f"{expected}, got {echo(cell)}", self.path)
                values[index, column] = value
        return frozen(values)


def read_csv(path: str | PathLike[str]) -> CsvTable:
    """Read a CSV file.

    Raises
    ------
    FileFormatError
        If the path is no regular file, the text is not UTF-8 (a byte-order mark is allowed), there is no header, a
        column is named twice, a row has more or fewer cells than the header, or a quote is not closed in its line.
    """
    return parse_csv(read_text(path), path)


def parse_csv(text: str, path: str | PathLike[str] | None) -> CsvTable:
    """The table of a CSV text; ``path`` is for messages. It raises as :func:`read_csv` does."""
    comments, lines, rows = [], [], []
    # StringIO ends lines where editors do; str.splitlines would also end them at form feeds and the like.
    for number, line in enumerate(io.StringIO(text, newline=None), 1):
        if line.startswith("#"):
            comments.append(line[1:].strip())
        elif line.strip():
            lines.append(number)
            rows.append(cells_of(line.rstrip("\n"), number, path))
    if not rows:
        raise FileFormatError("is empty; expected a header line that names the columns", path)
    header = rows[0]
    twice = sorted({name for name in header if header.count(name) > 1})
    if twice:
        raise FileFormatError(f"line {lines[0]}: the header names {', '.join(map(repr, twice))} twice", path)
    if len(header) == 1 and re.search("[;\t]", header[0]):
        message = f"expected cells separated by commas, with decimal points, got {echo(header[0])}"
        raise FileFormatError(f"line {lines[0]}: {message}", path)
    for number, row in zip(lines[1:], rows[1:], strict=True):
        if len(row) != len(header):
            raise FileFormatError(f"line {number}: expected {len(header)} cells as in the header, got {len(row)}", path)
    return CsvTable(path, header, tuple(rows[1:]), tuple(lines[1:]), tuple(comments))


def cells_of(line: str, number: int, path: str | PathLike[str] | None, separator: str = ",") -> tuple[str, ...]:
    """The cells of a line, without the blanks around them; ``number`` and ``path`` are for messages."""
    try:
        cells = next(csv.reader([line], strict=True, delimiter=separator))
        return tuple(_FORMULA.sub(r"\1", cell.strip()) for cell in cells)
    except csv.Error as error:
        raise FileFormatError(f"line {number}: not CSV: {error}", path) from error


def csv_text(columns: Iterable[str], rows: Iterable[Iterable[str]], comments: Iterable[str] = ()) -> str:
    """The text of a table, comments first; :func:`parse_csv` reads it back.

    A text that a spreadsheet would run as a formula gets an apostrophe before it, which spreadsheets do not show.
    Ends of lines, tabs and other control characters are written as escapes.
    """
    out = io.StringIO()
    out.writelines(f"# {line}\n" for comment in comments for line in comment.splitlines() or [""])
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows([_as_text(cell) for cell in row] for row in (columns, *rows))
    return out.getvalue()


def _as_text(cell: str) -> str:
    """A cell of one line that no spreadsheet takes for a formula; numbers stay as they are."""
    cell = CONTROL.sub(lambda sign: repr(sign[0])[1:-1], cell)
    if cell.lstrip("'")[:1] not in tuple("=+-@") or NUMBER.fullmatch(cell) or cell in ("-inf", "+inf"):
        return cell
    return f"'{cell}"
