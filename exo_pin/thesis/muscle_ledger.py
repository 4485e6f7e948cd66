"""Chapter 3 and Appendices A and B: every published number of the pneumatic muscle and the computed one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

import numpy as np

from ..core.validation import FloatArray
from ..muscle.identification.region import SECOND_ORDER, design_matrix, find_region
from ..muscle.identification.static_identification import identify_static
from ..muscle.io.measured import NOMINAL_LENGTH, SteadyStates, steady_states, table
from ..muscle.io.model_files import muscle_model
from ..muscle.laws.force_laws import PolynomialModel
from ..muscle.laws.static import BAR
from .muscle_text import appendix_text, dynamic_rows, fit_rows, test_text, verification_rows
from .rows import INPUT_NOT_PRINTED, NOT_REPRODUCIBLE, Row, Verdict, compare, row

#: The model of each table of estimated forces, and how far its forces may be off, N.
_MODELS = {"3-3a": "tang-3-3a", "3-3b": "tang-3-25", "3-3c": "tang-optimised"}
_TOLERANCES = {"3-3a": 0.25, "3-3b": 0.03, "3-3c": 0.03}


def rows() -> list[Row]:
    """Rows of the ledger, in the order of the source.

    Coefficients, cells of Tables 3-3a to 3-3c, their errors, the fits, Appendix A, the dynamic model.
    """
    parts = (
        _signs(),
        test_text(),
        _cells(),
        _errors(),
        _fits(),
        fit_rows(),
        appendix_text(),
        verification_rows(),
        dynamic_rows(),
    )
    return [row for part in parts for row in part]


def _poly(name: str) -> PolynomialModel:
    return cast(PolynomialModel, muscle_model(name))


def _flipped(model: PolynomialModel, powers: tuple[int, int]) -> PolynomialModel:
    terms = dict(model.coefficients)
    terms[powers] = -terms[powers]
    return PolynomialModel(
        coefficients=terms, name="as printed", reference_length=model.reference_length, validity=model.validity
    )


def _grid() -> tuple[FloatArray, FloatArray]:
    """Contraction in m and pressure in Pa of Tables 3-2 and 3-1, NaN where no number is printed."""
    return table("3-2").values / 1e3, table("3-1").values * BAR


def _signs() -> Iterator[Row]:
    """The two coefficients that lost their signs, from the printed forces and the other five coefficients."""
    x, p = _grid()
    for name, symbol, powers, which in (
        ("tang-3-3a", "K_2", (1, 1), "3-3a"),
        ("tang-optimised", "S_2", (1, 0), "3-3c"),
    ):
        model = _poly(name)
        cells = table(which)
        valid = np.isfinite(cells.errors_percent) & np.isfinite(x)
        good, bad = (
            float(np.abs(m.unchecked_force(x, p) - cells.values)[valid].max()) for m in (model, _flipped(model, powers))
        )
        # The force without the term, and the term for a coefficient of one.
        unit = x ** powers[0] * (p / BAR) ** powers[1]
        rest = model.unchecked_force(x, p) - model.in_bar[powers] * unit
        # Of some cells a middle one: a misprinted force does not count.
        value = float(np.median(((cells.values - rest) / unit)[valid]))
        slack = _TOLERANCES[which] / float(np.median(unit[valid]))
        yield row(f"muscle_ledger.{symbol}", value, (which, good, bad), rounding=slack)


def _cells() -> Iterator[Row]:
    """Every cell of the tables of estimated forces.

    Source: thesis Table 3-3a, Table 3-3b, Table 3-3c.
    """
    x, p = _grid()
    for which, name in _MODELS.items():
        cells, tolerance = table(which), _TOLERANCES[which]
        force = muscle_model(name).unchecked_force(x, p)
        copied = muscle_model("tang-3-3a").unchecked_force(x, p)
        valid = np.isfinite(cells.errors_percent)
        for i, j in np.argwhere(cells.present):
            label = f"force at {cells.rows[i]} bar, {cells.columns[j]} N (N)"
            printed, value = float(cells.values[i, j]), float(force[i, j])
            own = float(cells.columns[j]) * (1 + cells.errors_percent[i, j] / 100)
            verdict: Verdict = "misprint, corrected"
            if np.isnan(value):
                verdict, note = INPUT_NOT_PRINTED, "no data in Tables 3-1 and 3-2"
            elif abs(value - printed) <= tolerance:
                verdict, note = "reproduced", f"within {tolerance:g} N"
            elif which == "3-3c" and not valid[i, j] and abs(copied[i, j] - printed) <= 0.25:
                note = f"copied from Table 3-3a, whose coefficients give {copied[i, j]:.2f} N"
            elif valid[i, j] and abs(own - value) <= 0.05:
                note = f"its own error of {cells.errors_percent[i, j]:g} % means {own:.2f} N"
            else:
                verdict, note = NOT_REPRODUCIBLE, f"off by {value - printed:.2f} N"
            yield compare(f"Table {which}", label, "", printed, value, tolerance, verdict=verdict, note=note)


def _errors() -> Iterator[Row]:
    x, p = _grid()
    for which, name in _MODELS.items():
        cells = table(which)
        own = 100 * (cells.values / cells.column_numbers - 1)
        modelled = 100 * (muscle_model(name).unchecked_force(x, p) / cells.column_numbers - 1)
        agreeing = []
        for i, j in np.argwhere(np.isfinite(cells.errors_percent)):
            printed, value = float(cells.errors_percent[i, j]), float(own[i, j])
            # The force is printed to 0.01 N and the error to 0.1 % (17 %: to 1 %).
            slack = 0.5 / float(cells.columns[j]) + (0.5 if printed == 17 else 0.05) + 1e-9
            # Where the model gives the printed error, the force beside it is the misprint.
            if abs(printed - value) <= slack:
                agreeing.append((printed, value, slack))
            elif abs(printed - modelled[i, j]) <= slack:
                agreeing.append((printed, float(modelled[i, j]), slack))
            else:
                label = f"error at {cells.rows[i]} bar, {cells.columns[j]} N (%)"
                note = "its sign; the printed force has the other one"
                yield compare(f"Table {which}", label, "", printed, value, slack, mended=-printed, note=note)
        shown, own_or_model, slacks = np.array(agreeing).T
        besides = "; of the computed force at 1.6 bar, 22.74 N" if which == "3-3c" else ""
        yield row(
            "muscle_ledger.errors", own_or_model, (besides,), source=f"Table {which}", printed=shown, rounding=slacks
        )
    errors = np.abs(table("3-3c").errors_percent)
    mean, most = float(np.nanmean(errors)), float(np.nanmax(errors))
    recomputed = np.abs(100 * (muscle_model("tang-optimised").unchecked_force(x, p) / table("3-3c").column_numbers - 1))
    cells_left = np.isfinite(errors) & np.isfinite(recomputed)
    counts = int(np.isfinite(errors).sum()), int(cells_left.sum()), float(recomputed[cells_left].mean())
    yield row("muscle_ledger.mean_deviation_of", mean, counts)
    yield row("muscle_ledger.largest_deviation", most)


def _squares(model: PolynomialModel, states: SteadyStates) -> float:
    return float(((model.unchecked_force(states.contraction, states.pressure) - states.force) ** 2).sum())


def _slack_of_rounding(states: SteadyStates) -> FloatArray:
    """Largest change of the six coefficients from the rounding of contractions (1 µm) and pressures (1 mbar)."""
    x, p = states.contraction, states.pressure

    def solved(x: FloatArray, p: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.solve(design_matrix(x, p, SECOND_ORDER), states.force))

    steps = [(0.5e-6 * step, 0.0 * step) for step in np.eye(len(x))]
    steps += [(0.0 * step, 0.5e-3 * BAR * step) for step in np.eye(len(x))]
    return np.sum([np.abs(solved(x + dx, p + dp) - solved(x, p)) for dx, dp in steps], axis=0)


def _fits() -> Iterator[Row]:
    valid = steady_states(valid_only=True)
    best = identify_static(valid.contraction, valid.pressure, valid.force, NOMINAL_LENGTH)
    least = float(best.residuals @ best.residuals)
    model = _poly("tang-optimised")
    printed = _squares(model, valid)
    own = [best.model.in_bar[powers] for powers in SECOND_ORDER]
    found = 100 * (1 - least / printed), np.sqrt(printed / 25), np.sqrt(least / 25)
    yield row("muscle_ledger.K_1_to_S_3_m_bar", own, found)
    for which in ("3-3a", "3-3b"):
        name = _MODELS[which]
        title = table(which).title
        pairs = title[title.index("tests ") + 6 :].split(" (bar")[0]
        tests = [tuple(float(v) for v in pair.split(", ")) for pair in pairs.strip("()").split("), (")]
        states = steady_states()
        picked = [
            int(np.argmin(np.abs(states.regulator / BAR - bar) + np.abs(states.force - weight - 2.74)))
            for bar, weight in tests
        ]
        six = states.select(np.isin(np.arange(len(states.force)), picked))
        matrix = design_matrix(six.contraction, six.pressure, SECOND_ORDER)
        solved = np.linalg.solve(matrix, six.force)
        slack = _slack_of_rounding(six)
        gap = float(np.abs(_poly(name).unchecked_force(six.contraction, six.pressure) - six.force).max())
        mended = [_poly(name).in_bar[powers] for powers in SECOND_ORDER]
        found = slack[0], np.linalg.cond(matrix), gap
        yield row(f"muscle_ledger.six_tests_{which}", solved, found, rounding=slack, mended=mended)
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, NOMINAL_LENGTH)
    both = region.selected & states.called_valid
    besides = ", ".join(
        f"({states.regulator[i] / BAR:.1f} bar, {states.force[i]:.2f} N)"
        for i in np.flatnonzero(region.selected & ~states.called_valid)
    )
    yield row("muscle_ledger.region", both.sum(), (besides,), printed=states.called_valid.sum())
