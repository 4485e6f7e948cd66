"""The printed tables of the source as arrays, cell by cell as printed, misprints included and noted."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.checked import checked
from ...core.files.csv_tables import parse_csv
from ...core.records import Record
from ...core.validation import FloatArray, frozen

#: Nominal length in m of the muscle that all tables were measured on, Φ6-300.
NOMINAL_LENGTH = 0.3

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_BRACKET = re.compile(r"\((-?\d+(?:\.\d+)?)%\)")


@checked
@dataclass(frozen=True)
class Table:
    """One printed table.

    Attributes
    ----------
    name : str
        For example "3-1".
    title, source, units : str
        What it is, where from, and in which units the cells are.
    notes : tuple of str
        Misprints and gaps.
    rows, columns : tuple of str
        Printed heads.
    printed : tuple of tuple of str
        The cells exactly as printed; "/" and "" mean an empty cell.

    Examples
    --------
    >>> from exo_pin.muscle import table
    >>> printed = table("3-1")
    >>> len(printed.rows), len(printed.columns), printed.units
    (10, 7, 'cells bar; columns hung weight in N; rows regulator setting in bar')
    """

    name: str
    title: str
    source: str
    units: str
    notes: tuple[str, ...]
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    printed: tuple[tuple[str, ...], ...]

    def _cells(self, pattern: re.Pattern[str], group: int) -> FloatArray:
        # A cell holds the force, then the error in brackets.
        find = pattern.match if group == 0 else pattern.search
        found = [[find(cell) for cell in row] for row in self.printed]
        return frozen(np.array([[float(m.group(group)) if m else np.nan for m in row] for row in found]))

    @property
    def present(self) -> NDArray[np.bool_]:
        """Shape (rows, columns), whether a cell holds a number."""
        return np.isfinite(self.values)

    @property
    def values(self) -> FloatArray:
        """Shape (rows, columns), the first number of each cell; NaN exactly where ``present`` is False."""
        return self._cells(_NUMBER, 0)

    @property
    def errors_percent(self) -> FloatArray:
        """Shape (rows, columns), the bracketed error of a cell in percent, NaN where none is printed."""
        return self._cells(_BRACKET, 1)

    @property
    def groups(self) -> FloatArray:
        """Shape (rows, columns, 5), the five numbers of a cell of Tables 3-4 and B-1, NaN where none are."""
        out = np.full((len(self.rows), len(self.columns), 5), np.nan)
        for i, row in enumerate(self.printed):
            for j, cell in enumerate(row):
                numbers = _NUMBER.findall(cell)
                if len(numbers) == 5:
                    out[i, j] = [float(n) for n in numbers]
        return frozen(out)

    @property
    def row_numbers(self) -> FloatArray:
        """Shape (rows,), heads of the rows as numbers (regulator setting in bar)."""
        return frozen(np.array([float(r) for r in self.rows]))

    @property
    def column_numbers(self) -> FloatArray:
        """Shape (columns,), heads of the columns as numbers (hung weight in N)."""
        return frozen(np.array([float(c) for c in self.columns]))

    def row(self, head: str) -> FloatArray:
        """Numbers of the row with this head, without the empty cells.

        Parameters
        ----------
        head : str
            First cell of the row.

        Returns
        -------
        ndarray

        Raises
        ------
        UnknownName
            If there is no such row; it lists those there are.

        Examples
        --------
        >>> from exo_pin.muscle import table
        >>> contractions = table("3-1")
        >>> contractions.row(contractions.rows[-1])
        array([4.054, 4.051, 4.069, 3.994, 4.009, 3.974, 4.024])
        """
        if head not in self.rows:
            raise UnknownName("row", head, self.rows, f"Table {self.name}")
        values = self.values[self.rows.index(head)]
        return frozen(values[np.isfinite(values)])


def tables() -> list[str]:
    """Names of the tables there are, for example "3-1".

    Returns
    -------
    list of str

    Examples
    --------
    >>> from exo_pin.muscle import tables
    >>> len(tables())  # of measurements that the thesis prints
    10
    """
    folder = files("exo_pin.muscle") / "data"
    return sorted(f.name[6:-4] for f in folder.iterdir())


@cache
def table(name: str) -> Table:
    """Return one printed table.

    Parameters
    ----------
    name : str
        "3-1", "3-2", "3-3a", "3-3b", "3-3c", "3-4", "a-1", "a-2", "a-3" or "b-1".

    Returns
    -------
    Table

    Raises
    ------
    UnknownName
        If there is no such table; it lists those there are.

    Examples
    --------
    >>> from exo_pin.muscle import table
    >>> table("3-4").title
    'Table 3-4, optimal coefficients N_2, N_1, N_0, D_1, D_2 of the dynamic force model (3-22) for each test'
    """
    key = str(name).lower()
    if key not in tables():
        raise UnknownName("table", name, tables())
    text = (files("exo_pin.muscle") / "data" / f"table-{key}.csv").read_text(encoding="utf-8")
    cells = parse_csv(text, f"table-{key}.csv")
    head = [comment.split(": ", 1) for comment in cells.comments]
    facts = {k: v for k, v in head if k != "note"}
    return Table(
        name=key,
        **facts,
        notes=tuple(v for k, v in head if k == "note"),
        rows=tuple(row[0] for row in cells.rows),
        columns=cells.columns[1:],
        printed=tuple(row[1:] for row in cells.rows),
    )


@checked
@dataclass(frozen=True)
class SteadyStates(Record):
    """Steady states of hung weights, Tables 3-1 and 3-2, one entry a cell that has data.

    Attributes
    ----------
    contraction, pressure, force : ndarray
        Shape (n,), m, Pa and N (the hung weight).
    regulator : ndarray
        Shape (n,), Pa, the setting of the regulator, the row of the tables.
    called_valid : ndarray of bool
        Shape (n,), whether Table 3-3c prints an error for the cell, that is, calls it valid.

    Examples
    --------
    >>> from exo_pin.muscle import steady_states
    >>> states = steady_states()
    >>> len(states.force), round(float(states.force.max()), 1), round(1e3 * float(states.contraction.max()))  # N, mm
    (66, 72.7, 75)
    """

    contraction: FloatArray
    pressure: FloatArray
    force: FloatArray
    regulator: FloatArray
    called_valid: NDArray[np.bool_]

    def select(self, mask: NDArray[np.bool_]) -> SteadyStates:
        """Return those where ``mask``, shape (n,), is True.

        Parameters
        ----------
        mask : ndarray of bool
            Shape (n,).

        Returns
        -------
        SteadyStates

        Examples
        --------
        >>> from exo_pin.muscle import steady_states
        >>> states = steady_states()
        >>> heavy = states.select(states.force > 20.0)
        >>> len(heavy.force), bool(heavy.force.min() > 20.0)  # N
        (57, True)
        """
        if np.shape(mask) != self.force.shape:
            raise InvalidInput(f"expected mask to have shape {self.force.shape}, got {np.shape(mask)}")
        return SteadyStates(**{name: frozen(values[mask]) for name, values in vars(self).items()})


@cache
def steady_states(valid_only: bool = False) -> SteadyStates:
    """Return the steady states of Tables 3-1 and 3-2 in SI units.

    Parameters
    ----------
    valid_only : bool
        Whether to keep only the 25 cells that Table 3-3c calls valid and that have data. (Table 3-3c prints 26
        errors; Tables 3-1 and 3-2 have no data at 2.0 bar, 12.74 N.)

    Returns
    -------
    SteadyStates
        66 states, or 25.

    Notes
    -----
    Source: thesis Table 3-1, Table 3-2.

    Examples
    --------
    >>> from exo_pin.muscle import steady_states
    >>> len(steady_states().force), len(steady_states(valid_only=True).force)  # Tables 3-1 and 3-2
    (66, 25)
    """
    pressure, contraction, printed = table("3-1"), table("3-2"), table("3-3c")
    present = pressure.present & contraction.present
    shape = present.shape
    regulator = np.broadcast_to(pressure.row_numbers[:, np.newaxis], shape)
    weight = np.broadcast_to(pressure.column_numbers, shape)
    states = SteadyStates(
        contraction=frozen(contraction.values[present] / 1e3),
        pressure=frozen(pressure.values[present] * 1e5),
        force=frozen(weight[present].copy()),
        regulator=frozen(regulator[present] * 1e5),
        called_valid=frozen(np.isfinite(printed.errors_percent)[present]),
    )
    return states.select(states.called_valid) if valid_only else states
