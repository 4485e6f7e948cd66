"""Equilibria on stops, and bodies that nothing carries."""

import numpy as np
import pinocchio as pin
import pytest
import scipy

from exo_pin.chain import ClosedChain

ROBOT = '<mujoco><compiler angle="radian"/><worldbody>{}</worldbody></mujoco>'
HINGE = '<joint name="{}" axis="{:.17g} {:.17g} {:.17g}" limited="true" range="{:.17g} {:.17g}"/>'
LINK = '<inertial mass="{:.17g}" pos="{:.17g} {:.17g} {:.17g}" diaginertia="0.01 0.01 0.01"/>'


def arm(seed):
    """Seven hinges of random axes and narrow limits, one after another."""
    rng = np.random.default_rng(seed)
    text, ends = "", ""
    for k in range(7):
        hinge = HINGE.format(f"j{k}", *rng.normal(size=3), -rng.uniform(0.05, 1.5), rng.uniform(0.05, 1.5))
        link = LINK.format(rng.uniform(0.2, 3.0), rng.uniform(0.05, 0.3), *rng.normal(0.0, 0.05, 2))
        text += f'<body pos="{0.3 if k else 0.0} 0 0">{hinge}{link}'
        ends += "</body>"
    return ClosedChain.from_mjcf(ROBOT.format(text + ends))


@pytest.mark.parametrize("seed", range(20, 30))
def test_an_arm_that_rests_on_stops_is_at_a_minimum_within_them(seed):
    chain = arm(seed)
    answer = chain.equilibrium()
    assert answer.cautions == ()
    assert answer.kkt < 1e-12
    model, data = chain.model, chain.model.createData()
    found = scipy.optimize.minimize(
        lambda q: pin.computePotentialEnergy(model, data, q),
        answer.q,
        jac=lambda q: np.array(pin.computeGeneralizedGravity(model, data, q)),
        method="L-BFGS-B",
        bounds=list(zip(model.lowerPositionLimit, model.upperPositionLimit, strict=True)),
        options={"ftol": 1e-15, "gtol": 1e-10},
    )
    assert found.fun > answer.energy - 1e-9
    # A joint at a stop is pushed into it, any other has no moment.
    moment = np.array(pin.computeGeneralizedGravity(model, data, answer.q))
    at_upper = np.isclose(answer.q, model.upperPositionLimit, rtol=0, atol=1e-9)
    at_lower = np.isclose(answer.q, model.lowerPositionLimit, rtol=0, atol=1e-9)
    assert answer.at_limits == tuple(f"j{k}" for k in np.flatnonzero(at_upper | at_lower))
    assert (moment[at_upper] <= 1e-9).all()
    assert (moment[at_lower] >= -1e-9).all()
    np.testing.assert_allclose(moment[~(at_upper | at_lower)], 0.0, rtol=0, atol=1e-9)


def test_a_body_that_nothing_carries_has_no_equilibrium():
    rod = '<body><joint name="pivot" axis="0 1 0"/>' + LINK.format(1.0, 0.3, 0.0, 0.0) + "</body>"
    cup = '<body pos="1 0 0"><freejoint name="cup"/>' + LINK.format(0.5, 0.0, 0.0, 0.0) + "</body>"
    chain = ClosedChain.from_mjcf(ROBOT.format(rod + cup))
    falling = chain.equilibrium()
    (text,) = falling.cautions
    assert " 1e-08: cup could still move" in text
    assert "hold what falls" in text
    assert str(falling).startswith("no equilibrium found")
    held = chain.equilibrium(hold=["cup"])
    assert held.cautions == ()
    assert str(held).startswith("stable equilibrium")
    # The rod hangs, and the cup's hand carries its weight.
    assert np.sin(held.q[0]) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(held.forces.effort("cup")[:3], [0.0, 0.0, 0.5 * 9.81], rtol=0, atol=1e-9)
