"""Flow of air through valves, against ISO 6358's formula written again, a closed form and an exact series."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from exo_pin.muscle import Valve


def iso_6358(high, low, C, b):
    """The standard's two branches, without the laminar part."""
    r = low / high
    psi = 1.0 if r <= b else np.sqrt(1.0 - ((r - b) / (1.0 - b)) ** 2)
    return C * high * 1.185 * np.sqrt(293.15 / 293.15) * psi


@pytest.mark.parametrize("b", [0.0, 0.2, 0.5, 0.9])
def test_flow_is_the_standard_s_both_ways(b):
    valve, rng = Valve(2e-9, b), np.random.default_rng(3)
    high = rng.uniform(1e5, 8e5, 200)
    low = high * rng.uniform(0.0, 0.999, 200)
    expected = [iso_6358(p, q, 2e-9, b) for p, q in zip(high, low, strict=True)]
    np.testing.assert_allclose(valve.flow(high, low), expected, rtol=1e-12)
    np.testing.assert_allclose(valve.flow(low, high), -np.array(expected), rtol=1e-12)


def test_a_volume_fills_as_in_closed_form():
    """Isothermal: linear in time while choked, then p/p_s = b + (1 - b) sin(...) up to the laminar part."""
    C, b, supply, volume, start = 1e-9, 0.3, 5e5, 20e-6, 1e5
    rate = 1e5 * C * supply / volume  # of the standard's air
    choked = (b * supply - start) / rate
    through = choked + (1.0 - b) * supply / rate * np.arcsin((0.99 - b) / (1.0 - b))
    times = np.linspace(0.0, through, 60)

    def fill(t, p):
        return [1e5 / 1.185 * Valve(C, b).flow(supply, p[0]) / volume]

    found = solve_ivp(fill, (0.0, through), [start], t_eval=times, rtol=1e-11, atol=1e-4, method="DOP853").y[0]
    angle = np.clip((times - choked) * rate / ((1.0 - b) * supply), 0.0, None)
    expected = np.where(times < choked, start + rate * times, supply * (b + (1.0 - b) * np.sin(angle)))
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def exact_series(first, second, high, low):
    """Flow through two valves with the pressure between them solved for."""

    def excess(middle):
        return float(first.flow(high, middle) - second.flow(middle, low))

    return float(first.flow(high, brentq(excess, low, high, xtol=1e-6)))


@pytest.mark.parametrize(
    ("least", "ratios", "error"),
    [(0.2, (1.0, 0.84), 0.08), (0.2, (1 / 3, 3.0), 0.035), (0.0, (1.0, 0.84), 0.125), (0.0, (1 / 3, 3.0), 0.045)],
)
def test_valves_in_series_pass_nearly_what_they_pass_one_behind_the_other(least, ratios, error):
    """The errors that the docstring states are met, and not by far."""
    critical = (least, 0.35, 0.5)
    off = [
        one.in_series(other).flow(5e5, low) / exact_series(one, other, 5e5, low) - 1.0
        for ratio in ratios
        for one in (Valve(1e-9, b) for b in critical)
        for other in (Valve(ratio * 1e-9, b) for b in critical)
        for low in (1e4, 5e4, 1e5, 2.5e5, 4.1e5, 4.9e5)
    ]
    assert 0.85 * error < np.abs(off).max() < error
