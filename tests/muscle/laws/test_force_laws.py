"""Force laws against virtual work, energy of cycles, differences and printed values."""

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.muscle import (
    ChouHannaford,
    FestoLaw,
    PolynomialModel,
    Validity,
    dynamic_model,
    dynamic_models,
    muscle_model,
    muscle_models,
)

WIDE = Validity(strain=(0.0, 0.25), pressure=(0.0, 4e5))


def all_models():
    fields = {"reference_length": 0.3, "validity": WIDE}
    extra = [
        ChouHannaford(name="chou", braid_length=0.36, turns=7.3, **fields),
    ]
    return [muscle_model(name) for name in muscle_models()] + extra


def inside(model, n=40, seed=3):
    """States inside the model's range, drawn from its box."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(*model.validity.strain, 20 * n) * model.length
    p = rng.uniform(*model.validity.pressure, 20 * n)
    ok = ~np.ma.getmaskarray(model.force(x, p, outside="mark"))
    assert ok.sum() >= n
    return x[ok][:n], p[ok][:n]


@pytest.mark.parametrize("model", all_models(), ids=lambda m: m.name)
@pytest.mark.parametrize("length", [None, 0.15])
def test_derivatives_are_those_of_the_force(model, length):
    model = model if length is None else model.scaled(length)
    x, p = inside(model)
    # Central differences of polynomials of low degree: the error is h² times a third derivative, far below 1e-6.
    h, q = 1e-5 * model.length, 1.0
    slope = (model.unchecked_force(x + h, p) - model.unchecked_force(x - h, p)) / (2 * h)
    gain = (model.unchecked_force(x, p + q) - model.unchecked_force(x, p - q)) / (2 * q)
    stiffness, pressure_gain = model.stiffness(x, p), model.pressure_gain(x, p)
    np.testing.assert_allclose(stiffness, slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())
    np.testing.assert_allclose(pressure_gain, gain, rtol=1e-6, atol=1e-6 * np.abs(gain).max())


@pytest.mark.parametrize("name", muscle_models())
@pytest.mark.parametrize("length", [None, 0.25])
def test_inverses_come_back(name, length):
    model = muscle_model(name, nominal_length=length)
    x, p = inside(model)
    force = model.force(x, p)
    np.testing.assert_allclose(model.pressure_for(force, x), p, rtol=1e-9)
    # At a given force and pressure the stable contraction; in the range it is the only one.
    np.testing.assert_allclose(model.contraction_for(force, p), x, rtol=1e-9)
    assert (model.stiffness(x, p) < 0).all()


def test_chou_hannaford_is_virtual_work():
    model = next(m for m in all_models() if m.name == "chou")
    x, p = inside(model)

    def volume(contraction):
        return 0.25 * np.pi * model.diameter(contraction) ** 2 * (0.3 - contraction)

    h = 1e-6
    # dL = -dx, so F = -P dV/dL = P dV/dx.
    np.testing.assert_allclose(model.force(x, p), p * (volume(x + h) - volume(x - h)) / (2 * h), rtol=1e-7)
    with pytest.raises(InvalidInput, match="thread"):
        model.diameter(-0.1)


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


LIMITS = Validity(strain=(0.0, 0.16), pressure=(0.0, 6.2e5))


def festo():
    return FestoLaw(name="festo", reference_length=0.189, validity=LIMITS, largest_strain=0.1667)


def test_the_fluidic_muscle_has_its_check_values():
    # At a strain of 5 %: 100 N at 343,195 Pa and 200 N at 514,533 Pa.
    np.testing.assert_allclose(festo().force(0.05 * 0.189, [343195.0, 514533.0]), [100.0, 200.0], atol=5e-4)


def test_the_fluidic_muscle_solves_its_formula_and_differentiates():
    rng, law = np.random.default_rng(1), festo()
    strain, pressure = rng.uniform(0.005, 0.158, 500), rng.uniform(1e5, 6.2e5, 500)
    x, force = strain * 0.189, law.unchecked_force(strain * 0.189, pressure)
    pulls = force > 1.0
    assert 200 < pulls.sum() < 450
    angle = 2.0265 * (strain / (0.1667 - 0.331e-3 * force) - 0.461)
    again = 254.3e3 + 192e3 * np.tan(angle) + 1.23e3 * force
    np.testing.assert_allclose(again[pulls], pressure[pulls], rtol=1e-9)
    h = 1e-7
    slope = (law.unchecked_force(x + h, pressure) - law.unchecked_force(x - h, pressure)) / (2 * h)
    np.testing.assert_allclose(law.stiffness(x, pressure, "mark").data[pulls], slope[pulls], rtol=1e-5)
    gain = (law.unchecked_force(x, pressure + 5) - law.unchecked_force(x, pressure - 5)) / 10
    np.testing.assert_allclose(law.pressure_gain(x, pressure, "mark").data[pulls], gain[pulls], rtol=1e-6)
    assert (slope[pulls] < 0).all()
    assert (gain[pulls] > 0).all()
    there = law.pressure_for(force[pulls], x[pulls], "mark").data
    np.testing.assert_allclose(there, pressure[pulls], rtol=1e-6)
    with pytest.raises(InvalidInput, match="polynomial in contraction"):
        law.contraction_powers(3e5)
    with pytest.raises(InvalidInput, match="a share, below"):
        FestoLaw(name="percent", reference_length=0.189, validity=LIMITS, largest_strain=16.67)


def test_tondu_and_lopez_of_a_cylinder_is_chou_and_hannaford():
    """The same braid said two ways: a thread of length b with n turns has cos α = L/b and π D n = b sin α."""
    diameter, angle, length = 0.012, np.radians(24.0), 0.3
    thread = length / np.cos(angle)
    turns = thread * np.sin(angle) / (np.pi * diameter)
    cylinder = PolynomialModel.tondu_lopez(diameter, angle, length, name="cylinder", validity=LIMITS)
    braid = ChouHannaford(name="braid", reference_length=length, validity=LIMITS, braid_length=thread, turns=turns)
    x, p = np.meshgrid(np.linspace(0.0, 0.045, 7), np.linspace(1e5, 6e5, 5))
    np.testing.assert_allclose(cylinder.force(x, p), braid.force(x, p), rtol=1e-12)
    # With k the same force comes at a strain that is smaller by k.
    rounder = PolynomialModel.tondu_lopez(diameter, angle, length, k=1.25, name="rounder", validity=LIMITS)
    np.testing.assert_allclose(rounder.force(x / 1.25, p), cylinder.force(x, p), rtol=1e-12)
    with pytest.raises(InvalidInput, match="right angle"):
        PolynomialModel.tondu_lopez(diameter, 24.0, length, name="degrees", validity=LIMITS)
