"""What the text of Section 3.2 and Appendix A says of its tests and tables, in numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...muscle.io.measured import NOMINAL_LENGTH, table
from ...muscle.io.published import muscle_model
from ...muscle.laws.static import BAR
from ..rows import Row, row


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
