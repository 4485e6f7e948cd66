"""Stick and slip against exact solutions and time stepping; short pulses and slow supplies."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from exo_pin.muscle import (
    ConstantFriction,
    Damping,
    DynamicModel,
    Mode,
    PolynomialModel,
    PressureStep,
    PressureTrace,
    Validity,
    dynamic_model,
    muscle_model,
    settling_against_lag,
    simulate,
)

G = 9.81


def linear(stiffness=800.0, friction=2.5, damping=(0.0, 0.0)):
    """A muscle that is a straight spring, 60 N at 0 mm, whatever the pressure."""
    static = PolynomialModel(
        coefficients={(0, 0): 60.0, (1, 0): -stiffness},
        name="spring",
        reference_length=0.3,
        validity=Validity(strain=(0.0, 0.25), pressure=(0.0, 5e5)),
    )
    return DynamicModel(
        name="spring", static=static, friction=ConstantFriction(friction), damping=Damping.from_bar(*damping)
    )


def test_coulomb_oscillator_is_exact():
    """Half a period after another the amplitude falls by 2 f/k, until f can hold the spring."""
    k, f, m = 800.0, 1.0, 2.0
    model = linear(k, f)
    centre, start = (60.0 - m * G) / k, 0.072
    amplitude, half = start - centre, math.pi * math.sqrt(m / k)
    turns = math.ceil((amplitude - f / k) / (2 * f / k))
    times = np.linspace(0.0, 3.0, 3001)
    response = simulate(model, m, PressureStep(1e5, 1e5), times, contraction=start)
    sign = 1.0
    expected = np.empty_like(times)
    for n in range(turns):
        now = (times >= n * half) & (times < (n + 1) * half)
        reach = amplitude - (2 * n + 1) * f / k
        expected[now] = centre + sign * (f / k + reach * np.cos(math.sqrt(k / m) * (times[now] - n * half)))
        sign = -sign
    rest = centre + (-1) ** turns * (amplitude - 2 * turns * f / k)
    expected[times >= turns * half] = rest
    np.testing.assert_allclose(response.contraction, expected, atol=1e-9)
    assert response.at_rest
    assert turns == len(response.switches) - 1 == 9
    np.testing.assert_allclose([t for t, _ in response.switches], np.arange(turns + 1) * half, atol=1e-9)
    modes = [mode for _, mode in response.switches]
    assert modes == [Mode.LENGTHENING, Mode.SHORTENING] * 4 + [Mode.LENGTHENING, Mode.STICKING]
    # Friction took all that the spring and the weight gave up.
    lost = 0.5 * k * (amplitude**2 - (rest - centre) ** 2)
    np.testing.assert_allclose(response.friction_loss, lost, rtol=1e-9)
    assert abs(response.energy_residual) < 1e-10


def test_damped_oscillator_is_exact():
    k, m, c = 800.0, 2.0, 6.0
    model = linear(k, 0.0, (0.0, c / 2))  # 2 bar makes c of c/2 N s/(m bar)
    times = np.linspace(0.0, 2.0, 401)
    centre = (60.0 - m * G) / k
    response = simulate(model, m, PressureStep(2e5, 2e5), times, contraction=0.07)
    decay, omega = c / (2 * m), math.sqrt(k / m - (c / (2 * m)) ** 2)
    swing = np.cos(omega * times) + decay / omega * np.sin(omega * times)
    np.testing.assert_allclose(
        response.contraction, centre + (0.07 - centre) * np.exp(-decay * times) * swing, atol=1e-9
    )


def stepped(model, m, pressure, times, x, h):
    """Moreau's time stepping: implicit in velocity and friction, set-valued, no events. First order in h."""
    v, out, k = 0.0, [], 0
    steps = round((times[-1] - times[0]) / h)
    sample = round((times[1] - times[0]) / h)
    for n in range(steps + 1):
        if n % sample == 0:
            out.append(x)
            k += 1
        middle = x + 0.5 * h * v
        p = pressure(times[0] + (n + 0.5) * h)
        pull = model.static.unchecked_force(middle, p)
        drag = p * model.damping.rate(v)
        free = v + h / m * (pull - m * G)
        # (1 + h drag/m) v_new + h/m F = free with F in the friction set of v_new.
        most = h / m * model.friction.bound(middle, p, m)
        fresh = math.copysign(max(0.0, abs(free) - most), free) / (1 + h * drag / m)
        x, v = x + 0.5 * h * (v + fresh), fresh
    return np.array(out)


