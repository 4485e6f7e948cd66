"""The dynamic force law: passive inside its range, a set at rest, in the units it was printed in."""

import numpy as np

from exo_pin.muscle import dynamic_model, dynamic_models

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


def test_units_of_the_printed_coefficients():
    """(3-29) and (3-30) at 3.6 bar, 22.74 N, 30 mm, 0.5 m/s, written out in bar and m."""
    model = dynamic_model("tang-3-31")
    mass = 22.74 / G
    coulomb = (3.6 - mass) * (228.9342 * 0.03**2 - 90.429 * 0.03 + 6.87)
    assert abs(model.friction.printed(0.03, 3.6e5, mass) - coulomb) < 1e-12
    assert abs(model.damping.printed(0.5, 3.6e5) - 3.6 * (-(0.5**2) + 0.802 * 0.5)) < 1e-12
    assert model.static.name == "tang-3-25"
    assert dynamic_model("tang-constant-friction").friction.bound(0.03, 3.6e5, mass) == 2.5
