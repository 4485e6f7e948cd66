"""Measurements of a muscle from tables whose headers, or a row of units, say what a column is and in which unit.

A header has a quantity and a unit, in any order of capitals and signs: ``contraction_mm``, ``Pressure [kPa]``,
``force (kgf)``, ``strain``, ``length_mm``, ``pressure_psi_abs``, ``mass_kg``, ``time_ms``. Separators and decimal marks
are those of :mod:`exo_pin.core.files.dialects`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from os import PathLike

from ...core.errors import FileFormatError
from ...core.errors.checked import checked
from ...core.files.dialects import read_layout
from ...core.files.toml_tables import naming_file
from ...core.records import Record
from ...core.validation import FloatArray, as_positive, frozen
from ..identification.dynamic_identification import Recording
from ..identification.plausibility import (
    CONTRACTIONS,
    FORCES,
    PRESSURES,
    as_measurements,
    contraction_from,
    pressure_from,
)

#: Names of quantities in headers, by what they are.
_QUANTITIES = {
    "contraction": ("contraction", "shortening", "stroke"),
    "strain": ("strain", "epsilon", "ratio"),
    "length": ("length",),
    "pressure": ("pressure", "p"),
    "force": ("force", "weight", "load", "pull", "f"),
    "mass": ("mass",),
    "time": ("time", "t"),
}
#: Units in headers, in small letters, and their names.
_UNITS = {
    **{name.lower(): name for name in (*FORCES, *CONTRACTIONS[:4], *PRESSURES[:6])},
    "%": "percent",
    "percent": "percent",
    "pct": "percent",
    "in": "inch",
    "s": "s",
    "ms": "ms",
}
_ABSOLUTE = ("abs", "absolute")
#: Units in brackets or in a row of their own, which become ends of headers.
_IN_ROWS = {word: name.lower() for word, name in _UNITS.items()}
_IN_ROWS |= {f"{unit} {word}": f"{unit}_abs" for unit in _IN_ROWS for word in _ABSOLUTE}
_SECONDS = {"s": 1.0, "ms": 1e-3}
_EXPECTED = {
    "contraction": "contraction_mm (cm, m, percent), strain or length_mm",
    "pressure": "pressure_bar (kPa, MPa, psi, mbar, Pa; with _abs at the end for an absolute pressure)",
    "force": "force_N (kN, kgf, lbf) or mass_kg, of a hung mass",
    "time": "time_s (ms)",
}


def _column(header: str) -> tuple[str, str] | None:
    """Quantity and unit of a header; None if it says none."""
    words = re.findall(r"[a-z]+|%", header.lower())
    known = [kind for kind, names in _QUANTITIES.items() if any(word in names for word in words)]
    units = [_UNITS[word] for word in words if word in _UNITS]
    # "in" is a word in "pressure in kPa", and a unit where there is no other.
    unit = next((name for name in units if name != "inch"), units[0] if units else "")
    if "strain" in known:
        return "contraction", "percent" if unit == "percent" else "strain"
    if not known:
        return None
    if known[0] == "length":
        return "contraction", f"length in {unit}"
    if known[0] == "mass":
        return "force", unit if unit == "kg" else ""
    if known[0] == "pressure" and unit and any(word in _ABSOLUTE for word in words):
        unit += " absolute"
    return known[0], unit


def _columns(path: str | PathLike[str], wanted: dict[str, tuple[str, ...]]) -> tuple[list[FloatArray], list[str]]:
    """Numbers and units of the wanted quantities."""
    layout = read_layout(path, _IN_ROWS)
    table = replace(layout.table, columns=layout.labels)
    if not table.rows:
        raise FileFormatError("expected at least one line of numbers below the header", table.path)
    said = {label: _column(name) for label, name in zip(layout.labels, layout.table.columns, strict=True)}
    numbers, units = [], []
    for quantity, known in wanted.items():
        named = [header for header, column in said.items() if column and column[0] == quantity]
        if len(named) != 1:
            came = f"{', '.join(named)}" if named else f"none; the header has {', '.join(table.columns)}"
            raise FileFormatError(f"expected one column of {quantity}, {_EXPECTED[quantity]}, got {came}", table.path)
        unit = (said[named[0]] or ("", ""))[1]
        if unit not in known:
            raise FileFormatError(
                f"expected a unit in the header of {quantity}, {_EXPECTED[quantity]}, got {named[0]!r}", table.path
            )
        numbers.append(table.numbers(named)[:, 0])
        units.append(unit)
    return numbers, units


@checked
@dataclass(frozen=True)
class Measurements(Record):
    """Measurements at rest, from a file.

    Attributes
    ----------
    contraction, pressure, force : ndarray
        Shape (n,), m, Pa (gauge), N.
    nominal_length : float
        m.
    diameter : float or None
        Of the muscle at rest, m, if it was given.
    written : tuple of str
        Units of the three columns in the file.
    cautions : tuple of str
        What a muscle is unlikely to do, with the slip that explains it.

    Examples
    --------
    >>> from pathlib import Path
    >>> from exo_pin.muscle import read_measurements
    >>> lines = ["contraction_percent,pressure_psi,force_N", "4.2,17.7,12.7", "10.0,23.6,12.7", "4.1,23.7,22.7"]
    >>> _ = Path("lab.csv").write_text(chr(10).join(lines))
    >>> found = read_measurements("lab.csv", nominal_length=0.3)
    >>> found.written, len(found.force), found.cautions
    (('percent', 'psi', 'N'), 3, ())
    """

    contraction: FloatArray
    pressure: FloatArray
    force: FloatArray
    nominal_length: float
    diameter: float | None
    written: tuple[str, str, str]
    cautions: tuple[str, ...]


def read_measurements(path: str | PathLike[str], nominal_length: float, diameter: float | None = None) -> Measurements:
    """Read measurements at rest, in the units that the headers say, and check that a muscle can have made them.

    Parameters
    ----------
    path : path
        A CSV file with one column each of contraction (or strain, or length), pressure and force (or hung mass).
    nominal_length : float
        Length of the muscle without air and load, m.
    diameter : float or None
        Of the muscle at rest, m, against which the pull is checked.

    Returns
    -------
    Measurements

    Raises
    ------
    FileFormatError
        If a column or its unit is missing, a cell is no number, or no muscle can have made the measurements; it names
        the header that would explain them.

    Examples
    --------
    >>> from pathlib import Path
    >>> from exo_pin.muscle import read_measurements
    >>> lines = "Pressure [kPa],Length (mm),Mass in kg", "200,285,2.0", "300,270,2.0"
    >>> _ = Path("lab.csv").write_text(chr(10).join(lines))
    >>> found = read_measurements("lab.csv", nominal_length=0.3)
    >>> found.pressure.tolist(), (1e3 * found.contraction).round(9).tolist(), found.force.tolist()  # Pa, mm, N
    ([200000.0, 300000.0], [15.0, 30.0], [19.62, 19.62])
    """
    length = as_positive("nominal_length", nominal_length)
    wanted = {"contraction": CONTRACTIONS, "pressure": PRESSURES, "force": tuple(FORCES)}
    (x, p, f), units = _columns(path, wanted)
    written = (units[0], units[1], units[2])
    with naming_file(path):
        contraction, pressure, force, cautions = as_measurements(
            contraction_from(x, units[0], length),
            pressure_from(p, units[1]),
            f * FORCES[units[2]],
            length,
            diameter,
            written,
        )
    return Measurements(frozen(contraction), frozen(pressure), frozen(force), length, diameter, written, cautions)


def read_response(path: str | PathLike[str], mass: float, nominal_length: float) -> Recording:
    """Read the recorded response of a hung mass, in the units that the headers say.

    Parameters
    ----------
    path : path
        A CSV file with one column each of time, contraction (or strain, or length) and pressure.
    mass : float
        Hung mass, kg.
    nominal_length : float
        Length of the muscle without air and load, m.

    Returns
    -------
    Recording

    Raises
    ------
    FileFormatError
        If a column or its unit is missing, a cell is no number, the times do not rise, or a contraction or pressure is
        that of no muscle.

    Examples
    --------
    >>> from pathlib import Path
    >>> from exo_pin.muscle import read_response
    >>> _ = Path("step.csv").write_text(chr(10).join(["time_ms,strain,pressure_kPa", "0,0.10,200", "10,0.11,240"]))
    >>> recording = read_response("step.csv", mass=1.3, nominal_length=0.3)
    >>> recording.time.tolist(), (1e3 * recording.contraction).round(9).tolist()  # s, mm
    ([0.0, 0.01], [30.0, 33.0])
    """
    length = as_positive("nominal_length", nominal_length)
    wanted = {"time": tuple(_SECONDS), "contraction": CONTRACTIONS, "pressure": PRESSURES}
    (t, x, p), units = _columns(path, wanted)
    with naming_file(path):
        contraction, pressure = contraction_from(x, units[1], length), pressure_from(p, units[2])
        return Recording(t * _SECONDS[units[0]], contraction, pressure, mass)
