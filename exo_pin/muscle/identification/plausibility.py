"""Whether a pneumatic muscle can have made these measurements, and which slip explains them if not.

What no muscle does is an error: a contraction beyond 40 % of the length (Section 2 and the makers: 37 to 40 % at
most), a gauge pressure above 10 bar, a pull that falls as the pressure rises. What is unlikely is a caution. Four
numbers are judged, of a plane F = P (c_0 + c_1 x) + s_0 through the measurements that obey one law: the highest
pressure; the strain where the pull ends; the pull a pascal over the cross-section, which by F = P A (3/tan² α - 1/sin²
α) is 3 to 14 for braids of 20 to 35° (without a diameter it bounds the slenderness instead); and the least pressure
that pulls, which the tube takes. For each slip (another unit, absolute pressure, length for contraction, a sign,
swapped columns) the measurements are read again; slips that leave no doubt are named, the likeliest first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import permutations
from math import inf, log, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, as_positive
from ..laws.dynamic import G
from ..laws.static import BAR
from .regimes import SECOND_ORDER, regimes

#: Pressure of the air around, Pa: absolute less gauge.
ATMOSPHERE = 101325.0
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254}
_PRESSURES = {"Pa": 1.0, "mbar": 100.0, "kPa": 1e3, "psi": 6894.757293168, "bar": BAR, "MPa": 1e6}
#: A mass hung on the muscle, kg, pulls as its weight does.
FORCES = {"N": 1.0, "kN": 1e3, "kgf": 9.80665, "kg": G, "gf": 9.80665e-3, "lbf": 4.4482216152605}
#: Units of a contraction: of length, or of the nominal length; "length in mm" and so on are of the muscle itself.
CONTRACTIONS = (*_LENGTHS, "percent", "strain", *(f"length in {unit}" for unit in _LENGTHS))
#: Units of a pressure above the air's, or of an absolute one.
PRESSURES = (*_PRESSURES, *(f"{unit} absolute" for unit in _PRESSURES))

_LEAST_STRAIN, _MOST_STRAIN = -0.05, 0.40
_MOST_PRESSURE = 10.0 * BAR
#: Pull over pressure times cross-section at rest of braids, least and greatest.
AREA_SHARES = (2.5, 16.0)
#: A force sensor's zero may be off by this share of the greatest pull.
_SLACK = 0.05
#: A plane that leaves more over (rms), as a share of the greatest pull, goes through two regimes.
_PLANE = 0.04
#: A range that at most this share of the measurements leaves is left by slips in single rows.
_FEW = 0.1


def contraction_from(values: FloatArray, unit: str, nominal_length: float) -> FloatArray:
    """Contraction in m of numbers in one of ``CONTRACTIONS``, shape (n,), of a muscle of a nominal length in m."""
    if unit in ("percent", "strain"):
        return values * nominal_length * (0.01 if unit == "percent" else 1.0)
    if unit.startswith("length in "):
        return nominal_length - values * _LENGTHS[unit.removeprefix("length in ")]
    return values * _LENGTHS[unit]


def pressure_from(values: FloatArray, unit: str) -> FloatArray:
    """Gauge pressure in Pa of numbers in one of ``PRESSURES``, shape (n,)."""
    name, _, absolute = unit.partition(" ")
    return values * _PRESSURES[name] - (ATMOSPHERE if absolute else 0.0)


def header_of(column: str, unit: str) -> str:
    """Header that says the unit of a column, for example ``pressure_kPa``."""
    if unit == "strain":
        return "strain"
    if unit.startswith("length in "):
        return f"length_{unit.removeprefix('length in ')}"
    return f"{column}_{unit.replace(' absolute', '_abs')}"


@dataclass(frozen=True)
class _Reading:
    """The three columns of numbers, how they are read, and what was changed to read them so."""

    columns: tuple[FloatArray, FloatArray, FloatArray]
    units: tuple[str, str, str]
    length: float
    diameter: float | None
    slip: str = ""
    rare: bool = False

    def si(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        x, p, f = self.columns
        pressure = pressure_from(p, self.units[1])
        return contraction_from(x, self.units[0], self.length), pressure, f * FORCES[self.units[2]]

    def others(self) -> Iterator[_Reading]:
        """The same numbers after one slip less."""
        names = ("contraction", "pressure", "force")
        for place, known in enumerate((CONTRACTIONS, PRESSURES, tuple(FORCES))):
            for unit in known:
                if unit in (self.units[place], "kg"):  # a mass is read like kgf
                    continue
                units = tuple(unit if i == place else own for i, own in enumerate(self.units))
                slip = f"the {names[place]} looks like {unit}: write its header {header_of(names[place], unit)}"
                rare = unit in ("inch", "cm", "gf", "kN", "lbf", "mbar") or unit.endswith(" absolute")
                yield replace(self, units=units, slip=slip, rare=rare)  # type: ignore[arg-type]
        for place, (name, way) in enumerate(zip(names, ("shorter", "above the air", "a pull"), strict=True)):
            columns = tuple(-own if i == place else own for i, own in enumerate(self.columns))
            slip = f"the {name} has the other sign: {way} is positive"
            yield replace(self, columns=columns, slip=slip)  # type: ignore[arg-type]
        for order in list(permutations(range(3)))[1:]:
            said = " and ".join(names[i] for i in range(3) if order[i] != i)
            columns = tuple(self.columns[i] for i in order)
            yield replace(self, columns=columns, slip=f"the columns {said} look swapped")  # type: ignore[arg-type]
        for factor in (0.001, 0.01, 0.1, 10.0, 100.0, 1000.0):
            length = factor * self.length
            yield replace(self, length=length, slip=f"the nominal length looks like {1e3 * length:g} mm")


@dataclass(frozen=True)
class _Mark:
    """A number that is judged: where it lies usually, how far it spreads there, and between which bounds it may lie."""

    text: str
    unit: str
    centre: float
    spread: float
    low: float
    high: float
    shown: Callable[[float], float] = float


_MARKS = {
    "supply": _Mark("a highest pressure", "bar", log(4.0), 0.5, log(1.0), log(10.0), np.exp),
    "end": _Mark("a pull that ends at a strain", "%", log(0.28), 0.25, log(0.15), log(0.6), lambda v: 100 * np.exp(v)),
    "slender": _Mark("a length over diameter", "", log(25.0), 0.6, log(4.0), log(100.0), np.exp),
    "area": _Mark(
        "a pull over pressure times cross-section", "", log(6.0), 0.5, log(AREA_SHARES[0]), log(AREA_SHARES[1]), np.exp
    ),
    "tube": _Mark("a least pressure that pulls", "bar", 0.4, 0.4, -0.6, 1.0),
}


def _numbers(
    x: FloatArray, p: FloatArray, f: FloatArray, length: float, diameter: float | None
) -> tuple[dict[str, float], float]:
    """The numbers of ``_MARKS``, and what the plane leaves over as a share of the greatest pull.

    The highest pressure alone if the measurements do not determine a plane.
    """
    bar = p / BAR
    top = float(bar.max())
    found = {"supply": log(max(top, 1e-9))}
    matrix = np.column_stack([bar, bar * x / length, np.ones(len(f))])
    matrix = matrix / (norms := np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny))
    if len(f) < 5 or np.linalg.matrix_rank(matrix, tol=1e-3) < 3:
        return found, 0.0
    plane = np.linalg.lstsq(matrix, f, rcond=None)[0]
    misfit = float(np.sqrt(np.mean((matrix @ plane - f) ** 2)) / np.abs(f).max())
    gain, bend, tube = (plane / norms).tolist()
    found["gain"] = gain
    if gain <= 0.0:
        return found, misfit
    area = gain / BAR
    found["tube"] = _least_pressure(bar, x / length, f)
    found["end"] = log(-(gain + tube / top) / bend) if bend < 0.0 < gain + tube / top else log(10.0)
    if diameter is None:
        found["slender"] = log(length / sqrt(4.0 * area / (pi * np.exp(_MARKS["area"].centre))))
    else:
        found["area"] = log(area / (pi / 4.0 * diameter**2))
    return found, misfit


def _least_pressure(bar: FloatArray, strain: FloatArray, f: FloatArray) -> float:
    """Pressure in bar at which the pull begins at no contraction, of F = P (c_0 + c_1 ε + c_2 ε²) + s_0 + s_1 ε."""
    matrix = np.column_stack([bar, bar * strain, bar * strain**2, strain, np.ones(len(f))])
    gain, _, _, _, start = np.linalg.lstsq(matrix, f, rcond=None)[0].tolist()
    return float(-start / gain) if gain > 0.0 else 0.0


def _impossible(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> tuple[str, np.ndarray] | None:
    """What no muscle does, and at which measurements."""
    strain = x / length
    ranges = (
        ("a contraction", strain * 100, _LEAST_STRAIN * 100, _MOST_STRAIN * 100, f" % of {1e3 * length:g} mm"),
        ("a gauge pressure", p / BAR, 0.0, _MOST_PRESSURE / BAR, " bar"),
        ("a pull", f, -_SLACK * float(np.abs(f).max(initial=0.0)), inf, " N"),
    )
    for what, values, low, high, unit in ranges:
        beyond = (values < low - 1e-9) | (values > high + 1e-9)
        if beyond.any():
            span = f"{low:g} to {high:g}{unit}" if high < inf else "zero or more"
            return f"expected {what} of {span}, got {values.min():.4g} to {values.max():.4g}{unit}", beyond
    return None


def require_possible(contraction: FloatArray, pressure: FloatArray, nominal_length: float) -> None:
    """Raise InvalidInput for a recorded contraction (m) or gauge pressure (Pa) that no muscle of a length (m) has."""
    found = _impossible(contraction, pressure, np.zeros(len(contraction)), nominal_length)
    if found is not None:
        raise InvalidInput(f"{found[0]}: write the unit in the header")


def _doubts(reading: _Reading) -> tuple[list[str], float, str]:
    """Sentences on what is unlikely, the sum of squared deviations, and the error, empty if a muscle can do it."""
    x, p, f = reading.si()
    impossible = _impossible(x, p, f, reading.length)
    if impossible is not None:
        return [], inf, impossible[0]
    few = np.linspace(0, len(x) - 1, min(len(x), 400)).astype(int)
    x, p, f = x[few], p[few], f[few]
    found, misfit = _numbers(x, p, f, reading.length, reading.diameter)
    if misfit > _PLANE and len(x) > len(SECOND_ORDER) + 3:
        _, order, size, _ = regimes(x, p, f, SECOND_ORDER, 0.01)
        x, p, f = x[order[:size]], p[order[:size]], f[order[:size]]
        found, misfit = _numbers(x, p, f, reading.length, reading.diameter)
    if found.pop("gain", 1.0) <= 0.0:
        return [], inf, "expected a pull that rises with the pressure at one contraction, got one that falls"
    texts, total, scatter = [], 10.0 * misfit / _PLANE, None
    for name, value in found.items():
        mark = _MARKS[name]
        total += ((value - mark.centre) / mark.spread) ** 2
        if mark.low <= value <= mark.high:
            continue
        scatter = scatter or _scatter(x, p, f, reading)
        if value > mark.high + 2.0 * scatter[name] or value < mark.low - 2.0 * scatter[name]:
            low, high, own = (float(mark.shown(v)) for v in (mark.low, mark.high, value))
            texts.append(f"{mark.text} of {own:.2g} {mark.unit}".rstrip() + f" (usual {low:.2g} to {high:.2g})")
    return texts, total, ""


def _scatter(x: FloatArray, p: FloatArray, f: FloatArray, reading: _Reading) -> dict[str, float]:
    """Standard deviations of the numbers, by a jackknife of ten parts."""
    parts = [np.arange(len(x)) % 10 != i for i in range(10)]
    again = [_numbers(x[part], p[part], f[part], reading.length, reading.diameter)[0] for part in parts]
    columns = {name: np.array([numbers[name] for numbers in again if name in numbers]) for name in _MARKS}
    return {name: sqrt(0.9 * float(((v - v.mean()) ** 2).sum())) if len(v) else inf for name, v in columns.items()}


def _slips(reading: _Reading) -> list[str]:
    """What explains the measurements, the likeliest first, two at most."""
    ranked = []
    for other in reading.others():
        texts, total, error = _doubts(other)
        if not texts and not error:
            ranked.append((total + 0.5 * other.rare, other.slip))
    return [slip for _, slip in sorted(ranked)[:2]]


def as_measurements(
    contraction: ArrayLike,
    pressure: ArrayLike,
    force: ArrayLike,
    nominal_length: float,
    diameter: float | None = None,
    written: tuple[str, str, str] = ("m", "Pa", "N"),
) -> tuple[FloatArray, FloatArray, FloatArray, tuple[str, ...]]:
    """Check three columns of measurements, shape (n,) each, in m, Pa and N, of a muscle of a nominal length in m.

    Parameters
    ----------
    contraction, pressure, force : array_like
        Shape (n,), m, Pa (gauge), N.
    nominal_length : float
        m.
    diameter : float or None
        Of the muscle at rest, m; without it the pull bounds only the slenderness.
    written : tuple of str
        Units of the columns where they came from, of ``CONTRACTIONS``, ``PRESSURES`` and ``FORCES``: slips are looked
        for in these.

    Returns
    -------
    contraction, pressure, force : ndarray
        Shape (n,).
    cautions : tuple of str
        What is unlikely, with the slip that explains it.

    Raises
    ------
    InvalidInput
        If one is not finite or not of shape (n,), their lengths differ, or no muscle can have made them; it names the
        slip that explains them, or the measurements that are alone out of range.
    """
    x = as_finite("contraction", contraction, (None,))
    p = as_finite("pressure", pressure, (None,))
    f = as_finite("force", force, (None,))
    if not len(x) == len(p) == len(f):
        raise InvalidInput(
            f"expected contraction, pressure and force of one length, got {len(x)}, {len(p)} and {len(f)}"
        )
    length = as_positive("nominal_length", nominal_length)
    width = None if diameter is None else as_positive("diameter", diameter)
    reading = _Reading((x, p, f), ("m", "Pa", "N"), length, width)
    found = _impossible(x, p, f, length)
    if found is not None and found[1].sum() <= _FEW * len(x):
        rows = ", ".join(str(row + 1) for row in np.flatnonzero(found[1]))
        raise InvalidInput(f"{found[0]}; measurement {rows} alone is out of this range: look for a slip in its row")
    texts, _, error = _doubts(reading)
    if not texts and not error:
        return x, p, f, ()
    # Arrays are in SI, mostly from numbers in mm and bar.
    slips: list[str] = []
    for units in (written, ("mm", "bar", "N")):
        slips = slips or _slips(replace(reading, columns=_as_written(x, p, f, length, units), units=units))
    alone = "no single slip of a unit, a sign or a column explains it: look whether the columns belong row by row"
    said = "; or ".join(slips) or alone
    if error:
        raise InvalidInput(f"{error}; {said}")
    settle = " or give the diameter, if the muscle is so" if "length over diameter" in " ".join(texts) else ""
    return x, p, f, (f"The measurements say {' and '.join(texts)}: {said}{settle}.",)


def _as_written(
    x: FloatArray, p: FloatArray, f: FloatArray, length: float, written: tuple[str, str, str]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The numbers in the units where they came from: each reading is a line through two points."""
    ends = np.array([0.0, 1.0])
    start, one = contraction_from(ends, written[0], length)
    low, high = pressure_from(ends, written[1])
    return (x - start) / (one - start), (p - low) / (high - low), f / FORCES[written[2]]
