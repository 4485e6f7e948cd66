"""Published laws by name and constants: check values, derivatives, inverses, files."""

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.muscle import ChouHannaford, FestoLaw, PolynomialModel, Validity

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
