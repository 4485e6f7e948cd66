"""Chapter 3 and Appendices A and B: every published number of the pneumatic muscle and the computed one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

import numpy as np

from ..core.errors.inputs import OutsideValidity
from ..core.validation import FloatArray
from ..muscle.identification.regimes import SECOND_ORDER, design_matrix
from ..muscle.identification.region import find_region
from ..muscle.identification.static_identification import identify_static
from ..muscle.io.measured import NOMINAL_LENGTH, SteadyStates, steady_states, table
from ..muscle.io.model_files import dynamic_model, muscle_model
from ..muscle.laws.dynamic import G
from ..muscle.laws.force_laws import PolynomialModel
from ..muscle.laws.static import BAR
from ..muscle.simulation.step_response import settling_against_lag
from .rows import INPUT_NOT_PRINTED, NO_READING, NOT_REPRODUCIBLE, Row, Verdict, compare, row


def test_text() -> Iterator[Row]:
    """Rows of Sections 3.2 and 3.2.1.

    Source: thesis Table 3-1, Table 3-3a, Table 3-3b.
    """
    tests, loads = table("3-1"), table("3-1").column_numbers
    step = float(np.diff(loads).mean())
    yield row("muscle_text.number_of_tests", tests.present.size, values=(int(tests.present.sum()),))
    yield row("muscle_text.loads_from_to_step", [loads[0], loads[-1], step, loads[0] - step])
    errors = {which: table(which).errors_percent for which in ("3-3a", "3-3b")}
    sizes = np.abs(np.concatenate([found[np.isfinite(found)] for found in errors.values()]))
    yield row("muscle_text.errors_beyond_7", (sizes > 7).sum())
    yield row("muscle_text.largest_of_the_other", sizes[sizes <= 7].max())
    where = int(np.argwhere(errors["3-3a"] == -7.9)[0, 1])
    yield row("muscle_text.load_of_the_error", loads[where])
    yield row("muscle_text.error_of_1_N_at", 100 / loads[0],
              reading=("of the load without its holder", 100 / step))  # fmt: skip
    line = table("3-3a").rows.index("2.8")
    x, p = table("3-2").values[line, 4:] / 1e3, table("3-1").values[line, 4:] * BAR
    stalled = muscle_model("tang-3-3a").unchecked_force(x, p)
    yield row("muscle_text.forces_at_2_8_bar", [stalled.min(), stalled.max()])


def appendix_text() -> Iterator[Row]:
    """Rows of the text of Appendix A, and of (A-5) and (A-6) beside Table A-2.

    Source: thesis (A-5), (A-6), Table A-1, Table A-2.
    """
    a1 = table("a-1")
    x_i, x_j = a1.row("x_i_mm"), a1.row("x_j_mm")
    shown = [float(lengths[np.abs(lengths - x).argmin()]) for x, lengths in ((82.7, x_j), (50.4, x_i))]
    yield row("muscle_text.contractions_of", shown)
    contracted = x_i[1:8] / (1e3 * NOMINAL_LENGTH)
    yield row("muscle_text.contraction_of_the", [100 * contracted.min(), 100 * contracted.max()],
              values=(100 * x_j.max() / (1000.0 * NOMINAL_LENGTH),))  # fmt: skip
    yield row("muscle_text.largest_elongation", -x_j.min(), values=(x_i[0],))
    relaxation, excitation = table("a-2").row("relaxation"), table("a-2").row("excitation")
    yield row("muscle_text.K_1_to_S_3_beside", relaxation)
    refit = np.polyfit(x_j[[3, 4, 5, 7]] / 1e3, a1.row("L_j_N_per_bar")[[3, 4, 5, 7]], 2)[0]
    yield row("muscle_text.K_1_to_S_3_beside_Table", excitation, values=(refit,))


def fit_rows() -> Iterator[Row]:
    """Rows of Table A-2 from Table A-1.

    Source: thesis (A-4), Table A-1, Table A-2.
    """
    a1, a2 = table("a-1"), table("a-2")
    first, (x_9, x_10) = a1.row("x_i_mm")[0], a1.row("x_i_mm")[8:]
    J_1, (J_9, J_10) = a1.row("J_i_N")[0], a1.row("J_i_N")[8:]
    along = x_9 + (J_1 - J_9) * (x_10 - x_9) / (J_10 - J_9)
    yield row("muscle_appendices.x_1_of_the_relaxation", along, printed=first, mended=-first)
    keys = [column.split("_N")[0] for column in a2.columns]
    for process, kind, points in (("relaxation", "i", slice(1, 8)), ("excitation", "j", [3, 4, 5, 7])):
        x = a1.row(f"x_{kind}_mm")[points] / 1e3
        slope, offset = a1.row(f"L_{kind}_N_per_bar")[points], a1.row(f"J_{kind}_N")[points]
        matrix = np.column_stack([x**2, x, np.ones(len(x))])
        inverse = np.linalg.pinv(matrix)
        for i, key in enumerate(keys):
            data = slope if i < 3 else offset
            value = float(inverse[i % 3] @ data)
            printed = float(a2.row(process)[i])
            # Largest change that rounding of the printed slopes or intercepts can make.
            digits = 0.05 if kind == "i" else 0.005
            slack = float(np.abs(inverse[i % 3]).sum()) * digits
            fitted = "contractions only" if kind == "i" else "without 71.10 mm, as data were discarded"
            note = f"refit of Table A-1, {fitted}; rounding in print changes it by up to {slack:.3g}"
            note += "" if abs(value - printed) <= slack else NO_READING
            yield compare("Table A-2", f"{key} of the {process} (m, bar)", "", printed, value, slack, note=note)


def verification_rows() -> Iterator[Row]:
    """Rows of Table A-3 and of the text below it.

    Source: thesis (A-5), (A-6), Table A-3.
    """
    a3 = table("a-3")
    x, p = a3.row("contraction_mm") / 1e3, a3.row("pressure_bar") * BAR
    printed = a3.row("calculated_force_N")
    relaxation = muscle_model("tang-relaxation").unchecked_force(x, p)
    excitation = muscle_model("tang-excitation").unchecked_force(x, p)
    off = np.abs(excitation - printed).max()
    note = f"relaxation form (A-5), within 0.5 N; the excitation form (A-6) is up to {off:.0f} N off"
    for k in range(len(x)):
        label = f"force at {x[k] * 1e3:.2f} mm, {p[k] / BAR:.3f} bar (N)"
        yield compare("Table A-3", label, "", printed[k], relaxation[k], 0.5, note=note)
    weight = float(a3.row("actual_weight_N")[0])
    mean = 100 * (float(printed.mean()) / weight - 1)
    spread = float(printed.std(ddof=1))
    yield row("muscle_appendices.error_of_the_mean", mean)
    yield row("muscle_appendices.standard_deviation", spread)


def _viscosity(kelvin: float) -> float:
    """Viscosity of air, kg/(m s), at a temperature in K.

    Source: thesis (3-18).
    """
    return 1.456e-6 * kelvin**1.5 / (kelvin + 110.4)


def dynamic_rows() -> Iterator[Row]:
    """Rows of (3-18), (3-29) to (3-31), Tables 3-4 and B-1, Figure 3-2.

    Source: thesis (3-29), (3-30), (3-31), Table 3-4, Table B-1, Figure 3-2.
    """
    at_273, at_300 = _viscosity(273.0), _viscosity(300.0)
    yield row("muscle_dynamics.viscosity_of_air", 1e6 * at_273, reading=("T = 300 K", 1e6 * at_300))
    t34, tb1 = table("3-4").groups, table("b-1").groups
    both = np.isfinite(t34[..., 0]) & np.isfinite(tb1[..., 0])
    same = int((np.abs(t34 - tb1)[both] <= 0.0051).all(axis=-1).sum())
    yield row("muscle_dynamics.equal_coefficients", same, printed=both.sum())
    cell = t34[table("3-4").rows.index("3.6"), table("3-4").columns.index("22.74")]
    yield row("muscle_dynamics.D_1_N_s_m_bar", cell[3])
    states = steady_states(valid_only=True)
    yield row("muscle_dynamics.N_2_N_1_N_0", cell[:3])
    yield row("muscle_dynamics.D_2_N_s_m_bar", cell[4])
    yield _resting(states)
    yield _settling()


def _resting(states: SteadyStates) -> Row:
    model = dynamic_model("tang-3-31")
    tried = held = 0
    for x, p, f in zip(states.contraction, states.pressure, states.force, strict=True):
        try:
            low, high = model.rest_band(float(f) / G, float(p))
        except OutsideValidity:
            continue
        tried += 1
        held += int(low <= x <= high)
    every = len(states.force)
    return row("muscle_dynamics.rests", held, printed=tried, values=(every - tried, every))


def _settling() -> Row:
    """The pressure inside the muscle was recorded and is not printed: settling follows its lag."""
    lags = (1.0, 2.0)
    times = settling_against_lag(dynamic_model("tang-3-31"), 22.74 / G, 4.0 * BAR, lags)
    shown = ", ".join(f"{time:.1f} s with a lag of {lag:g} s" for lag, time in zip(lags, times, strict=True))
    return row("muscle_dynamics.settling_time", np.nan, values=(shown,))


#: The model of each table of estimated forces, and how far its forces may be off, N.
_MODELS = {"3-3a": "tang-3-3a", "3-3b": "tang-3-25", "3-3c": "tang-optimised"}
_TOLERANCES = {"3-3a": 0.25, "3-3b": 0.03, "3-3c": 0.03}


def rows() -> list[Row]:
    """Rows of the ledger, in the order of the source.

    Coefficients, cells of Tables 3-3a to 3-3c, their errors, the fits, Appendix A, the dynamic model.
    """
    of_chapter_3 = [*_signs(), *test_text(), *_cells(), *_errors(), *_fits()]
    return [*of_chapter_3, *fit_rows(), *appendix_text(), *verification_rows(), *dynamic_rows()]


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
            # The force is printed to 0.01 N and the error to 0.1 %.
            slack = 0.5 / float(cells.columns[j]) + 0.05
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
