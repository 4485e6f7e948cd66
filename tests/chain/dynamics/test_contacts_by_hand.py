"""Stops and friction of slides: which are active, to the edge of what counts, and what they push."""

import numpy as np
import pytest
from rubbing_chains import slide

from exo_pin import InvalidInput
from exo_pin.chain.dynamics.equations.equations_of_motion import moving_loops
from exo_pin.chain.dynamics.nonsmooth.contact_forces import AT_STOP, contact_forces, contacts_at, stops_at
from exo_pin.chain.dynamics.nonsmooth.joint_friction import REST
from exo_pin.chain.dynamics.nonsmooth.projected_motion import Applied, projected_motion
from exo_pin.chain.structure.motion_axes import limits_of

pytestmark = pytest.mark.usefixtures("plain")

LIMITS = (-1.0, 2.0)
WEIGHT = 2.0 * 9.81


def block(angle=np.pi / 2, friction=0.0):
    return slide(angle, friction, limits=LIMITS)._state


@pytest.mark.parametrize(
    ("q", "side"),
    [
        (-1.0, 1), (2.0, -1), (0.5, 0), (-1.0 + 0.9 * AT_STOP, 1), (-1.0 - 0.9 * AT_STOP, 1), (-1.0 + 1.1 * AT_STOP, 0),
        (2.0 - 0.9 * AT_STOP, -1), (2.0 + 0.9 * AT_STOP, -1), (2.0 - 1.1 * AT_STOP, 0),
    ],
)  # fmt: skip
def test_stops_are_active_within_a_share_of_the_length(q, side):
    state = block()
    assert state.topology.length == 1.0
    index, found = stops_at(state, limits_of(state.model), np.array([q]))
    assert (index.tolist(), found.tolist()) == (([0], [side]) if side else ([], []))


@pytest.mark.parametrize("q", [-1.0 - 1.1 * AT_STOP, 2.0 + 1.1 * AT_STOP])
def test_a_joint_beyond_its_stop_is_refused(q):
    state = block()
    with pytest.raises(InvalidInput, match=r"'slide' is at .* beyond its limits -1 and 2"):
        stops_at(state, limits_of(state.model), np.array([q]))


@pytest.mark.parametrize(
    ("q", "speed", "active"),
    [(-1.0, 0.0, 1), (-1.0, 0.9, 1), (-1.0, 1.1, 0), (-1.0, -0.9, 1), (2.0, -0.9, 1), (2.0, -1.1, 0), (2.0, 0.9, 1)],
)
def test_a_joint_that_leaves_its_stop_has_no_contact(q, speed, active):
    _, found = contacts_at(block(), np.array([q]), np.array([speed * REST]), True)
    assert len(found.place) == active
    if active:
        assert found.side.tolist() == [1 if q < 0 else -1]
        assert (found.low[0], found.high[0]) == ((0.0, np.inf) if q < 0 else (-np.inf, 0.0))
    assert len(contacts_at(block(), np.array([q]), np.array([speed * REST]), False)[1].place) == 0


@pytest.mark.parametrize(("q", "speed"), [(-1.0, -1.1), (2.0, 1.1)])
def test_a_joint_that_moves_into_its_stop_is_refused(q, speed):
    with pytest.raises(InvalidInput, match="coordinate 0 of v moves into its stop"):
        contacts_at(block(), np.array([q]), np.array([speed * REST]), True)


def solved(q, effort, friction=0.0):
    state = block(friction=friction)
    q, v = np.array([q]), np.zeros(1)
    rubbing, contacts = contacts_at(state, q, v, True)
    moving_loops(state, q, v)
    motion = projected_motion(state, q, v, Applied(np.array([effort]), None).plus(rubbing.force))
    return contacts, contact_forces(state, motion, contacts, rubbing.force)


@pytest.mark.parametrize(
    ("q", "effort", "stop", "a"),
    [
        (-1.0, 0.0, WEIGHT, 0.0), (-1.0, 5.0, WEIGHT - 5.0, 0.0), (-1.0, WEIGHT + 6.0, 0.0, 3.0),
        (2.0, 0.0, 0.0, -9.81), (2.0, WEIGHT + 6.0, -6.0, 0.0),
    ],
)  # fmt: skip
def test_a_stop_pushes_what_keeps_the_block_and_lets_it_go(q, effort, stop, a):
    contacts, found = solved(q, effort)
    np.testing.assert_allclose(found.stops, [stop], atol=1e-12)
    np.testing.assert_allclose(found.a, [a], atol=1e-12)
    assert found.sticks.tolist() == [a == 0.0]
    assert found.friction.tolist() == [0.0]
    assert found.unique.tolist() == [True]
    assert contacts.pairs == {(0, 1 if q < 0 else -1)}


@pytest.mark.parametrize(
    ("effort", "friction", "a"),
    [(WEIGHT, 0.0, 0.0), (WEIGHT + 3.0, -3.0, 0.0), (WEIGHT + 6.0, -4.0, 1.0), (WEIGHT - 6.0, 4.0, -1.0)],
)
def test_friction_at_rest_is_what_is_needed_up_to_its_limit(effort, friction, a):
    _, found = solved(0.0, effort, 4.0)
    np.testing.assert_allclose(found.friction, [friction], atol=1e-12)
    np.testing.assert_allclose(found.a, [a], atol=1e-12)
    assert found.stops.tolist() == [0.0]
    assert found.sticks.tolist() == [a == 0.0]


def test_friction_and_a_stop_that_share_a_weight_are_not_unique():
    contacts, found = solved(-1.0, 0.0, 4.0)
    assert contacts.pairs == {(0, 0), (0, 1)}
    assert found.unique.tolist() == [False]
    np.testing.assert_allclose(found.friction + found.stops, [WEIGHT])
    assert abs(found.friction[0]) <= 4.0
    only = contacts.only(contacts.side == 1)
    assert (only.place.tolist(), only.low.tolist(), only.high.tolist()) == ([0], [0.0], [np.inf])
