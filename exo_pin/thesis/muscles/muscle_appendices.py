"""Ledger of Appendix A: fits of Table A-1 and the verification of Table A-3."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...muscle.io.measured import table
from ...muscle.io.published import muscle_model
from ...muscle.laws.static import BAR
from ..rows import NO_READING, Row, compare, row


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
