"""Static identification: fit, covariance, leave-one-out, coefficients that cannot be distinguished, the region."""

import numpy as np
import pytest
from scipy.optimize import curve_fit

from exo_pin import InvalidInput
from exo_pin.muscle import NotIdentifiable, find_region, identify_static, muscle_model, steady_states
from exo_pin.muscle.identification.regimes import SECOND_ORDER, design_matrix
from exo_pin.muscle.identification.region import capability_line, collinear


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


def test_optimum_is_at_least_as_good_as_the_printed_set():
    x, p, f = valid()
    found = identify_static(x, p, f, 0.3)
    printed = float(((muscle_model("tang-optimised").unchecked_force(x, p) - f) ** 2).sum())
    least = float((found.residuals**2).sum())
    assert least <= printed
    np.testing.assert_allclose([printed, least], [4.6024, 4.5713], atol=5e-5)


def test_leave_one_out_errors_are_those_of_refits():
    x, p, f = valid()
    found = identify_static(x, p, f, 0.3)
    for i in (0, 7, 24):
        rest = np.arange(25) != i
        again = identify_static(x[rest], p[rest], f[rest], 0.3).model
        np.testing.assert_allclose(found.leave_one_out[i], f[i] - again.unchecked_force(x[i], p[i]), rtol=1e-7)
    assert abs(found.leave_one_out_rms - 0.60696) < 1e-5


def test_ill_condition_is_reported_and_forces_agree_all_the_same():
    x, p, f = valid()
    found = identify_static(x, p, f, 0.3)
    assert 4e4 < np.linalg.cond(design_matrix(x, p, SECOND_ORDER)) < 6e4
    assert found.indistinct == ("K_1", "K_2", "C_1", "S_1", "S_2", "S_3")
    printed = muscle_model("tang-optimised")
    assert abs(found.model.coefficients[2, 1] / printed.coefficients[2, 1] - 1) > 0.05
    assert np.abs(found.model.unchecked_force(x, p) - printed.unchecked_force(x, p)).max() < 0.25


def test_orthogonal_columns_are_distinguished():
    rng = np.random.default_rng(4)
    basis = np.linalg.qr(rng.normal(size=(30, 5)))[0]
    good = basis[:, :4] * [1.0, 1e6, 1e-6, 1.0]
    assert not collinear(good).any()
    # A fifth column that leans on the second to one part in a thousand.
    leaning = np.column_stack([good, basis[:, 1] + 1e-3 * basis[:, 4]])
    np.testing.assert_array_equal(collinear(leaning), [False, True, False, False, True])


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


def test_noise_is_found_back():
    truth = muscle_model("best")
    rng = np.random.default_rng(6)
    x, p = rng.uniform(0.015, 0.07, 4000), rng.uniform(2e5, 4e5, 4000)
    powers = tuple(truth.in_bar)
    found = identify_static(x, p, truth.unchecked_force(x, p) + rng.normal(0, 0.3, 4000), 0.3, powers)
    # The standard deviation of an estimated one is sigma/sqrt(2n) = 0.0034.
    assert abs(found.sigma - 0.3) < 0.0135


def test_what_data_cannot_determine_is_named():
    x, p, f = valid()
    with pytest.raises(NotIdentifiable, match="more than 6 measurements"):
        identify_static(x[:6], p[:6], f[:6], 0.3)
    with pytest.raises(NotIdentifiable) as caught:
        identify_static(x, np.full(25, 3e5), f, 0.3)
    assert set(caught.value.coefficients) == {"K_1", "K_2", "C_1", "S_1", "S_2", "S_3"}
    with pytest.raises(NotIdentifiable) as caught:
        identify_static(np.zeros(25), p, f, 0.3)
    assert {"K_1", "K_2", "S_1", "S_2"} <= set(caught.value.coefficients)
    assert "C_1" not in caught.value.coefficients


def test_bad_measurements_are_named():
    x, p, f = valid()
    with pytest.raises(InvalidInput, match="one length, got 24, 25 and 25"):
        identify_static(x[1:], p, f, 0.3)
    with pytest.raises(InvalidInput, match="force to be finite"):
        identify_static(x, p, np.where(f > 60, np.nan, f), 0.3)
    with pytest.raises(InvalidInput, match="the pressure has the other sign"):
        identify_static(x, -p, f, 0.3)
    for fit in (identify_static, find_region):
        with pytest.raises(InvalidInput, match="0 to 10 bar"):
            fit(x, 1e5 * p, f, 0.3)
        for contraction, length in ((1e3 * x, 0.3), (x, 3e-4), (-1e3 * x, 0.3)):
            with pytest.raises(InvalidInput, match="-5 to 40 %"):
                fit(contraction, p, f, length)
    with pytest.raises(InvalidInput, match="'all' or 'region'"):
        identify_static(x, p, f, 0.3, select="some")
    with pytest.raises(InvalidInput, match="between 0 and 1"):
        identify_static(x, p, f, 0.3).intervals(1.5)


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


