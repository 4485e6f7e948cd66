"""Friction and damping from recorded responses."""

from dataclasses import replace

import numpy as np
import pytest

from exo_pin import InvalidInput, SolverFailed
from exo_pin.muscle import (
    Damping,
    DynamicModel,
    LoadDependentFriction,
    NotIdentifiable,
    PressureStep,
    Recording,
    dynamic_model,
    identify_dynamic,
    simulate,
)

G = 9.81
TRUTH = np.array([228.9342, -90.429, 6.87, -1.0, 0.802])
#: How long a response is recorded, s: the first oscillations, or all of them.
SHORT, LONG = 0.5, 1.2


def recordings(noise, seed, samples=151, seconds=SHORT):
    model = dynamic_model("tang-3-31")
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, seconds, samples)
    made = []
    for weight, initial, final in ((12.74, 2.0e5, 3.6e5), (22.74, 2.6e5, 4.0e5), (32.74, 3.5e5, 4.0e5)):
        pressure = PressureStep(initial, final, 0.05, 0.03)
        r = simulate(model, weight / G, pressure, times, outside="mark")
        x = r.contraction + rng.normal(0.0, noise, samples)
        made.append(Recording(times, x, pressure, weight / G, start=float(r.contraction[0])))
    return made


@pytest.mark.full
def test_noisy_responses_give_the_coefficients_back():
    measured = recordings(2e-4, seed=1, seconds=LONG)
    found = identify_dynamic(measured, dynamic_model("tang-3-31").static, start=TRUTH * 1.15)
    low, high = found.intervals(0.99).T
    assert ((low <= TRUTH) & (high >= TRUTH)).all()
    assert found.samples == 453
    # The standard deviation of an estimated one is sigma/sqrt(2n) = 6.6e-6.
    assert abs(found.sigma - 2e-4) < 2e-5
    assert found.inside > 0.8
    # What the responses do not separate is named, and the friction itself is good all the same.
    assert {"N_2", "N_1", "N_0"} <= set(found.indistinct)
    x = np.linspace(0.03, 0.08, 6)
    friction = found.model.friction.printed(x, 3.6e5, 1.3)
    np.testing.assert_allclose(friction, dynamic_model("tang-3-31").friction.printed(x, 3.6e5, 1.3), rtol=0.08)


@pytest.mark.full
def test_spread_of_the_coefficients_by_differences_of_the_residuals():
    """Covariance of the linear model with n - 5 degrees of freedom, and the share of samples within the law."""
    law, measured = dynamic_model("tang-3-31"), recordings(1e-4, seed=5, samples=31, seconds=0.35)[1:2]
    found = identify_dynamic(measured, law.static, start=TRUTH)

    def model(values):
        n_2, n_1, n_0, d_1, d_2 = values
        friction, damping = LoadDependentFriction.from_bar(n_2, n_1, n_0), Damping.from_bar(d_1, d_2)
        return DynamicModel(name="by hand", static=law.static, friction=friction, damping=damping)

    def misfit(values):
        return np.concatenate([each.residual(model(values)) for each in measured])

    steps = np.diag(1e-4 * TRUTH)
    rises = [(misfit(found.coefficients + d) - misfit(found.coefficients - d)) / (2.0 * d.sum()) for d in steps]
    variance = (misfit(found.coefficients) ** 2).sum() / (31 - 5)
    assert (found.samples, found.sigma) == (31, pytest.approx(np.sqrt(variance), rel=1e-3))
    spread = np.sqrt(np.diag(variance * np.linalg.inv(np.array(rises) @ np.array(rises).T)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), spread, rtol=0.05)
    inside = [
        found.model.contains(r.contraction, np.gradient(r.contraction, r.time), r.pressure.sample(r.time), r.mass)
        for r in measured
    ]
    assert found.inside == pytest.approx(np.concatenate(inside).mean())
    half = np.diff(found.intervals(0.95)).ravel() / 2.0
    np.testing.assert_allclose(half, 2.0555 * np.sqrt(np.diag(found.covariance)), rtol=1e-3)  # Student, 26 freedoms


