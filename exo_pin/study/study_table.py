"""Tidy tables of design studies."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput, UnknownName
from ..core.errors.base import echo
from ..core.files import write_columns
from ..core.records import Record
from ..core.results import drawn, frame_of, plain
from ..core.schema import identifier
from ..core.tables import aligned, filled, html_table, in_blocks, under_verdict
from ..core.validation import as_texts
from ..reaction.columns import peak_of
from .figure_words import with_unit
from .ranks import places, rank_numbers, row_names, rule_words, verdict_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BOTH_SIDES = (
    "the poses lie on both sides of the singular surface, where the shoulder force has no bound: peak_F_s_N and "
    "least_margin measure how near a pose of the grid comes to it; compare median_F_s_N, p95_F_s_N and can_hold."
)
_NOT_KNOWN = (
    "some limits are not known: holdable counts poses that may not be held; give the design actuators and strokes."
)
_NO_DATA = (
    "a spring has no data in some of the poses (not_evaluated): they do not count as held, and whether they are is not "
    "known."
)
#: Width of a printed table, columns of text; a wider one is continued below, with its first column again.
_WIDEST = 160


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


@dataclass(frozen=True)
class _StudyDocument:
    """Plain data of :class:`StudyTable`.

    Attributes
    ----------
    heading : list of str
        What all rows have in common.
    verdict : str
        Which ranks first.
    ranking : list of int
        Numbers of the rows from 0, the best first.
    ranks : list of int
        Rank of each row.
    ranking_rule : str
        What ranks the rows.
    cautions : list of str
        What limits the meaning of the figures.
    columns : dict of str to list
        By name, which ends in the unit.
    """

    heading: list[str]
    verdict: str
    ranking: list[int]
    ranks: list[int]
    ranking_rule: str
    cautions: list[str]
    columns: dict[str, list[Any]]


class StudyTable(Record, Mapping[str, NDArray[Any]]):
    """Columns of equal length by name: one row a design, NaN where a figure has no meaning.

    Parameters
    ----------
    rows : sequence of dict
        One a design, all with the same keys.
    heading : sequence of str
        Sentences above the table: what all rows have in common.

    Examples
    --------
    >>> rows = [{"design": name, "peak_F_s_N": peak, "can_hold": held, "holdable": held}
    ...         for name, peak, held in (("light", 40.0, 0.8), ("strong", 70.0, 1.0))]
    >>> table = ep.study.StudyTable(rows)
    >>> table.ranking, table.peak  # to hold more poses comes first
    ((1, 0), 70.0)
    """

    def __init__(self, rows: Sequence[Mapping[str, Any]], heading: Sequence[str] = ()) -> None:
        names = _common_names(rows)
        listed = tuple(heading) if isinstance(heading, list) else heading
        self.heading = tuple(text for text in as_texts("heading", listed) if text)
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

    @property
    def ranks(self) -> tuple[int, ...]:
        """Rank of each row, 1 the best, by :attr:`ranking_rule`; equal rows share one.

        Empty for a table without these figures.
        """
        return rank_numbers(self._places)

    @property
    def ranking(self) -> tuple[int, ...]:
        """Numbers of the rows, the best design first, by :attr:`ranking_rule`; equal designs in the order of names.

        Empty for a table without these figures.
        """
        return tuple(row for group in self._places for row in group)

    @property
    def ranking_rule(self) -> str:
        """What ranks the rows, in words; empty for a single row and a table without these figures."""
        return rule_words("common_peak_F_s_N" in self) if len(self.ranking) > 1 else ""

    @property
    def _places(self) -> tuple[tuple[int, ...], ...]:
        return places(self._columns)

    @property
    def verdict(self) -> str:
        """Which design ranks first and which is next; empty for a single design and a table without these figures."""
        return verdict_words(self._columns, self._places) if len(self.ranking) > 1 else ""

    @property
    def cautions(self) -> tuple[str, ...]:
        """What limits the meaning of the figures."""
        found = []
        for name, other, text in (
            ("one_side", 1.0, _BOTH_SIDES),
            ("can_hold", self._columns.get("holdable", 0.0), _NOT_KNOWN),
            ("not_evaluated", None, _NO_DATA),
        ):
            values = np.asarray(self._columns.get(name, ()), dtype=np.float64)
            rows = np.flatnonzero(values > 0.0 if other is None else values < other).tolist()
            if rows:
                which = "every row" if len(rows) == self.row_count else row_names(self._columns, rows)
                found.append(f"{'In' if which.startswith(('every row', 'row ')) else 'With'} {which} {text}")
        return tuple(found)

    def to_dataframe(self) -> Any:
        """A pandas DataFrame, with the units of the parameters in the names of its columns (``r_A_m``).

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        MissingExtra
            If pandas is not installed.

        Examples
        --------
        >>> table = ep.study.StudyTable([{"r_A": 0.12, "holdable": 0.9}, {"r_A": 0.14, "holdable": 0.8}])
        >>> frame = table.to_dataframe()
        >>> frame.columns.tolist(), float(frame["holdable"].mean().round(2))
        (['r_A_m', 'holdable'], 0.85)
        """
        return frame_of(self.columns())

    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns with the units of the parameters in their names.

        Returns
        -------
        dict of str to ndarray

        Examples
        --------
        >>> table = ep.study.StudyTable([{"r_A": 0.12, "holdable": 0.9}, {"r_A": 0.14, "holdable": 0.8}])
        >>> list(table.columns())
        ['r_A_m', 'holdable']
        """
        return {with_unit(name): values for name, values in self._columns.items()}

    @property
    def notes(self) -> dict[str, Any]:
        """What is to be known about the table: heading, verdict, ranks and cautions."""
        names = ("heading", "verdict", "ranking", "ranks", "ranking_rule", "cautions")
        return {name: getattr(self, name) for name in names}

    def plot(self, figure: str | None = None) -> Figure:
        """Draw a figure of the designs: over one parameter or two as curves, else as bars.

        Parameters
        ----------
        figure : str, optional
            A column of numbers, such as "peak_F_s_N" or "holdable". Left out: what a detailed comparison says of each
            device, what ranks the designs of any other comparison (:func:`exo_pin.study.compare`), and of any other
            table "peak_F_s_N". Designs of a comparison stand in the order of their ranks, the best on top.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        UnknownName
            If there is no such column.
        MissingExtra
            If matplotlib is not installed.

        Examples
        --------
        >>> table = ep.study.StudyTable([{"r_A_mm": 100.0 + k, "peak_F_s_N": 60.0 - k} for k in range(4)])
        >>> figure = table.plot("peak_F_s_N")
        >>> figure.axes[0].lines[0].get_xydata()[-1]  # r_A, peak |F_s|
        array([103.,  57.])
        """
        if figure is None and "held_after_failure" in self:
            return drawn("study_plots:comparison_figure", self)
        if figure is None and "rank" in self:
            return drawn("study_plots:ranking_figure", self)
        return drawn("study_plots:study_figure", self, figure or ("contact_N" if "contact_N" in self else "peak_F_s_N"))

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table, with :attr:`notes` in a JSON file beside it; an empty cell means NaN.

        Parameters
        ----------
        path : path-like
            Where to; a header line with the names of the columns, then a line a design. With the ending .xlsx it is a
            workbook.

        Examples
        --------
        >>> exo = ep.load("four-cables")  # without and with 1 kg in the hand
        >>> table = ep.sweep(exo, {"payload_kg": [0.0, 1.0]}, exo.pose(60), payload_at=[0.0, 0.0, -0.55])
        >>> table.to_csv("study.csv")
        >>> np.genfromtxt("study.csv", delimiter=",", names=True)["peak_F_s_N"].round(1)  # N
        array([46.1, 69.3])
        """
        write_columns(path, self.columns(), self.notes)

    def to_json(self, indent: int | None = 2) -> str:
        """Heading, verdict, ranks, cautions and columns as JSON, with their schema; null where a figure has no meaning.

        Parameters
        ----------
        indent : int or None
            Spaces a level; None for one line.

        Returns
        -------
        str

        Examples
        --------
        >>> import json
        >>> table = ep.study.StudyTable([{"r_A_mm": 120.0, "reach": np.nan}, {"r_A_mm": 140.0, "reach": 1.0}])
        >>> json.loads(table.to_json())["columns"]
        {'r_A_mm': [120.0, 140.0], 'reach': [None, 1.0]}
        """
        return json.dumps(self.document(), indent=indent)

    def document(self) -> dict[str, Any]:
        """What :meth:`to_json` writes, as a dict.

        Returns
        -------
        dict
            With :attr:`notes` and the columns as lists; None where a figure has no meaning.

        Examples
        --------
        >>> table = ep.study.StudyTable([{"r_A": 0.12, "reach": np.nan}, {"r_A": 0.14, "reach": 1.0}])
        >>> table.document()["schema"], table.document()["columns"]["reach"]
        ('exo_pin.study_table/1', [None, 1.0])
        """
        return {"schema": identifier("study_table"), "units": {}, **self.notes, "columns": plain(self.columns())}

    def __str__(self) -> str:
        if not self._columns:
            return ""
        found = []
        for rows in in_blocks(self._shown(), _WIDEST):
            ruler = ["-" * max(map(len, column)) for column in zip(*rows, strict=True)]
            found.append("\n".join(aligned([rows[0], ruler, *rows[1:]])))
        words = (*self.heading, self.verdict, self.ranking_rule)
        above = [*(filled(text) for text in words if text), under_verdict("", self.cautions)]
        blocks = ["\n".join(filter(None, above)), *found, "\n".join(map(filled, self._blanks))]
        return "\n\n".join(filter(None, blocks))

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        heads, *rows = self._shown()
        words = (*self.heading, self.verdict, self.ranking_rule, *self.cautions)
        return html_table(heads, rows, above=filter(None, words), below=self._blanks)

    @property
    def _blanks(self) -> list[str]:
        """Why rows have blank figures, a sentence a row."""
        if not {"design", "blank"} <= set(self._columns):
            return []
        pairs = zip(self["design"], self["blank"], strict=True)
        return [f"{name}, blank: {text}." for name, text in pairs if text]

    def _shown(self) -> list[list[str]]:
        """Heads with units, and rows as text; a dash for what has no meaning. Ranks that are shared have a sign.

        Without the column ``blank``, which stands below, and an empty column ``error``.
        """
        columns = {
            with_unit(name): [_cell(value, "{:.4g}".format) or "-" for value in column]
            for name, column in self._columns.items()
            if not (name == "blank" or (name == "error" and not any(_cell(value, repr) for value in column)))
        }
        if "rank" in columns:
            given = columns["rank"]
            columns["rank"] = [f"{each}=" if given.count(each) > 1 else each for each in given]
        return [list(columns), *(list(row) for row in zip(*columns.values(), strict=True))]


def _cell(value: Any, number: Callable[[float], str]) -> str:
    if isinstance(value, (float, np.floating)):
        return "" if np.isnan(value) else number(float(value))
    return str(value)
