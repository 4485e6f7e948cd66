"""Pressures over time: steps, traces and jumps as the simulation meets them."""

import numpy as np

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
