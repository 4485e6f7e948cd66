"""Tidy tables of design studies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput, UnknownName
from ..core.errors.base import echo
from ..core.files import write_text
from ..core.files.csv_tables import csv_text
from ..core.notebook_tables import html_table
from ..core.pictures import drawn
from ..core.records import Record
from ..core.results import frame_of
from ..reaction.columns import peak_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["StudyTable", "with_unit"]

#: Beginnings of the columns of parameters, and their units.
_UNITS = (
    (("r_A", "r_B", "h_A", "h_B"), "m"),
    (("alpha", "lean_"), "rad"),
    (("arm", "person", "payload"), "kg"),
    (("gravity",), "m_s2"),
)
#: Endings of names that have a unit already.
_ENDINGS = ("_m", "_mm", "_rad", "_deg", "_kg", "_m_s2")


def _common_names(rows: Any) -> list[str]:
    """Names of the columns of rows, which all have the same."""
    if not isinstance(rows, Sequence) or not all(isinstance(row, Mapping) for row in rows):
        raise InvalidInput(f"expected rows as a sequence of mappings, one a design, got {echo(rows)}")
    names = list(rows[0]) if rows else []
    for number, row in enumerate(rows, 1):
        if set(row) != set(names):
            other = ", ".join(sorted(map(str, set(row) ^ set(names))))
            raise InvalidInput(f"expected all rows to have the same columns, but row {number} differs in {other}")
    return names


class StudyTable(Record, Mapping[str, NDArray[Any]]):
    """Columns of equal length by name: one row a design, NaN where a figure has no meaning.

    Parameters
    ----------
    rows : sequence of dict
        One a design, all with the same keys.
    """

    def __init__(self, rows: Sequence[Mapping[str, Any]]) -> None:
        names = _common_names(rows)
        self._columns = {name: np.array([row[name] for row in rows]) for name in names}
        for column in self._columns.values():
            column.setflags(write=False)

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self._columns[name]
        except KeyError:
            raise UnknownName("column", name, self._columns) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def row_count(self) -> int:
        """Number of designs."""
        return len(next(iter(self._columns.values()), ()))

    @property
    def peak(self) -> float:
        """Largest |F_s| of any design of the table, N; NaN if there is none."""
        return peak_of(np.asarray(self["peak_F_s_N"], dtype=np.float64))

    def in_units(self, units: Mapping[str, tuple[str, float]]) -> StudyTable:
        """The same table with columns in other units.

        Parameters
        ----------
        units : mapping of str to (str, float)
            Name of a column: its new name, and the SI value of the new unit, such as ``{"r_A": ("r_A_mm", 1e-3)}``.

        Raises
        ------
        UnknownName
            If there is no such column.
        InvalidInput
            If a column holds no numbers.
        """
        for name in units:
            if self[name].dtype.kind not in "iuf":
                raise InvalidInput(f"expected numbers in the column {name!r}, got {echo(self[name][0])}")
        columns = dict(self)
        for name, (_, size) in units.items():
            # Rounded, so that 60° is 60 and not 59.99999999999999.
            columns[name] = np.array([float(f"{value / size:.12g}") for value in self[name]])
        heads = [units.get(name, (name,))[0] for name in self]
        return StudyTable([dict(zip(heads, row, strict=True)) for row in zip(*columns.values(), strict=True)])

    def to_pandas(self) -> Any:
        """The table as a pandas DataFrame.

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        return frame_of(self._columns)

    def to_dataframe(self) -> Any:
        """As :meth:`to_pandas`, with the units of the parameters in the names of their columns (``r_A_m``).

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        return self.to_pandas().rename(columns=with_unit)

    def plot(self, figure: str = "peak_F_s_N") -> Figure:
        """Draw a figure of the designs: over one parameter or two as curves, else as bars.

        Parameters
        ----------
        figure : str
            A column of numbers, such as "peak_F_s_N" or "holdable".

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        UnknownName
            If there is no such column.
        MissingExtra
            If matplotlib is not installed.
        """
        return drawn("study_figure", self, figure)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table; the file appears whole or not at all, an empty cell means NaN."""
        rows = ([_cell(column[row], repr) for column in self._columns.values()] for row in range(self.row_count))
        write_text(path, csv_text(self, rows))

    def __str__(self) -> str:
        rows = self._shown()
        width = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        lines = ["  ".join(cell.rjust(size) for cell, size in zip(row, width, strict=True)).rstrip() for row in rows]
        return "\n".join([lines[0], "  ".join("-" * size for size in width), *lines[1:]]) if self._columns else ""

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        heads, *rows = self._shown()
        return html_table(heads, rows)

    def _shown(self) -> list[list[str]]:
        """Heads with units, and rows as text; a dash for what has no meaning. An empty column ``error`` is left out."""
        columns = {
            with_unit(name): [_cell(value, "{:.4g}".format) or "-" for value in column]
            for name, column in self._columns.items()
            if not (name == "error" and not any(_cell(value, repr) for value in column))
        }
        return [list(columns), *(list(row) for row in zip(*columns.values(), strict=True))]


def with_unit(column: str) -> str:
    """A column's name with the unit of its parameter, if it has one that the name lacks."""
    for names, unit in _UNITS:
        if column.startswith(names) and not column.endswith(_ENDINGS):
            return f"{column}_{unit}"
    return column


def _cell(value: Any, number: Callable[[float], str]) -> str:
    if isinstance(value, (float, np.floating)):
        return "" if np.isnan(value) else number(float(value))
    return str(value)
