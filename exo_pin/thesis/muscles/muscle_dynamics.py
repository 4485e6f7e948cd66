"""Ledger of the dynamic model, Section 3.2.2 and Appendix B."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.errors.muscles import OutsideValidity
from ...muscle.io.dynamic_files import dynamic_model
from ...muscle.io.measured import SteadyStates, steady_states, table
from ...muscle.laws.dynamic import G
from ...muscle.laws.static import BAR
from ...muscle.simulation.step_response import settling_against_lag
from ..rows import INPUT_NOT_PRINTED, Row, Verdict, compare, row


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
    note = "computed: at the 273 K of the text"
    yield row("muscle_dynamics.viscosity_of_air", 1e6 * at_273, reading=("T = 300 K", 1e6 * at_300), note=note)  # fmt: skip
    t34, tb1 = table("3-4").groups, table("b-1").groups
    both = np.isfinite(t34[..., 0]) & np.isfinite(tb1[..., 0])
    # Table 3-4 is printed to two decimals.
    same = int((np.abs(t34 - tb1)[both] <= 0.0051).all(axis=-1).sum())
    quantity = "tests in both whose coefficients agree, of those in both"
    verdict: Verdict = "reproduced" if same == both.sum() else INPUT_NOT_PRINTED
    note = "the responses that were fitted are not printed; Table B-1 repeats one set for all tests"
    yield compare("Tables 3-4 and B-1", quantity, "", both.sum(), same, 0.0, verdict=verdict, note=note)
    cell = t34[table("3-4").rows.index("3.6"), table("3-4").columns.index("22.74")]
    note = "computed: the cell of Table 3-4 for the same test; (3-30) prints a plain -1"
    yield row("muscle_dynamics.D_1_N_s_m_bar", cell[3], note=note)
    states = steady_states(valid_only=True)
    note = "computed: the cell of Table 3-4 for the same test"
    own = ("(3-29)", "N_2, N_1, N_0 (m, bar)"), ("(3-30)", "D_2 (N s/(m bar))")
    yield compare(*own[0], "", [228.9342, -90.429, 6.87], cell[:3], 0.005, note=note)
    yield compare(*own[1], "", 0.802, cell[4], 0.005, note=note)
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
    quantity = "measured rests inside the friction band, of those with a friction"
    note = (
        f"(3-25) and (3-29) hold the mass at the measured contraction; in the other {len(states.force) - tried} of "
        f"{len(states.force)} valid cells P - m is negative, and the Coulomb term of (3-16) is no friction"
    )
    return compare("(3-31), Table 3-2", quantity, "", tried, held, 0.0, note=note)


def _settling() -> Row:
    """The pressure inside the muscle was recorded and is not printed: settling follows its lag."""
    curve = settling_against_lag(dynamic_model("tang-3-31"), 22.74 / G, 4.0 * BAR, (1.0, 2.0))
    shown = ", ".join(f"{t:.1f} s with a lag of {lag:g} s" for lag, t in zip(curve.lags, curve.quoted, strict=True))
    quantity, verdict = "settling time at 4 bar, 22.74 N (s)", INPUT_NOT_PRINTED
    note = (
        f"measured, with a pressure that is not printed; for a first-order lag of the pressure (3-31) settles (2 %) in "
        f"{shown}, without the oscillation that the text mentions"
    )
    return compare("Figure 3-2", quantity, "", 6.0, np.nan, 0.0, verdict=verdict, note=note)