@pytest.mark.full
def test_effects_of_what_was_taken_as_known_are_those_of_fits_with_errors():
    law = dynamic_model("tang-3-31").static
    clean = recordings(0.0, seed=1, samples=41)
    found = identify_dynamic(clean, law, start=TRUTH)

    def friction(fit):
        law = fit.model.friction
        return np.concatenate([law.printed(r.contraction, r.pressure.sample(r.time), r.mass) for r in clean])

    off = identify_dynamic([replace(each, mass=1.0005 * each.mass) for each in clean], law, start=TRUTH)
    share = np.linalg.norm(friction(off) - friction(found)) / np.linalg.norm(friction(found))
    weight = next(each for each in found.known if each.name == "hung weight")
    assert [each.name for each in found.known] == ["force law", "gauge's zero", "contraction's zero", "hung weight"]
    assert abs(weight.effects["friction_percent"] * 0.05 - 100.0 * share) < 0.03 * 100.0 * share
    assert weight.shows  # a wrong weight leaves residuals


@pytest.mark.full
def test_clean_responses_give_them_exactly():
    measured = recordings(0.0, seed=1, samples=61)
    found = identify_dynamic(measured, dynamic_model("tang-3-31").static, start=TRUTH * 1.1)
    np.testing.assert_allclose(found.coefficients, TRUTH, rtol=1e-3)
    assert found.sigma < 1e-7


@pytest.mark.full
def test_a_search_without_a_first_guess_finds_the_valley():
    measured = recordings(1e-4, seed=3, samples=41)[:2]
    found = identify_dynamic(measured, dynamic_model("tang-3-31").static)
    assert found.sigma < 1.5e-4
    low, high = found.intervals(0.999).T
    assert ((low <= TRUTH) & (high >= TRUTH)).all()


def test_responses_without_motion_determine_nothing():
    model = dynamic_model("tang-3-31")
    times = np.linspace(0, 1, 50)
    still = Recording(times, np.full(50, 0.059), PressureStep(3.6e5, 3.6e5), 22.74 / G)
    with pytest.raises(NotIdentifiable) as caught:
        identify_dynamic([still], model.static, start=TRUTH)
    assert set(caught.value.coefficients) == {"N_2", "N_1", "N_0", "D_1", "D_2"}
    with pytest.raises(NotIdentifiable, match="more than 5 samples"):
        identify_dynamic([Recording([0, 1], [0.05, 0.05], PressureStep(3e5, 3e5), 1.0)], model.static)


def test_bad_recordings_are_named():
    step = PressureStep(3e5, 3e5)
    with pytest.raises(InvalidInput, match="contraction to have shape"):
        Recording([0, 1, 2], [0.05, 0.05], step, 1.0)
    with pytest.raises(InvalidInput, match="rise"):
        Recording([0, 1, 1], [0.05, 0.05, 0.05], step, 1.0)
    with pytest.raises(InvalidInput, match="mass"):
        Recording([0, 1], [0.05, 0.05], step, 0.0)
    with pytest.raises(InvalidInput, match="at least one Recording"):
        identify_dynamic([], dynamic_model("tang-3-31").static)


def test_the_search_ends_in_the_stated_time():
    with pytest.raises(SolverFailed, match="within the time limit of 1e-06 s"):
        identify_dynamic(recordings(0.0, seed=1, samples=11)[:1], dynamic_model("tang-3-31").static, time_limit=1e-6)
    with pytest.raises(InvalidInput, match="time_limit"):
        identify_dynamic(recordings(0.0, seed=1, samples=11)[:1], dynamic_model("tang-3-31").static, time_limit=0.0)


def test_recordings_of_no_muscle_are_refused():
    step, static = PressureStep(2e5, 3e5), dynamic_model("tang-3-31").static
    for contraction, pressure in ((30.0, step), (0.03, PressureStep(20.0 * 1e5, 29.0 * 1e5))):
        with pytest.raises(InvalidInput, match="write the unit in the header"):
            identify_dynamic([Recording(np.arange(8.0), np.full(8, contraction), pressure, 1.3)], static)


@pytest.mark.full
def test_friction_of_the_wrong_sign_is_not_identified():
    """Responses without friction and damping determine neither."""
    law = dynamic_model("tang-3-31")
    free = DynamicModel(
        name="free",
        static=law.static,
        friction=LoadDependentFriction.from_bar(0, 0, 0),
        damping=Damping.from_bar(0, 0.8),
    )
    times, step = np.linspace(0.0, 0.3, 31), PressureStep(2e5, 3.6e5, 0.05, 0.03)
    seen = simulate(free, 1.3, step, times, outside="mark").contraction
    with pytest.raises(NotIdentifiable) as caught:
        identify_dynamic([Recording(times, seen, step, 1.3)], law.static, start=[0.0, 0.0, 0.5, 0.0, 0.8])
    assert {"N_2", "N_1", "N_0"} & set(caught.value.coefficients)
