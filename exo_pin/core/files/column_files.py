"""Columns of equal length as a file: a table as text, or arrays for NumPy."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np

from .atomic import write_bytes, write_text
from .csv_tables import csv_text
from .targets import is_stream


def write_columns(path: str | PathLike[str], columns: Mapping[str, Any]) -> None:
    """Write columns by name; the file appears whole or not at all.

    Parameters
    ----------
    path : path-like
        ``.npz``: the arrays as they are, for :func:`numpy.load`. Anything else: a table, one line a row, with an empty
        cell for NaN.
    columns : mapping of str to array_like
        All of one shape; in a table one row an element.
    """
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    if os.fspath(path).lower().endswith(".npz") and not is_stream(path):
        buffer = io.BytesIO()
        np.savez_compressed(buffer, allow_pickle=False, **{name: _plain(array) for name, array in arrays.items()})
        write_bytes(path, buffer.getvalue())
    else:
        rows = zip(*(array.ravel().tolist() for array in arrays.values()), strict=True)
        write_text(path, csv_text(arrays, ([_cell(value) for value in row] for row in rows)))


def _plain(array: np.ndarray) -> np.ndarray:
    """Texts as such, because NumPy's files hold no Python objects without pickling."""
    return array.astype(str) if array.dtype == object else array


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if np.isnan(value) else repr(value)
    return str(value)
