"""Designs from a table: one row a design, with other values of its parameters."""

from __future__ import annotations

from os import PathLike, fspath, path
from typing import Any

from ..core.errors import ExoPinError, FileFormatError, InvalidInput
from ..core.files.csv_tables import read_csv
from ..design import presets
from ..design.parameters.names import values_of
from .loading import load
from .shoulder_exo import ShoulderExo

#: Columns that are no parameters.
_DESIGN, _NAME = "design", "name"


def load_designs(table: str | PathLike[str], side: str | None = None) -> tuple[ShoulderExo, ...]:
    r"""Designs of any kind from the rows of a CSV file, such as for :func:`exo_pin.study.compare`.

    Parameters
    ----------
    table : str or path-like
        The file. Its column ``design`` names a preset or a file, as :func:`exo_pin.load` takes it, seen from the
        table's folder; ``name`` is what the design is called, if there is such a column. All others are parameters, in
        the language of :func:`exo_pin.sweep` (``r_A_mm``, ``end_b[limb_1_base].x_mm``); a blank cell leaves the value
        of the design.
    side : {"left", "right"}, optional
        As of :func:`exo_pin.load`.

    Returns
    -------
    tuple of ShoulderExo
        One a row. Without a name of its own a design is called after its file and what is changed.

    Raises
    ------
    FileFormatError
        If there is no column ``design`` or no row, or a row does not make a design; the message names its line.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> table = Path(tempfile.mkdtemp(), "designs.csv")
    >>> _ = table.write_text("design,cuff_height_mm\nfour-cables,\nfour-cables,200\n")
    >>> designs = ep.load_designs(table)
    >>> [exo.name for exo in designs]
    ['four-cables', 'four-cables cuff_height_mm=200']
    >>> ep.study.compare(*designs, poses=designs[0].pose([0, 30, 60]))["can_hold"]
    array([1., 1.])
    """
    given = read_csv(table)
    if _DESIGN not in given.columns:
        raise FileFormatError(f"expected a column {_DESIGN!r}; the header has {', '.join(given.columns)}", table)
    if not given.rows:
        raise FileFormatError("expected at least one row", table)
    found = []
    for line, cells in zip(given.lines, given.rows, strict=True):
        row = dict(zip(given.columns, cells, strict=True))
        try:
            found.append(_designed(row, path.dirname(fspath(table)), side))
        except ExoPinError as error:
            raise FileFormatError(f"line {line}: {error}", table) from error
    return tuple(found)


def _designed(row: dict[str, str], folder: str, side: str | None) -> ShoulderExo:
    source, name = row.pop(_DESIGN), row.pop(_NAME, "")
    exo = load(source if source in presets() else path.join(folder, source), side)
    asked = {key: text for key, text in row.items() if text}
    values: dict[Any, Any] = {}
    for named, text in zip(exo.device.parameters(asked), asked.values(), strict=True):
        each = values_of(named, text)
        if len(each) != 1:
            raise InvalidInput(f"expected one value of {named.name}, got {text!r}")
        values[named] = named.in_si(each[0])
    words = " ".join((exo.name, *(f"{key}={text}" for key, text in asked.items())))
    if not values and not name:
        return exo
    return ShoulderExo.from_device(exo.device.with_values(values).replace(name=name or words))
