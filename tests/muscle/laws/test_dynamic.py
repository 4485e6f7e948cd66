"""The dynamic force law: passive inside its range, a set at rest, in the units it was printed in."""

import numpy as np
import pytest

from exo_pin.muscle import OutsideValidity, PressureStep, dynamic_model, dynamic_models, simulate

G = 9.81


def test_no_energy_from_closed_cycles_inside_the_range():
    """Over a cycle at constant pressure the static force gives nothing, so the muscle can only take work."""
    rng = np.random.default_rng(21)
    phase = np.linspace(0, 2 * np.pi, 20001)
    cycles = 0
    for name in dynamic_models():
        model = dynamic_model(name)
        for _ in range(60):
            centre, reach, rate = rng.uniform(0.03, 0.06), rng.uniform(0.001, 0.02), rng.uniform(1, 40)
            x, v = centre + reach * np.sin(phase), reach * rate * np.cos(phase)
            mass, p = rng.uniform(0.5, 3.0), np.full_like(x, rng.uniform(2e5, 4e5))
            if not model.contains(x, v, p, mass).all():
                continue
            lower, upper = model.force(x, v, p, mass)
            work = np.trapezoid(0.5 * (lower + upper) * v / rate, phase)
            # Friction takes at least its least bound over the path; the quadrature is good to 1e-8.
            least = min(model.friction.bound(float(a), float(p[0]), mass) for a in x[::200])
            assert work <= -4 * reach * least + 1e-6
            cycles += 1
    assert cycles > 40


def test_no_power_from_friction_and_damping_anywhere_inside():
    model = dynamic_model("tang-3-31")
    rng = np.random.default_rng(22)
    x, v = rng.uniform(0.0, 0.1, 5000), rng.uniform(-3.0, 1.5, 5000)
    p, mass = rng.uniform(0.5e5, 4e5, 5000), 1.8
    power = -model.damping.printed(v, p) * v - np.sign(v) * model.friction.printed(x, p, mass) * v
    inside = model.contains(x, v, p, mass)
    assert inside.sum() > 500
    assert (power[inside] <= 0).all()
    # The range is needed: outside it the printed law does create energy, for each of its reasons.
    margins = model.margins(x, v, p, mass)
    assert (power[(margins[2] < 0)] > 0).any()
    assert (power[(margins[0] < 0) & (np.abs(v) < 0.3)] > 0).any()
    # The polynomial of the friction turns negative beyond 102.6 mm.
    roots = np.sort(np.roots([228.9342, -90.429, 6.87]))
    assert abs(roots[0] - 0.1026) < 1e-4
    assert model.friction.bound(0.101, 3e5, mass) > 0 == model.friction.bound(0.104, 3e5, mass)
    assert model.friction.printed(0.104, 3e5, mass) < 0
    # Two negative factors make no friction either.
    assert model.friction.bound(0.104, 1e5, mass) == 0 < model.friction.printed(0.104, 1e5, mass)


def test_damping_is_excluded_where_it_pushes():
    damping = dynamic_model("tang-3-31").damping
    assert damping.printed(0.801, 3e5) > 0 > damping.printed(0.803, 3e5)
    assert damping.printed(-2.0, 3e5) < 0
    model = dynamic_model("tang-3-31")
    model.force(0.05, 0.80, 3e5, 1.3)
    with pytest.raises(OutsideValidity, match="damping"):
        model.force(0.05, 0.81, 3e5, 1.3)
    with pytest.raises(OutsideValidity, match="friction factor 1"):
        model.force(0.05, 0.1, 2.5e5, 3.0)


def test_the_force_at_rest_is_a_set():
    model = dynamic_model("tang-3-31")
    low, high = model.force(0.05, [-0.1, 0.0, 0.1], 3.6e5, 1.3)
    bound = model.friction.bound(0.05, 3.6e5, 1.3)
    static = model.static.force(0.05, 3.6e5)
    assert bound > 1.0
    np.testing.assert_allclose([low[1], high[1]], [static - bound, static + bound])
    # Moving, it is one force, and it opposes the motion: more pull while lengthening, less while shortening.
    assert low[0] == high[0] > static + bound
    assert low[2] == high[2] < static - bound
    marked = model.force([0.05, 0.2], 0.0, 3.6e5, 1.3, outside="mark")
    np.testing.assert_array_equal(marked[0].mask, [False, True])


def test_units_of_the_printed_coefficients():
    """(3-29) and (3-30) at 3.6 bar, 22.74 N, 30 mm, 0.5 m/s, written out in bar and m."""
    model = dynamic_model("tang-3-31")
    mass = 22.74 / G
    coulomb = (3.6 - mass) * (228.9342 * 0.03**2 - 90.429 * 0.03 + 6.87)
    assert abs(model.friction.printed(0.03, 3.6e5, mass) - coulomb) < 1e-12
    assert abs(model.damping.printed(0.5, 3.6e5) - 3.6 * (-(0.5**2) + 0.802 * 0.5)) < 1e-12
    assert model.static.name == "tang-3-25"
    assert dynamic_model("tang-constant-friction").friction.bound(0.03, 3.6e5, mass) == 2.5


def test_rest_band_is_where_a_mass_stays():
    model = dynamic_model("tang-3-31")
    mass, p = 22.74 / G, 3.6e5
    low, high = model.rest_band(mass, p)
    for x, side in ((low, 1.0), (high, -1.0)):
        net = model.static.unchecked_force(x, p) - mass * G
        assert abs(net - side * model.friction.bound(x, p, mass)) < 1e-9
    times = np.linspace(0, 0.5, 6)
    steady = PressureStep(p, p)
    for x, stays in ((low + 1e-4, True), (high - 1e-4, True), (low - 1e-3, False), (high + 1e-3, False)):
        response = simulate(model, mass, steady, times, contraction=x)
        assert (np.ptp(response.contraction) == 0.0) == stays
        assert low - 1e-4 <= response.steady_state <= high + 1e-4
    with pytest.raises(OutsideValidity, match="holds within its stroke"):
        model.rest_band(20.0, p)