def test_capability_line_separates_selected_from_rejected():
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, 0.3)
    slope, intercept = region.validity.capability
    room = slope * states.pressure + intercept - states.force
    assert region.margin > 0.9
    np.testing.assert_allclose(room[region.selected].min(), region.margin, atol=1e-9)
    np.testing.assert_allclose(-room[~region.selected].max(), region.margin, atol=1e-9)
    # So does the line of the shading that the tables print.
    (slope, intercept), margin = capability_line(states.pressure, states.force, states.called_valid)
    assert margin > 1.0
    room = slope * states.pressure + intercept - states.force
    assert room[states.called_valid].min() > 0 > room[~states.called_valid].max()
    assert capability_line(states.pressure, states.force, np.ones(66, bool)) == (None, np.inf)


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


def test_region_of_one_law_is_all_of_it_and_of_a_region_the_region():
    """Few measurements of one law are one regime (99 % of the sets), and what is found is found again."""
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, 0.3)
    assert (region.selected & states.called_valid).sum() == 25
    kept = states.select(region.selected)
    assert find_region(kept.contraction, kept.pressure, kept.force, 0.3).selected.all()
    assert find_region(*valid(), 0.3).selected.all()
    rng, truth = np.random.default_rng(50), muscle_model("tang-optimised")
    shares = []
    for count in (20, 40):
        for _ in range(20):
            x, p = rng.uniform(0.005, 0.075, count), rng.uniform(2e5, 4e5, count)
            force = truth.unchecked_force(x, p) + rng.normal(0, 0.3, count)
            shares.append(find_region(x, p, force, 0.3).selected.mean())
    assert np.mean(shares) > 0.98


def test_rejected_measurements_pull_more_than_the_law():
    """A drop of the pull at small contraction is no braid: everything is kept, and the misfit is said."""
    model, rng = muscle_model("tang-optimised"), np.random.default_rng(3)
    x, p = rng.uniform(0.0, 0.075, 60), rng.uniform(1.5e5, 4e5, 60)
    dropped = model.unchecked_force(x, p) + rng.normal(0, 0.2, 60) - np.where(x < 0.02, 900.0 * (0.02 - x), 0.0)
    region = find_region(x, p, dropped, 0.3)
    assert region.selected.all()
    assert 1.0 < region.misfit < 6.0
    slight = dropped + np.where(x < 0.02, 450.0 * (0.02 - x), 0.0)  # half of it, below 2 % of the greatest force
    assert find_region(x, p, slight, 0.3).misfit is None
    assert "more than their scatter" in " ".join(identify_static(x, p, dropped, 0.3, select="region").cautions)


def test_an_outlier_is_named_and_left_out():
    x, p, f = valid()
    for place, factor in ((3, 10.0), (11, 0.5), (20, 1.3)):
        typed = f * np.where(np.arange(25) == place, factor, 1.0)
        region = find_region(x, p, typed, 0.3)
        assert region.outliers.tolist() == [place]
        assert region.selected.sum() == 24
        fit = identify_static(x, p, typed, 0.3, select="region")
        assert f"Measurement {place + 1} is not fitted" in " ".join(fit.cautions)
        assert identify_static(x, p, typed, 0.3).suspects == (place,)


def test_digits_of_the_data_bound_the_uncertainty():
    """Measurements that lie on the law to their digits are no better known than these digits."""
    truth = muscle_model("tang-optimised")
    x, p, _ = valid()
    force = np.round(truth.unchecked_force(x, p))
    found = identify_static(x, p, force, 0.3)
    # The 1 N of the last digit is 1/sqrt(12) N; the digits of contraction (1 µm) and pressure (1 mbar) add 6 mN.
    assert abs(found.rounding - 12**-0.5) < 1e-3
    assert (
        np.diff(found.intervals())[:, 0] >= 0.99 * np.diff(identify_static(x, p, force, 0.3).intervals())[:, 0]
    ).all()
    exact = identify_static(x, p, truth.unchecked_force(x, p).round(2), 0.3)
    assert exact.rounding > exact.sigma * 0.5


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


def test_the_pull_bounds_the_diameter():
    x, p, f = valid()
    least, most = identify_static(x, p, f, 0.3).diameters
    assert least < 0.006 < most < 3 * least
    assert identify_static(x, p, f / 9.80665, 0.3).diameters[1] < 0.004
