"""Pressures over time: steps, traces and jumps as the simulation meets them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from exo_pin.muscle import (
    PressureStep,
    PressureTrace,
    dynamic_model,
    simulate,
)

G = 9.81


def test_a_trace_gives_what_the_step_gives():
    model = dynamic_model("tang-3-31")
    step = PressureStep(2.6e5, 3.6e5, 0.05, 0.08)
    grid = np.linspace(0.0, 0.6, 1201)
    trace = PressureTrace(grid, step.sample(grid))
    times = np.linspace(0.0, 0.6, 61)
    a, b = (simulate(model, 22.74 / G, p, times, rtol=1e-8, atol=1e-10) for p in (step, trace))
    # Interpolation at 0.5 ms: the kink of the step is off by at most one sample.
    assert np.abs(a.contraction - b.contraction).max() < 2e-5


def test_a_jump_of_the_pressure_is_met_exactly():
    """A jump while the mass is moving: the same as two simulations, one on each side of it."""
    model = dynamic_model("tang-constant-friction")
    first, second = np.linspace(0.0, 0.2, 21), np.linspace(0.2, 0.6, 41)
    whole = simulate(model, 2.0, PressureStep(3e5, 3.5e5, 0.2), np.concatenate([first, second[1:]]), contraction=0.035)
    before = simulate(model, 2.0, PressureStep(3e5, 3e5), first, contraction=0.035)
    assert abs(before.velocity[-1]) > 0.05
    after = simulate(
        model, 2.0, PressureStep(3.5e5, 3.5e5), second, before.contraction[-1], velocity=before.velocity[-1]
    )
    np.testing.assert_allclose(whole.contraction[:21], before.contraction, atol=1e-11)
    np.testing.assert_allclose(whole.contraction[20:], after.contraction, atol=1e-10)
    assert abs(whole.energy_residual) < 1e-11


def test_a_jump_while_the_mass_rests_lifts_it_at_once():
    model = dynamic_model("tang-constant-friction")
    first, second = np.linspace(0.0, 0.2, 5), np.linspace(0.2, 0.4, 21)
    times = np.concatenate([first, second[1:]])
    whole = simulate(model, 2.0, PressureStep(3e5, 3.8e5, 0.2), times)
    after = simulate(model, 2.0, PressureStep(3.8e5, 3.8e5), second, whole.contraction[0])
    assert np.ptp(whole.contraction[:5]) == 0.0
    assert whole.contraction[-1] > whole.contraction[0] + 2e-3
    np.testing.assert_allclose(whole.contraction[4:], after.contraction, atol=1e-10)


def test_a_short_pulse_in_a_trace_is_not_missed():
    """What exceeds friction lasts less than half of a sample."""
    model, grid = dynamic_model("tang-constant-friction"), np.linspace(0.0, 0.2, 5)
    rest = simulate(model, 2.0, PressureStep(3e5, 3e5), grid).contraction[0]
    lack = 2.0 * G + model.friction.bound(rest, 3e5, 2.0)
    enough = brentq(lambda p: float(model.static.unchecked_force(rest, p)) - lack, 3e5, 4e5) - 3e5
    for share, lifted in ((0.98, False), (1.03, True)):
        trace = PressureTrace(grid, np.array([3e5, 3e5, 3e5 + share * enough, 3e5, 3e5]))
        run = simulate(model, 2.0, trace, np.linspace(0.0, 0.2, 201))
        assert (run.contraction[-1] > rest) == lifted


def test_a_response_settles_between_samples():
    run = simulate(
        dynamic_model("tang-3-31"), 1.5, PressureStep(2e5, 3e5, 0.1, 0.3), np.linspace(0, 1, 11), outside="mark"
    )
    time, gone = np.array([0.0, 1.0, 3.0, 5.0, 6.0, 20.0]), np.array([0.0, 0.5, 0.97, 0.99, 1.0, 1.0])
    made = replace(run, time=time + 7.0, contraction=0.04 + 0.02 * gone)
    assert made.settling_time() == pytest.approx(4.0)  # halfway between 3 and 5 s
    assert made.settling_time(0.06) == pytest.approx(1.0 + 2.0 * 0.44 / 0.47)
    assert replace(made, contraction=np.full(6, 0.06) - 0.0004 * (time > 19.0) - 0.02 * (time < 1.0)).overshoot > 0.0
    assert made.overshoot == 0.0
