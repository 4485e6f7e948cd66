"""Tables as laboratories have them: separators, decimal commas, rows before the header, units, encodings.

The numbers come out as those of :mod:`exo_pin.core.files.csv_tables`, whose checks of rows and cells apply. Names of
columns are compared in small letters, with blanks as ``_``, and a unit in brackets or in a row of its own is appended:
``Flexion [deg]`` is ``flexion_deg``. Which units there are is the caller's: words in small letters, and the endings
that they make.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike

from ..errors import FileFormatError
from ..errors.base import echo
from ..records import Record
from .atomic import read_file
from .csv_tables import NUMBER, CsvTable, cells_of

#: What else stands in a row of units.
_OTHER_UNITS = {"", "-", "1", "none", "m", "mm", "cm", "m/s", "m/s²", "m/s^2", "rad/s", "deg/s", "°/s", "µt", "ut", "n"}
_BRACKETS = re.compile(r"(.*?)[\s_]*[\[(]([^\[\]()]*)[\])]")
_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?")
_POINT = re.compile(r"[+-]?[0-9]*\.[0-9]+(?:[eE][+-]?[0-9]+)?")
_SEPARATORS = ("\t", ";", ",")
_MARKS = ("#", "//")
#: Most lines before a header, and share of bytes beyond ASCII of a text in an old encoding of the West.
_PREAMBLE, _FOREIGN = 200, 0.05


@dataclass(frozen=True)
class Layout(Record):
    """A table and what stood around it.

    Attributes
    ----------
    table : CsvTable
        Cells with decimal points, columns by their compared names.
    labels : tuple of str
        The columns as the file names them.
    header : mapping of str to str
        Entries before the table, names in small letters.
    dialect : str
        What was unlike a plain CSV file, in words.
    """

    table: CsvTable
    labels: tuple[str, ...]
    header: dict[str, str]
    dialect: str


def decoded(path: str | PathLike[str]) -> tuple[str, str]:
    """The text of a file, and its encoding where it is not UTF-8."""
    content = read_file(path)
    try:
        return content.decode("utf-8-sig"), ""
    except UnicodeDecodeError as error:
        problem = error
    for name in ("utf-16", "cp1252"):
        try:
            text = content.decode(name)
        except UnicodeDecodeError:
            continue
        foreign = sum(not sign.isascii() for sign in text)
        marked = name != "utf-16" or content[:2] in (b"\xff\xfe", b"\xfe\xff")
        if marked and "\0" not in text and "\n" in text and foreign <= _FOREIGN * len(text):
            return text, name
    raise FileFormatError(f"cannot be read: expected UTF-8, {problem}", path)


def read_layout(path: str | PathLike[str], known: Mapping[str, str]) -> Layout:
    """The table of a text file; ``known`` are the units."""
    text, encoding = decoded(path)
    return parse_layout(text, path, known, encoding)


def parse_layout(text: str, path: str | PathLike[str] | None, known: Mapping[str, str], encoding: str = "") -> Layout:
    """The table of a text.

    Raises
    ------
    FileFormatError
        If there is no header, a column is named twice, or a row has more or fewer cells than the header.
    """
    comments: list[str] = []
    lines: list[tuple[int, str]] = []
    header: dict[str, str] = {}
    opensim = False
    for number, line in enumerate(io.StringIO(text, newline=None), 1):
        mark = next((each for each in _MARKS if line.startswith(each)), None)
        if mark is not None:
            comments.append(line[len(mark) :].strip())
        elif line.strip().lower() == "endheader":
            opensim = True
            header |= _entries(part for _, part in lines)
            lines = []
        elif line.strip():
            lines.append((number, line.rstrip("\n")))
    header |= _entries(comments)
    if lines and (named := re.fullmatch(r'"?sep=(.)"?,*', lines[0][1].strip())):
        lines = lines[1:]
        separator = named[1]
    else:
        separator = _separator([line for _, line in lines])
    if not lines:
        raise FileFormatError("is empty; expected a header line that names the columns", path)
    if opensim and separator == ",":
        rows = [(number, tuple(line.split())) for number, line in lines]
    else:
        rows = [(number, cells_of(line, number, path, separator)) for number, line in lines]
    start, width = _header_row(rows)
    header |= _entries(f"{row[0]}={' '.join(row[1:]).strip()}" for _, row in rows[:start] if row)
    trimmed = [(number, _trimmed(row, width)) for number, row in rows[start:]]
    (number, labels), body = trimmed[0], trimmed[1:]
    if twice := sorted({name for name in labels if labels.count(name) > 1}):
        raise FileFormatError(f"line {number}: the header names {', '.join(map(repr, twice))} twice", path)
    units = [""] * len(labels)
    if body and _are_units(body[0][1], len(labels), known):
        units, body = list(body[0][1]), body[1:]
    for row_number, row in body:
        if len(row) != len(labels):
            raise FileFormatError(
                f"line {row_number}: expected {len(labels)} cells as in the header, got {len(row)}", path
            )
    rows_of_text, comma = _with_points([row for _, row in body], path)
    words = [f"{encoding} text"] if encoding else []
    words += [{"\t": "tabs", ";": "semicolons"}[separator]] if separator in ("\t", ";") and not opensim else []
    words += ["decimal commas"] if comma else []
    words += ["a row of units"] if any(units) else []
    words += [f"{start} lines before the header"] if start else []
    names = _distinct([column_name(label, unit, known) for label, unit in zip(labels, units, strict=True)])
    table = CsvTable(path, names, rows_of_text, tuple(number for number, _ in body), tuple(comments))
    return Layout(table, labels, header, ", ".join(words))


def column_name(label: str, unit: str, known: Mapping[str, str]) -> str:
    """The name that a column is compared by."""
    name = label.strip()
    if (match := _BRACKETS.fullmatch(name)) and (match[2].strip().lower() in known):
        name, unit = match[1], match[2]
    name = re.sub(r"[\s-]+", "_", name.strip().lower())
    ending = known.get(unit.strip().lower(), "")
    return f"{name}_{ending}" if ending and not name.endswith(f"_{ending}") else name


def _entries(lines: Iterable[str]) -> dict[str, str]:
    """``name=value`` and ``name: value`` lines of a header."""
    found = {}
    for line in lines:
        name, *value = re.split("[=:]", line, maxsplit=1)
        if value:
            found[name.strip(" :").lower()] = value[0].strip(" ,\t=:")
    return found


def _separator(lines: list[str]) -> str:
    """The sign that parts a number from the rest in most of the last lines; the first of :data:`_SEPARATORS` that does.

    A sentence in a cell may hold any of them.
    """
    last = lines[len(lines) // 2 :]

    def parts(line: str, sign: str) -> bool:
        return sign in line and any(_is_value(cell.strip(' "')) for cell in line.split(sign))

    return next((sign for sign in _SEPARATORS if 2 * sum(parts(line, sign) for line in last) > len(last)), ",")


def _is_value(cell: str) -> bool:
    return bool(NUMBER.fullmatch(cell) or _COMMA.fullmatch(cell))


def _header_row(rows: list[tuple[int, tuple[str, ...]]]) -> tuple[int, int]:
    """Which row names the columns, and how many cells a row has."""
    widths = Counter(len(row) for _, row in rows[len(rows) // 2 :])
    width = widths.most_common(1)[0][0]
    for index, (_, row) in enumerate(rows[:_PREAMBLE]):
        named = len(row) > 1 and sum(bool(cell) for cell in row) > 0.5 * len(row)
        if named and abs(len(row) - width) <= 1 and not any(_is_value(cell) for cell in row):
            return index, len(row) - (row[-1] == "")
    return 0, len(rows[0][1])


def _trimmed(row: tuple[str, ...], width: int) -> tuple[str, ...]:
    """A row without the empty cell that a separator at its end makes."""
    return row[:-1] if len(row) == width + 1 and row[-1] == "" else row


def _are_units(row: tuple[str, ...], width: int, known: Mapping[str, str]) -> bool:
    words = [cell.strip(" []()").lower() for cell in row]
    units = all(word in known or word in _OTHER_UNITS for word in words)
    return len(row) == width and units and any(word in known for word in words)


def _with_points(
    rows: list[tuple[str, ...]], path: str | PathLike[str] | None
) -> tuple[tuple[tuple[str, ...], ...], bool]:
    """Cells with decimal points, and whether they had commas."""
    if not any(_COMMA.fullmatch(cell) for row in rows for cell in row):
        return tuple(rows), False
    for row in rows:
        for cell in row:
            if _POINT.fullmatch(cell):
                message = f"expected one decimal mark, got commas and, in {echo(cell)}, a point"
                raise FileFormatError(message, path)
    points = ((cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in row) for row in rows)
    return tuple(tuple(row) for row in points), True


def _distinct(names: list[str]) -> tuple[str, ...]:
    """Names that are equal but for capitals or units are told apart."""
    seen: Counter[str] = Counter()
    found = []
    for name in names:
        seen[name] += 1
        found.append(name if seen[name] == 1 else f"{name}#{seen[name]}")
    return tuple(found)
