"""Mass and inertia of the moving part, Table 5-4, and the dimensions of Section 5.2.3 and Table 5-3."""

from __future__ import annotations

import numpy as np

from ...design import preset
from ...design.geometry import CircleDimensions
from ..rows import CONTRADICTED, NO_READING, Row, compare

_SOURCE = "Table 5-4"
_PRINTED = np.array(
    [
        [27867611.9, -21184.2, 319504.5],
        [-21184.2, 27638169.9, -2649709.2],
        [319504.5, -2649709.3, 1419768.2],
    ]
)  # g mm²


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis Table 5-3, Table 5-4.
    """
    arm, circles = preset("prototype").arm, preset("prototype").geometry.circles
    assert arm is not None
    assert arm.inertia is not None
    assert circles is not None
    parallel = arm.inertia_about_origin - arm.inertia
    printed = 0.5 * (_PRINTED + _PRINTED.T) * 1e-9
    as_printed = np.linalg.eigvalsh(printed - parallel)
    negated = np.linalg.eigvalsh(printed * (2 * np.eye(3) - 1) - parallel)
    best, other = preset("optimised-table-5-3").geometry.circles, preset("optimised-table-c-2").geometry.circles
    assert best is not None
    assert other is not None
    built, wanted = np.degrees(circles.alpha_A), np.degrees(best.alpha_A)
    slope = np.tan(np.radians(60.0))
    return [
        compare(_SOURCE, "distance of the centroid from O", "mm", 191.07,
                np.linalg.norm(arm.centre_of_mass) * 1e3, 5e-3, digits=2),
        compare(_SOURCE, "principal moments about the centroid, of the tensor as printed", "kg m²", as_printed,
                np.linalg.eigvalsh(arm.inertia), 1e-9, mended=negated, digits=5,
                note="the off-diagonal entries are printed as integrals; taken for a tensor one moment is negative"),
        compare(_SOURCE, "I_yz and I_zy, integrals", "g mm²", [-2649709.2, -2649709.3],
                -arm.inertia_about_origin[[1, 2], [2, 1]] * 1e9, 0.06, digits=1,
                note="the two mirrored entries differ by 0.1 in print; their mean is used"),
        compare("Section 5.2.3", "r_A = h_A tan 60°", "mm", 136.30, circles.h_A * slope * 1e3, 0.05, digits=2,
                otherwise=CONTRADICTED,
                note="the stated relation gives another radius than the table; the table is used" + NO_READING),
        compare("Section 5.2.3", "r_B = h_B / tan 60°", "mm", 118.8, circles.h_B / slope * 1e3, 0.05, digits=2,
                otherwise=CONTRADICTED,
                note="the stated relation gives another radius than the table; the table is used" + NO_READING),
        compare("Section 5.2.3", "α of the optimised geometry in the nearest pair of holes", "°", [40.0, *built[1:]],
                10 * np.round(wanted / 10), 0.05, digits=1, otherwise=CONTRADICTED,
                note="holes are 10° apart, but the mounted α of Table 5-3 lie "
                f"{', '.join(f'{gap:.1f}' for gap in np.diff(built))}° apart; the first one was moved by hand"),
        compare("Table 5-3", "optimised r_A, r_B, h_A, h_B (mm) and α (°)", "", _millimetres_and_degrees(best),
                _millimetres_and_degrees(other), 0.05, digits=1, otherwise=CONTRADICTED,
                note="computed: Table C-2, which is the same optimisation; both are kept as presets"),
    ]  # fmt: skip


def _millimetres_and_degrees(circles: CircleDimensions) -> list[float]:
    sizes = (circles.r_A, circles.r_B, circles.h_A, circles.h_B)
    return [*(1e3 * size for size in sizes), *np.degrees(circles.alpha_A).tolist()]
