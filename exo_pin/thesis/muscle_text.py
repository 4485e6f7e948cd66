"""Ledger of what Section 3.2 and Appendices A and B say in numbers besides their tables of forces.

Appendix A: fits of Table A-1 and the verification of Table A-3. Section 3.2.2 and Appendix B: the dynamic model.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..core.errors.muscles import OutsideValidity
from ..muscle.io.measured import NOMINAL_LENGTH, SteadyStates, steady_states, table
from ..muscle.io.model_files import dynamic_model, muscle_model
from ..muscle.laws.dynamic import G
from ..muscle.laws.static import BAR
from ..muscle.simulation.step_response import settling_against_lag
from .rows import NO_READING, Row, compare, row


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
