"""Static models: derivatives, inverses, validity, scaling, and the law of Chou and Hannaford against virtual work."""

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.muscle import (
    ChouHannaford,
    Validity,
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
