"""The one writer of tables: CSV, a workbook, or arrays for NumPy, by the ending of the file.

A CSV file is the table and nothing else. What is to be known about it is a JSON file beside it, of the same name but
for the ending; a workbook has it on a second sheet.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileFormatError, InvalidInput
from ..optional_packages import optional
from .atomic import is_stream, read_text, write_bytes, write_text
from .csv_tables import CONTROL, csv_text

#: What a file beside a table says it is.
TABLE_SCHEMA = "exo_pin.table/1"
#: What a sheet holds at most: rows, columns, and characters of a cell.
_SHEET = (1_048_576, 16_384, 32_767)


def write_columns(
    path: str | PathLike[str], columns: Mapping[str, Any], notes: Mapping[str, Any] | None = None
) -> tuple[Path, ...]:
    """Write columns by name; each file appears whole or not at all.

    Parameters
    ----------
    path : path-like
        ``.npz``: the arrays as they are, for :func:`numpy.load`. ``.xlsx``: a workbook. Anything else: a CSV table, one
        line a row, with an empty cell for NaN.
    columns : mapping of str to array_like
        All of one shape; in a table one row an element.
    notes : mapping of str, optional
        Plain data about the table. Of a CSV file they are a JSON file beside it, of a workbook its second sheet; arrays
        and streams have none.

    Returns
    -------
    tuple of Path
        The files written.

    Raises
    ------
    InvalidInput
        If a workbook cannot hold so many rows or columns, or a file that is no such notes stands where they would be.
    MissingExtra
        If openpyxl is not installed, for a workbook.
    """
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    ending = "" if is_stream(path) else os.path.splitext(path)[1].lower()
    if ending == ".npz":
        buffer = io.BytesIO()
        plain: dict[str, Any] = {name: _plain(array) for name, array in arrays.items()}
        np.savez_compressed(buffer, allow_pickle=False, **plain)
        write_bytes(path, buffer.getvalue())
    elif ending == ".xlsx":
        write_bytes(path, _workbook(arrays, notes or {}))
    else:
        beside = require_notes(path) if notes and ending else None
        write_text(path, csv_text(arrays, ([_cell(value) for value in row] for row in _rows(arrays))))
        if beside is not None:
            about = {"schema": TABLE_SCHEMA, "table": Path(path).name, "columns": list(arrays), **(notes or {})}
            write_text(beside, json.dumps(about, indent=2, ensure_ascii=False) + "\n")
            return Path(path), beside
    return (Path(path),)


def require_notes(path: str | PathLike[str]) -> Path:
    """Where the notes of a CSV table are written.

    Raises
    ------
    InvalidInput
        If another file stands there, which would be lost.
    """
    beside = Path(path).with_suffix(".json")
    if beside.exists():
        try:
            known = json.loads(read_text(beside))
            is_own = isinstance(known, dict) and str(known.get("schema", "")).startswith("exo_pin.table/")
        except (FileFormatError, ValueError):
            is_own = False
        if not is_own:
            message = f"{beside} is no file about a table, and notes about {Path(path).name} would replace it"
            raise InvalidInput(f"{message}: move it, or name the table otherwise")
    return beside


def _rows(arrays: Mapping[str, np.ndarray]) -> Any:
    return zip(*(array.ravel().tolist() for array in arrays.values()), strict=True)


def _workbook(arrays: Mapping[str, np.ndarray], notes: Mapping[str, Any]) -> bytes:
    """A workbook whose first sheet is the table, and whose second one the notes, a name and a text a row."""
    openpyxl = optional("study", "openpyxl")
    count, most = max((array.size for array in arrays.values()), default=0), _SHEET
    if count >= most[0] or len(arrays) > most[1]:
        found = f"got {count} rows and {len(arrays)} columns"
        raise InvalidInput(f"expected at most {most[0] - 1} rows and {most[1]} columns in a sheet, {found}: write .csv")
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("table")
    sheet.freeze_panes = "A2"
    texts = [(name, value if isinstance(value, str) else json.dumps(value)) for name, value in notes.items()]
    for page, lines in ((sheet, [tuple(arrays), *_rows(arrays)]), (None, texts)):
        if lines:
            page = page or book.create_sheet("notes")
            for line in lines:
                page.append([_sheet_cell(openpyxl, page, value) for value in line])
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()


def _sheet_cell(openpyxl: Any, sheet: Any, value: Any) -> Any:
    """Numbers as such, nothing for NaN, and texts that no spreadsheet takes for a formula."""
    if isinstance(value, bool | int):
        return value
    if isinstance(value, float) and not np.isinf(value):
        return None if np.isnan(value) else value
    text = CONTROL.sub(lambda sign: repr(sign[0])[1:-1], str(value))[: _SHEET[2]]
    cell = openpyxl.cell.WriteOnlyCell(sheet, value=text)
    cell.data_type = "s"
    return cell


def _plain(array: np.ndarray) -> np.ndarray:
    """Texts as such, because NumPy's files hold no Python objects without pickling."""
    return array.astype(str) if array.dtype == object else array


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if np.isnan(value) else repr(value)
    return str(value)
