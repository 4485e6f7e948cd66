"""What the text of Section 3.2 and Appendix A says of its tests and tables, in numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...muscle.io.measured import NOMINAL_LENGTH, table
from ...muscle.io.published import muscle_model
from ...muscle.laws.static import BAR
from ..rows import CONTRADICTED, Row, compare

_SOURCE = "Section 3.2.1"


def test_text() -> Iterator[Row]:
    """Rows of Sections 3.2 and 3.2.1.

    Source: thesis Table 3-1, Table 3-3a, Table 3-3b.
    """
    tests, loads = table("3-1"), table("3-1").column_numbers
    step = float(np.diff(loads).mean())
    yield compare("Section 3.2", "number of tests", "", 70.0, tests.present.size, 0.0, digits=0,
                  note=f"settings by loads; {int(tests.present.sum())} of them have data in Table 3-1")  # fmt: skip
    yield compare("Section 3.2", "loads from, to, step, and the holder alone", "N", [12.74, 72.74, 10.0, 2.74],
                  [loads[0], loads[-1], step, loads[0] - step], 1e-9, digits=2)  # fmt: skip
    errors = {which: table(which).errors_percent for which in ("3-3a", "3-3b")}
    sizes = np.abs(np.concatenate([found[np.isfinite(found)] for found in errors.values()]))
    yield compare(_SOURCE, "errors beyond 7 % in Tables 3-3a and 3-3b", "", 4.0, (sizes > 7).sum(), 0.0, digits=0)
    yield compare(_SOURCE, "largest of the other errors", "%", 7.0, sizes[sizes <= 7].max(), 0.0, digits=1,
                  relation="at most")  # fmt: skip
    where = int(np.argwhere(errors["3-3a"] == -7.9)[0, 1])
    yield compare(_SOURCE, "load of the error of -7.9 % at 1.2 bar", "N", 22.74, loads[where], 0.0, mended=12.74,
                  digits=2, note="Table 3-3a has it at 12.74 N")  # fmt: skip
    yield compare(_SOURCE, "error of 1 N at 12.74 N, printed as close to 10 %", "%", 10.0, 100 / loads[0], 0.5,
                  digits=2, reading=("of the load without its holder", 100 / step),
                  note="the holder of 2.74 N is part of the load")  # fmt: skip
    row = table("3-3a").rows.index("2.8")
    x, p = table("3-2").values[row, 4:] / 1e3, table("3-1").values[row, 4:] * BAR
    stalled = muscle_model("tang-3-3a").unchecked_force(x, p)
    yield compare(_SOURCE, "forces at 2.8 bar, 52.74 N and more, least and greatest", "N", [49.0, 52.0],
                  [stalled.min(), stalled.max()], 0.5, digits=2, note="printed as around so much")  # fmt: skip


def appendix_text() -> Iterator[Row]:
    """Rows of the text of Appendix A, and of (A-5) and (A-6) beside Table A-2.

    Source: thesis (A-5), (A-6), Table A-1, Table A-2.
    """
    a1 = table("a-1")
    x_i, x_j = a1.row("x_i_mm"), a1.row("x_j_mm")
    shown = [float(lengths[np.abs(lengths - x).argmin()]) for x, lengths in ((82.7, x_j), (50.4, x_i))]
    yield compare("Section A.1", "contractions of the samples in Figure A-2: excitation, relaxation", "mm",
                  [82.7, 50.4], shown, 0.05, digits=2, otherwise=CONTRADICTED,
                  note="computed: the nearest contraction of Table A-1, which is said to list all")  # fmt: skip
    contracted = x_i[1:8] / (1e3 * NOMINAL_LENGTH)
    yield compare("Section A.2", "contraction of the 10 lengths, from and to", "%", [0.0, 30.0],
                  [100 * contracted.min(), 100 * contracted.max()], 0.5, digits=1, otherwise=CONTRADICTED,
                  note=f"computed: the contracted lengths of the relaxation in Table A-1; the excitation reaches "
                  f"{100 * x_j.max() / (1e3 * NOMINAL_LENGTH):.1f} %")  # fmt: skip
    yield compare("Section A.2", "largest elongation, printed as up to around 10 mm", "mm", 10.0, -x_j.min(), 5.0,
                  digits=2, otherwise=CONTRADICTED,
                  note=f"computed: of the excitation in Table A-1; of the relaxation {x_i[0]:.2f} mm")  # fmt: skip
    relaxation, excitation = table("a-2").row("relaxation"), table("a-2").row("excitation")
    yield compare("(A-5)", "K_1 to S_3 beside Table A-2 (m, bar)", "",
                  [-846.37, -158.68, 20.4, 5511.0, -471.5, -1.635], relaxation, 0.0, digits=3)  # fmt: skip
    refit = np.polyfit(x_j[[3, 4, 5, 7]] / 1e3, a1.row("L_j_N_per_bar")[[3, 4, 5, 7]], 2)[0]
    yield compare("(A-6)", "K_1 to S_3 beside Table A-2 (m, bar)", "",
                  [51.926, -131.122, 20.81, 1162.1, -137.9, -3.2], excitation, [5e-4, 5e-4, 0.05, 0.5, 0.05, 0.05],
                  mended=[51.962, -131.122, 20.81, 1162.1, -137.9, -3.2], digits=3,
                  note="two digits of K_1 stand in another order in one of the two, 51.926 and 51.962; which is right "
                  f"is open, a refit of Table A-1 gives {refit:.1f}; C_1 and S_1 have a digit more here")  # fmt: skip
