"""Friction and damping from recorded responses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

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


STATIC = dynamic_model("tang-3-31").static


def of(values, static=STATIC):
    n_2, n_1, n_0, d_1, d_2 = np.asarray(values).tolist()
    friction, damping = LoadDependentFriction.from_bar(n_2, n_1, n_0), Damping.from_bar(d_1, d_2)
    return DynamicModel(name="by hand", static=static, friction=friction, damping=damping)


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


def test_spread_effects_and_doubts_of_the_coefficients_by_differences_of_the_residuals():
    """Covariance of the linear model with n - 5 degrees of freedom, and the share of samples within the law.

    Quick motion is driven by a damping that falls with the speed.
    """
    times, step = np.linspace(0.0, 0.35, 31), PressureStep(2.6e5, 4.0e5, 0.05, 0.03)
    truth = np.array([*TRUTH[:3], -4.0, 0.802])
    response = simulate(of(truth), 22.74 / G, step, times, outside="mark").contraction

    def misfit(values, mass=1.0, share=1.0):
        force = {powers: share * value for powers, value in STATIC.coefficients.items()}
        return replace(measured, mass=mass * measured.mass).residual(of(values, replace(STATIC, coefficients=force)))

    measured = Recording(times, response, step, 22.74 / G, start=float(response[0]))
    rises = np.array([(misfit(truth + d) - misfit(truth - d)) / (2.0 * d.sum()) for d in np.diag(1e-4 * truth)])
    # Noise that no coefficient takes up: the truth is the answer.
    noise = np.random.default_rng(5).normal(0.0, 1e-5, 31)
    noisy = response + noise - rises.T @ np.linalg.lstsq(rises.T, noise, rcond=None)[0]
    measured = Recording(times, noisy, step, 22.74 / G, start=float(response[0]))
    found = identify_dynamic([measured], STATIC, start=truth)
    np.testing.assert_allclose(found.coefficients, truth, rtol=0.01)
    variance = (misfit(found.coefficients) ** 2).sum() / (31 - 5)
    assert (found.samples, found.sigma) == (31, pytest.approx(np.sqrt(variance), rel=1e-3))
    spread = np.sqrt(np.diag(variance * np.linalg.inv(rises @ rises.T)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), spread, rtol=0.05)
    speed = np.gradient(noisy, times)
    inside = found.model.contains(noisy, speed, step.sample(times), measured.mass)
    assert found.inside == pytest.approx(inside.mean())
    half = np.diff(found.intervals(0.95)).ravel() / 2.0
    np.testing.assert_allclose(half, 2.0555 * np.sqrt(np.diag(found.covariance)), rtol=1e-3)  # Student, 26 freedoms
    moving = speed[np.abs(speed) > 0.05 * np.abs(speed).max()]
    drives = (found.coefficients[3] * np.abs(moving) + found.coefficients[4] < 0.0).mean()
    assert 0.0 < drives < 0.5
    assert f"The fitted damping would drive the motion in {100 * drives:.0f} % of the samples" in found.doubts[0]
    # Coefficients answer to an error by least squares, and what shows is left over.
    effects = {each.name: each for each in found.known}
    for name, ends in (
        ("force law", [misfit(found.coefficients, share=1.0 + s) for s in (1e-4, -1e-4)]),
        ("hung weight", [misfit(found.coefficients, mass=1.0 + s) for s in (1e-4, -1e-4)]),
    ):
        moved = 0.01 * (ends[0] - ends[1]) / 2e-4
        change, left = np.linalg.lstsq(rises.T, -moved, rcond=None)[:2]
        forces = [of(values).friction.printed(noisy, step.sample(times), measured.mass)
                  for values in (change, found.coefficients)]  # fmt: skip
        share = 100.0 * np.linalg.norm(forces[0]) / np.linalg.norm(forces[1])
        assert effects[name].effects["friction_percent"] == pytest.approx(share, rel=0.1), name
        assert effects[name].shows == (np.sqrt(left[0]) > 3.0 * found.sigma)


def test_recordings_that_begin_where_the_law_pulls_otherwise_are_named():
    """A weight below 0.4 times the pull at the first sample, or above 2.5 times."""
    static, weight = dynamic_model("tang-3-31").static, 12.74
    times, step = np.linspace(0.0, 0.12, 10), PressureStep(2e5, 3e5, 0.02, 0.03)
    response = simulate(of(TRUTH), weight / G, step, times, outside="mark").contraction
    measured, pulls = [], weight / np.array([0.38, 0.42, 2.4, 2.6])
    for pull in pulls:
        first = brentq(lambda x, pull=pull: float(static.unchecked_force(x, 2e5)) - pull, 1e-3, 0.1)
        seen = np.append(first, response[1:])
        measured.append(Recording(times, seen, step, weight / G, start=float(response[0])))
    doubts = identify_dynamic(measured, static, start=TRUTH).doubts
    said = [text.split(" begins at ") for text in doubts if "begins at" in text]
    assert [text for text, _ in said] == ["Recording 1", "Recording 4"]
    for (_, text), k in zip(said, (0, 3), strict=True):
        first = 1e3 * measured[k].contraction[0]
        assert text.startswith(f"{first:.1f} mm, where the force law pulls {pulls[k]:.1f} N, with a weight of 12.7 N")


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


@pytest.mark.parametrize(("start", "begins"), [(None, 0.03), (0.01, 0.01)])
def test_a_simulation_begins_at_the_first_sample_or_the_start(start, begins):
    recording = Recording([0.0, 0.01], [0.03, 0.03], PressureStep(2e5, 3e5), 1.3, start)
    assert recording.residual(dynamic_model("tang-3-31"))[0] == pytest.approx(begins - 0.03)


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
