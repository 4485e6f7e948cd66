"""Baumgarte's terms pull open loops together: their acceleration by finite differences of the loops themselves."""

import numpy as np
import pinocchio as pin
import pytest
from moving_chains import moving


@pytest.mark.parametrize("name", ["3RRR", "rigid loop"])
@pytest.mark.parametrize("rate", [5.0, 40.0])
def test_gaps_are_accelerated_towards_zero_as_a_critically_damped_spring_does(name, rate):
    case = moving(name)
    chain = case.chain
    rng = np.random.default_rng(3)
    # A little open, and opening: neither q nor v fits the loops.
    q = pin.integrate(chain.model, case.q, 1e-5 * rng.normal(size=chain.model.nv))
    v = case.v + 1e-4 * rng.normal(size=chain.model.nv)
    a = chain.forward_dynamics(q, v, stabilisation=rate).a

    def gap(t):
        return chain.residual(pin.integrate(chain.model, q, t * v + 0.5 * t * t * a))

    h = 1e-4
    speed = (gap(h) - gap(-h)) / (2 * h)
    acceleration = (gap(h) - 2 * gap(0.0) + gap(-h)) / h**2
    expected = -2.0 * rate * speed - rate**2 * gap(0.0)
    scale = np.abs(expected).max()
    assert scale > 1e-4
    np.testing.assert_allclose(acceleration, expected, atol=2e-2 * scale)
