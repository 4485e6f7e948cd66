"""Mass and inertia of the moving part, Table 5-4, and the dimensions of Section 5.2.3 and Table 5-3."""

from __future__ import annotations

import numpy as np

from ...design import preset
from ...design.geometry import CircleDimensions
from ..rows import Row, printed_table, row


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis Table 5-3, Table 5-4.
    """
    arm, circles = preset("prototype").arm, preset("prototype").geometry.circles
    assert arm is not None
    assert arm.inertia is not None
    assert circles is not None
    parallel = arm.inertia_about_origin - arm.inertia
    tensor = printed_table("table_5_4")["inertia"]
    printed = 0.5 * (tensor + tensor.T) * 1e-9
    as_printed = np.linalg.eigvalsh(printed - parallel)
    negated = np.linalg.eigvalsh(printed * (2 * np.eye(3) - 1) - parallel)
    best, other = preset("optimised-table-5-3").geometry.circles, preset("optimised-table-c-2").geometry.circles
    assert best is not None
    assert other is not None
    built, wanted = np.degrees(circles.alpha_A), np.degrees(best.alpha_A)
    slope = np.tan(np.radians(60.0))
    return [
        row("dimensions.distance_of_the", np.linalg.norm(arm.centre_of_mass) * 1e3),
        row("dimensions.principal_moments", np.linalg.eigvalsh(arm.inertia), printed=as_printed, mended=negated),
        row("dimensions.I_yz_and_I_zy_integrals", -arm.inertia_about_origin[[1, 2], [2, 1]] * 1e9),
        row("dimensions.r_A_h_A_tan_60", circles.h_A * slope * 1e3),
        row("dimensions.r_B_h_B_tan_60", circles.h_B / slope * 1e3),
        row("dimensions.alpha_of_the_optimised", 10 * np.round(wanted / 10), printed=[40.0, *built[1:]],
            values=(", ".join(f"{gap:.1f}" for gap in np.diff(built)),)),
        row("dimensions.optimised_r_A_r_B", _millimetres_and_degrees(other), printed=_millimetres_and_degrees(best)),
    ]  # fmt: skip


def _millimetres_and_degrees(circles: CircleDimensions) -> list[float]:
    sizes = (circles.r_A, circles.r_B, circles.h_A, circles.h_B)
    return [*(1e3 * size for size in sizes), *np.degrees(circles.alpha_A).tolist()]
