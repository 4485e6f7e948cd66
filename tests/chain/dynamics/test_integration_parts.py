"""Parts of the integration alone: rates, jumps of the energy, steps that become too small, and instants of events."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar
from rubbing_chains import slide

from exo_pin import LoopNotClosed, SimulationStopped
from exo_pin.chain import ClosedChain, Closures, JointProperties
from exo_pin.chain.dynamics.integration import Instant, Rates, energies_of, instant_of, refuse_jump, taken
from exo_pin.chain.dynamics.nonsmooth.event_integration import EventIntegration
from exo_pin.chain.dynamics.nonsmooth.settling import StopRules
from exo_pin.chain.kinematics import closing
from exo_pin.chain.kinematics.closing_steps import Attempt

pytestmark = pytest.mark.usefixtures("plain")

MASS = 2.0


def at(q=0.0, v=0.0, work=0.0, dissipated=0.0):
    return Instant(np.array([q]), np.array([v]), work, dissipated)


def refuses(state, before, after, tolerances, shift=0.0):
    try:
        refuse_jump(state, before, after, 3.0, np.array([shift]), tolerances)
    except SimulationStopped:
        return True
    return False


def test_a_jump_is_a_ten_thousandth_of_the_kinetic_energy():
    """A block of 2 kg on a level slide has v² joules, and gets what work and dissipation do not explain."""
    state = slide(0.0)._state
    for before, after in ((1.0, 3.0), (3.0, 1.0), (2.0, 2.0)):
        most, done = 1e-4 * max(before, after) ** 2, after**2 - before**2
        for share, refused in ((0.99, False), (1.01, True), (-0.99, False), (-1.01, True)):
            old = at(0.1, before, 2.0, 5.0)
            assert refuses(state, old, at(0.4, after, 2.0 + done + share * most, 5.0), (0.0, 0.0)) == refused
            assert refuses(state, old, at(0.4, after, 2.0 + done, 5.0 + share * most), (0.0, 0.0)) == refused
            assert refuses(state, old, at(0.4, after, 3.0 + done, 6.0 + share * most), (0.0, 0.0)) == refused


def test_tolerances_explain_ten_times_what_they_allow():
    state, weight = slide(np.pi / 2)._state, MASS * 9.81
    # At rest: of the height, and of the work twice the absolute one; speeds within it have its square.
    rtol, atol, shift = 1e-3, 1e-6, 0.5
    explained = weight * (atol + 1e-12 + rtol * shift) + atol**2 + 2.0 * atol
    for share, refused in ((0.999, False), (1.001, True)):
        for way in (1.0, -1.0):
            after = at(way * 10.0 * explained * share / weight)
            assert refuses(state, at(), after, (rtol, atol), way * shift) == refused
    # In motion: of the speed, 2 √(T T') with T' of its tolerance.
    level, rtol, atol, v = slide(0.0)._state, 1e-6, 1e-5, 2.0
    stray = (atol + rtol * v) ** 2
    most = 1e-4 * v**2 + 10.0 * (stray + 2.0 * np.sqrt(v**2 * stray) + 2.0 * atol)
    for share, refused in ((0.999, False), (1.001, True)):
        assert refuses(level, at(0.0, v), at(0.0, v, share * most), (rtol, atol)) == refused
    # Of what is exchanged, its share.
    for work, dissipated in ((7.0, 7.0), (-7.0, 7.0)):
        jump = work - dissipated
        most = 10.0 * 1e-3 * (abs(work) + dissipated)
        for share, refused in ((0.999, False), (1.001, True)):
            end = at(0.0, 0.0, work, dissipated)
            begin = at(0.0, 0.0, jump + share * most, 0.0)
            assert refuses(level, begin, end, (1e-3, 0.0)) == refused


def test_springs_explain_jumps_as_weight_does():
    chain = slide(0.0)
    description = chain.description.__class__(
        **(vars(chain.description) | {"joints": (JointProperties("slide", 50.0),)})
    )
    state = ClosedChain(chain.model, description)._state
    assert energies_of(state, at(0.2, 3.0)) == pytest.approx((0.5 * 50.0 * 0.04 + 9.0, 9.0))
    q, atol = 0.2, 1e-6
    explained = 50.0 * q * (atol + 1e-12) + atol**2 + 2.0 * atol
    for share, refused in ((0.999, False), (1.001, True)):
        assert refuses(state, at(q, work=-10.0 * explained * share), at(q), (0.0, atol)) == refused


def solver(status="running", size=1e-3, message=None):
    return SimpleNamespace(t=0.5, status=status, step_size=size, step=lambda: message)


def test_more_than_eight_steps_below_a_nanosecond_end_an_integration():
    instant = at()
    assert taken(solver(), instant, 5) == 0
    assert taken(solver(size=1.01e-9), instant, 5) == 0
    assert taken(solver(size=0.99e-9), instant, 0) == 1
    assert taken(solver(size=0.99e-9), instant, 7) == 8
    with pytest.raises(SimulationStopped, match=r"below 1e-09 s.*singular"):
        taken(solver(size=0.99e-9), instant, 8)
    with pytest.raises(SimulationStopped, match="too small") as stopped:
        taken(solver("failed", message="too small"), instant, 0)
    assert stopped.value.time == 0.5


def test_rates_are_speed_acceleration_power_and_loss():
    chain = slide(0.3)
    chain.model.damping = np.array([4.0])
    chain = ClosedChain(chain.model, chain.description)
    rates = Rates(
        chain._state,
        lambda t, q, v: np.array([7.0 + t]),
        lambda t, q, v: {"block": np.array([3.0, 0.0, 5.0, 0.0, 0.0, 0.0]) * (1.0 + q[0])},
        base=np.array([0.5]),
    )
    v, push = 1.5, (3.0 * np.cos(0.3) + 5.0 * np.sin(0.3)) * 1.7
    found = rates(2.0, np.array([0.2, v, 0.0, 0.0]))
    force = 9.0 + push - MASS * 9.81 * np.sin(0.3) - 4.0 * v
    np.testing.assert_allclose(found, [v, force / MASS, (9.0 + push) * v, 4.0 * v**2], rtol=1e-12)
    y = np.array([0.2, v, 11.0, 12.0])
    instant = instant_of(rates, y)
    np.testing.assert_allclose([*instant.q, *instant.v, instant.work, instant.dissipated], [0.7, v, 11.0, 12.0])


def test_rates_of_a_turn_are_those_of_its_displacement():
    """q = base ⊕ ξ with a constant v: ξ' is the rate of the rotation vector."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    state = ClosedChain(model, Closures("ball"))._state
    rates = Rates(state, None, None, base=pin.neutral(model))
    shift, v, h = np.array([0.4, -0.8, 0.3]), np.array([0.5, 0.2, -0.7]), 1e-6
    found = rates(0.0, np.concatenate([shift, v, [0.0, 0.0]]))[:3]
    q = pin.integrate(model, rates.base, shift)
    ends = [pin.difference(model, rates.base, pin.integrate(model, q, s * h * v)) for s in (1, -1)]
    np.testing.assert_allclose(found, (ends[0] - ends[1]) / (2 * h), atol=1e-8)


def test_sixty_changes_within_a_microsecond_are_enough():
    rates = Rates(slide(0.0)._state, None, None, base=np.array([1.0]))
    own = EventIntegration(rates, StopRules(None, 0.0))
    own._refuse_crowd([0.0] * 60, 1.0, at())
    with pytest.raises(SimulationStopped, match="more than 60 changes"):
        own._refuse_crowd([0.0] * 61, 1.0, at())


def test_a_motion_whose_loops_do_not_close_from_there_begins_nowhere_else(monkeypatch):
    named, tries = four_bar(), []

    def stuck(state, q, *more):
        tries.append(q)
        return Attempt(np.array(q), 1.0, 3, False, True)

    monkeypatch.setattr(closing, "attempt", stuck)
    rates = Rates(named.chain()._state, np.zeros(3), None, base=named.q)
    with pytest.raises(LoopNotClosed):
        instant_of(rates, np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    np.testing.assert_array_equal(tries, [named.q + np.array([0.1, 0.0, 0.0])])
