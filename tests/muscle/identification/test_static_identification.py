"""Static identification: fit, covariance, leave-one-out, confidence intervals and the region."""

import numpy as np
import pytest
from scipy.optimize import curve_fit

from exo_pin import InvalidInput
from exo_pin.muscle import NotIdentifiable, find_region, identify_static, muscle_model, steady_states

#: Powers of contraction and pressure, in the order of the coefficients.
SECOND_ORDER = ((2, 1), (1, 1), (0, 1), (2, 0), (1, 0), (0, 0))


def valid():
    states = steady_states(valid_only=True)
    return states.contraction, states.pressure, states.force


def law(columns, *c):
    x, p = columns
    return (c[0] * x**2 + c[1] * x + c[2]) * p / 1e5 + c[3] * x**2 + c[4] * x + c[5]


def test_fit_and_covariance_are_those_of_scipy():
    x, p, f = valid()
    found = identify_static(x, p, f, 0.3)
    values, covariance = curve_fit(law, (x, p), f, p0=found.coefficients * 1.1)
    # curve_fit differentiates numerically, which on this ill-conditioned problem leaves about four digits.
    np.testing.assert_allclose(found.coefficients, values, rtol=1e-4)
    np.testing.assert_allclose(found.covariance, covariance, rtol=2e-3)
    np.testing.assert_allclose(found.model.unchecked_force(x, p), f - found.residuals, rtol=1e-12)
    assert found.degrees_of_freedom == 19


def test_leave_one_out_errors_are_those_of_refits():
    x, p, f = valid()
    found = identify_static(x, p, f, 0.3)
    for i in (0, 7, 24):
        rest = np.arange(25) != i
        again = identify_static(x[rest], p[rest], f[rest], 0.3).model
        np.testing.assert_allclose(found.leave_one_out[i], f[i] - again.unchecked_force(x[i], p[i]), rtol=1e-7)
    assert abs(found.leave_one_out_rms - 0.60696) < 1e-5


def test_coverage_of_the_confidence_intervals():
    """Of 300 noisy data sets the 95 % intervals hold the truth in 95 %, give or take three standard deviations."""
    truth = muscle_model("tang-optimised")
    x, p, _ = valid()
    exact = truth.unchecked_force(x, p)
    target = np.array([truth.in_bar[pair] for pair in SECOND_ORDER])
    rng = np.random.default_rng(2024)
    runs = 300
    inside = np.zeros(6)
    for _ in range(runs):
        found = identify_static(x, p, exact + rng.normal(0, 0.4, len(x)), 0.3)
        low, high = found.intervals(0.95).T
        inside += (low <= target) & (target <= high)
    slack = 3 * np.sqrt(0.95 * 0.05 / runs)
    assert np.abs(inside / runs - 0.95).max() < slack


def test_region_is_the_thick_line_but_for_two_cells():
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, 0.3)
    differ = region.selected != states.called_valid
    cells = {
        (round(r / 1e5, 1), w, bool(k))
        for r, w, k in zip(states.regulator[differ], states.force[differ], region.selected[differ], strict=True)
    }
    assert cells == {(3.6, 62.74, True), (4.0, 72.74, True)}
    # The law does hold there: fitted without them it misses their weights by 3 %.
    fit = identify_static(*valid(), 0.3).model
    extra = states.select(differ)
    assert np.abs(fit.unchecked_force(extra.contraction, extra.pressure) / extra.force - 1).max() < 0.035
    # The next cell that the tables reject in order of contraction it misses by far more.
    rejected = states.select(~region.selected)
    errors = fit.unchecked_force(rejected.contraction, rejected.pressure) / rejected.force - 1
    assert np.abs(errors).min() > 0.04
    assert np.median(np.abs(errors)) > 0.4


def test_region_of_clean_data_is_all_of_it_and_a_break_is_found():
    model = muscle_model("tang-optimised")
    rng = np.random.default_rng(8)
    x, p = np.sort(rng.uniform(0.0, 0.075, 120)), rng.uniform(1.5e5, 4e5, 120)
    force = model.unchecked_force(x, p) + rng.normal(0, 0.3, 120)
    assert find_region(x, p, force, 0.3).selected.all()
    assert find_region(x, p, force, 0.3).validity.capability is None
    # Below 20 mm a stiff braid takes over.
    broken = force + np.where(x < 0.02, 3e4 * (0.02 - x), 0.0)
    region = find_region(x, p, broken, 0.3)
    edge = x[region.selected].min()
    assert 0.018 < edge < 0.026
    assert (region.selected == (x >= edge)).all()
    with pytest.raises(InvalidInput, match="level between 0 and 1"):
        find_region(x, p, force, 0.3, level=1.5)
    with pytest.raises(NotIdentifiable, match="a test of it"):
        find_region(x[::15], p[::15], force[::15], 0.3)
    assert find_region(x[::14], p[::14], force[::14], 0.3).selected.all()  # nine


def test_what_the_fit_took_as_known_is_the_change_of_a_fit_with_the_mistake():
    x, p, f = valid()
    found = identify_static(x, p, f, 0.3, select="all")
    strain, pressure = found.model.validity.strain, found.model.validity.pressure
    grid = np.meshgrid(0.3 * np.linspace(*strain, 9), np.linspace(*pressure, 9))
    own = found.model.unchecked_force(*grid)
    mistakes = {"gauge's zero": (x, p + 1e4, f), "contraction's zero": (x + 1e-3, p, f),
                "force sensor's scale": (x, p, 1.01 * f)}  # fmt: skip
    for known in found.known:
        other = identify_static(*mistakes[known.name], 0.3, select="all")
        off = np.median(np.abs(other.model.unchecked_force(*grid) - own)) / np.median(np.abs(own))
        assert 100.0 * off == pytest.approx(known.effects["force_percent"], rel=1e-6)
        # Nothing of it shows.
        np.testing.assert_allclose(other.rms, found.rms, rtol=0.011)