def test_events_agree_with_time_stepping_and_converge():
    model = dynamic_model("tang-3-31")
    mass, pressure = 12.74 / G, PressureStep(2.2e5, 3.4e5, 0.05, 0.04)
    times = np.linspace(0.0, 1.2, 61)
    response = simulate(model, mass, pressure, times)
    assert {mode for _, mode in response.switches} >= {Mode.STICKING, Mode.SHORTENING, Mode.LENGTHENING}
    assert response.inside.all()
    errors = [
        np.abs(stepped(model, mass, pressure, times, response.contraction[0], h) - response.contraction).max()
        for h in (1e-4, 2.5e-5)
    ]
    assert errors[1] < 2e-5
    assert errors[1] < 0.4 * errors[0]


def test_a_mass_that_comes_down_is_stopped_without_rebound():
    model = dynamic_model("tang-constant-friction")
    times = np.linspace(0, 1.0, 1001)
    response = simulate(model, 1.0, PressureStep(3e5, 0.0, 0.1), times, outside="mark", contraction=0.05)
    assert response.switches[-1][1] is Mode.AT_STOP
    hit = response.time >= response.switches[-1][0]
    assert hit.sum() > 50
    assert (response.contraction[hit] == 0.0).all()
    assert (response.velocity[hit] == 0.0).all()
    assert response.contraction.min() == 0.0
    # The hit took the kinetic energy that the fall had given.
    speed = response.velocity[~hit][-1]
    assert speed < -0.5
    np.testing.assert_allclose(response.impact_loss, 0.5 * 1.0 * speed**2, rtol=0.03)
    assert abs(response.energy_residual) < 1e-9


def test_vented_muscle_falls_freely():
    free = DynamicModel(
        name="free",
        static=muscle_model("tang-3-25"),
        friction=ConstantFriction(0.0),
        damping=Damping(0.0, 0.0),
    )
    times = np.linspace(0.0, 0.08, 9)
    response = simulate(free, 1.0, PressureStep(0.0, 0.0), times, contraction=0.06, outside="mark")
    np.testing.assert_allclose(response.contraction, 0.06 - 0.5 * G * times**2, atol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("lag", [0.3, 0.4, 0.5])
def test_ever_smaller_slips_end(lag):
    """As the pressure settles, rests and slips alternate at a steady pace, down to forces of the tolerance, and end."""
    model, mass = dynamic_model("tang-3-31"), 1.299
    response = simulate(
        model, mass, PressureStep(0.0, 4e5, time_constant=lag), np.linspace(0, 12, 121),
        outside="mark", rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    assert response.at_rest
    assert response.velocity[-1] == 0.0
    assert abs(response.energy_residual) < 1e-6
    slips = np.array([t for t, mode in response.switches if mode is Mode.SHORTENING])
    lacking = 4e5 * np.exp(-slips / lag)  # Pa
    steady = slips[(lacking > 0.1) & (lacking < 1e3)]
    assert len(steady) > 8
    np.testing.assert_allclose(np.diff(steady), np.diff(steady).mean(), rtol=2e-3)
    assert lacking[-1] < 1e-2


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


@pytest.mark.full
def test_settling_follows_the_lag():
    model, mass = dynamic_model("tang-3-31"), 22.74 / 9.81
    lags = [0.0, 1.0, 2.0]
    settling = settling_against_lag(model, mass, 4e5, lags)
    # A jump drives the mass faster than the damping holds.
    assert np.isnan(settling[0])
    assert settling[1] == pytest.approx(3.63, abs=0.05)
    assert settling[1] < 6.0 < settling[2]
    steps = [PressureStep(0.0, 4e5, time_constant=lag) for lag in lags]
    times = np.linspace(0, 8, 801)
    alone = [simulate(model, mass, step, times, outside="mark") for step in steps]
    assert alone[0].overshoot > 0.5
    assert max(run.overshoot for run in alone[1:]) < 0.001
    assert settling[1] == pytest.approx(alone[1].settling_time(), abs=0.02)
