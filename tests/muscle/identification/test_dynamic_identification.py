"""Friction and damping from recorded responses."""

from dataclasses import replace

import numpy as np
import pytest

from exo_pin.muscle import (
    Damping,
    DynamicModel,
    LoadDependentFriction,
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
