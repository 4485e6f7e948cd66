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
from ..rows import Row, row


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
