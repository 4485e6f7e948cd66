"""Terms, units and bounds of the laws, where a small slip would go unseen in a fit."""

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.muscle import LoadDependentFriction, PolynomialModel, Validity, muscle_model, muscle_models

BAR = 1e5


def test_coefficients_of_the_second_order_law_stand_at_their_powers():
    given = {"K_1": 2.0, "K_2": 3.0, "C_1": 5.0, "S_1": 7.0, "S_2": 11.0, "S_3": 13.0}
    validity = Validity(strain=(0.0, 0.4), pressure=(0.0, 5 * BAR))
    model = PolynomialModel.second_order(**given, name="mine", reference_length=0.3, validity=validity)
    x, p = 0.05, 2.5 * BAR
    bars = p / BAR
    expected = (2.0 * x**2 + 3.0 * x + 5.0) * bars + 7.0 * x**2 + 11.0 * x + 13.0
    assert model.unchecked_force(x, p) == pytest.approx(expected, rel=1e-14)
    # At rest, where every term of a length is gone, and without pressure, too.
    assert model.unchecked_force(0.0, p) == pytest.approx(5.0 * bars + 13.0, rel=1e-14)
    assert model.unchecked_force(np.zeros(2), np.zeros(2)).tolist() == [13.0, 13.0]


def test_a_kilogram_shifts_the_pressure_of_friction_by_one_bar_if_nothing_else_is_said():
    law = LoadDependentFriction.from_bar(1.0, 2.0, 3.0)
    shifted, _ = law.factors(0.01, 3.0 * BAR, 2.0)
    assert shifted == pytest.approx(1.0 * BAR)


def test_a_muscle_cannot_push_by_a_newton():
    validity = Validity(strain=(0.0, 0.3), pressure=(0.0, 4 * BAR))
    force = np.array([-1e-6, 0.0, 0.5])
    inside = validity.contains(np.full(3, 0.1), np.full(3, BAR), force)
    assert inside.tolist() == [False, True, True]


def test_one_length_beyond_the_thread_is_refused_among_good_ones():
    braided = [muscle_model(name) for name in muscle_models() if hasattr(muscle_model(name), "braid_length")]
    for model in braided:
        beyond = model.reference_length - 1.01 * model.braid_length
        with pytest.raises(InvalidInput, match="no longer than its thread"):
            model.diameter([0.0, beyond / model.scale])
    assert braided


@pytest.mark.parametrize("name", muscle_models())
def test_powers_and_slopes_of_a_scaled_law_are_those_of_its_force(name):
    model = muscle_model(name, 0.2)
    x, p = np.array([0.012, 0.031]), 3.1 * BAR
    force = model.unchecked_force(x, p)
    np.testing.assert_allclose(np.polynomial.polynomial.polyval(x, model.contraction_powers(p)), force, rtol=1e-9)
    ends = [model.unchecked_force(x + side * 1e-6, p) for side in (1, -1)]
    np.testing.assert_allclose(model.stiffness(x, p, outside="mark").data, (ends[0] - ends[1]) / 2e-6, rtol=1e-5)
    ends = [model.unchecked_force(x, p + side) for side in (10.0, -10.0)]
    np.testing.assert_allclose(model.pressure_gain(x, p, outside="mark").data, (ends[0] - ends[1]) / 20.0, rtol=1e-6)
    # The same strain, the same force.
    np.testing.assert_allclose(muscle_model(name, 0.3).unchecked_force(1.5 * x, p), force, rtol=1e-12)
