"""What the functions of a chain count in characteristic lengths is the same in any units."""

from types import SimpleNamespace

import numpy as np
import pytest
from mechanisms import five_bar, sliders, with_free_hinge
from other_units import Units

from exo_pin.chain import ClosedChain
from exo_pin.chain.dynamics.equations.equations_of_motion import massless_motion
from exo_pin.chain.dynamics.integration import Instant, Rates
from exo_pin.chain.dynamics.nonsmooth.contact_forces import ContactMode, contacts_of
from exo_pin.chain.dynamics.nonsmooth.event_integration import _BACK, EventIntegration
from exo_pin.chain.dynamics.nonsmooth.joint_friction import REST, friction_of
from exo_pin.chain.dynamics.nonsmooth.settling import StopRules, settled
from exo_pin.chain.kinematics.closing import NEAR as _NEAR
from exo_pin.chain.kinematics.closing import neighbours
from exo_pin.chain.kinematics.structural_rank import _opening
from exo_pin.chain.structure.motion_axes import limits_of

UNITS = [Units(2.0**6, 2.0**-4), Units(2.0**-6, 2.0**5)]
pytestmark = pytest.mark.parametrize("units", UNITS, ids=("large", "small"))
NONE = np.array([], dtype=np.int64)


def openings(chain, call):
    """Scaled openings of the loops that a call's ranks allow for."""
    seen, state = [], chain._state
    own = state.uncertainty
    state.uncertainty = lambda gap: seen.append(gap) or own(gap)
    call(chain)
    state.uncertainty = own
    return seen


@pytest.mark.parametrize("named", [sliders(0.3), five_bar()], ids=("sliders", "five_bar"))
def test_openings_are_scaled(units, named):
    chain = named.chain()
    other, motion = units.chain(chain), units.motion(chain)
    q, v = named.q + np.array([5e-11, *[0.0] * (len(named.q) - 1)]), np.zeros(len(named.q))
    independent = [str(chain.model.names[1 + int(k)]) for k in chain.split(named.q).independent]

    def calls(chain, q):
        yield lambda chain: chain.mobility(q)
        yield lambda chain: chain.project_velocity(q, v)
        yield lambda chain: chain.dependent_motion(q, independent, np.zeros(len(independent)))

    for one, found in zip(calls(chain, q), calls(other, q * motion), strict=True):
        expected = openings(chain, one)
        assert max(expected) > 1e-11
        assert max(openings(other, found)) == pytest.approx(max(expected), rel=1e-4)
    names = list(chain.model.names)[1:]
    gap = chain.inverse_dynamics(q, actuated=names).equations.gap
    assert gap > 1e-11
    assert other.inverse_dynamics(q * motion, actuated=names).equations.gap == pytest.approx(gap, rel=1e-4)


@pytest.mark.parametrize("named", [sliders(0.3), five_bar()], ids=("sliders", "five_bar"))
def test_neighbours_are_a_scaled_step_away(units, named):
    chain = units.chain(named.chain())
    state, q = chain._state, named.q * units.motion(chain)
    motions = chain.mobility(q)
    J = chain.constraint_jacobian(q) * state.topology.row_scale[:, None] * state.topology.column
    motions = np.linalg.svd(J)[2][motions.rank :].T
    found = list(neighbours(state, q, motions, np.array([], dtype=np.int64)))
    assert len(found) == 3
    for there in found:
        assert np.abs((there - q) / state.topology.column).max() == pytest.approx(_NEAR, rel=0.1)


def test_a_tolerance_of_an_opening_closes_three_times_it(units):
    named = five_bar()
    chain = units.chain(named.chain())
    q = named.q + np.array([1e-4, 0.0, 0.0, 0.0])
    gap = np.abs(chain.residual(q)).max() / chain.characteristic_length
    chain._state.buffers.linearise(q)
    assert chain.with_tolerance(_opening(chain._state))._state.contradiction == pytest.approx(3.0 * gap)


def test_the_joints_of_least_inertia_are_the_same(units):
    named = sliders(0.3)
    chain = with_free_hinge(named)
    names = massless_motion(chain._state, np.zeros(4), np.eye(4)).joints
    assert "free" not in names
    assert massless_motion(units.chain(chain)._state, np.zeros(4), np.eye(4)).joints == names


@pytest.mark.parametrize(("share", "turned"), [(0.9, False), (1.1, True)])
def test_sliding_turns_at_a_scaled_speed(units, share, turned):
    state = units.chain(sliders(0.3).chain())._state
    v = np.array([0.0, 0.0, -share * _BACK * state.topology.length])
    mode = ContactMode(state, np.zeros(3), np.array([0, 0, 1]), contacts_of(friction_of(state, v), NONE, NONE))
    step = SimpleNamespace(
        rates=Rates(state, np.zeros(3), None, base=np.zeros(3), mode=mode),
        stops=StopRules(None, 0.0),
        _state=lambda inside, time: (np.zeros(3), v),
    )
    assert EventIntegration._ends(step, None, 0.0) == turned


@pytest.mark.parametrize(("share", "held"), [(0.9, 1), (1.1, 0)])
def test_a_joint_leaves_its_stop_at_a_scaled_speed(units, share, held):
    bare = units.chain(sliders(0.3).chain())
    model = bare.model.copy()
    (index,) = bare.velocity_indices(["slide_both"])
    model.lowerPositionLimit, model.upperPositionLimit = np.full(3, -np.inf), np.full(3, np.inf)
    model.upperPositionLimit = np.where(np.arange(3) == index, 0.0, np.inf)
    chain = ClosedChain(model, bare.description)
    v, _ = chain.dependent_motion(np.zeros(3), ["slide_both"], [-share * REST * chain.characteristic_length])
    rates = Rates(chain._state, np.zeros(3), None, base=np.zeros(3))
    rules = StopRules(limits_of(chain.model), 0.0)
    _, mode, _ = settled(rates, 0.0, Instant(np.zeros(3), v, 0.0, 0.0), rules, {})
    assert len(mode.held.place) == held
