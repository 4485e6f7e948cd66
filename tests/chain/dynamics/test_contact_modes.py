"""One mode of contact: forces of joints that stick or rest on stops, whether they hold, and impacts, by hand."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain import ClosedChain, Closure, Closures
from exo_pin.chain.dynamics.equations.equations_of_motion import moving_loops
from exo_pin.chain.dynamics.nonsmooth.contact_forces import ContactMode, Contacts, contact_forces, contacts_of, impact
from exo_pin.chain.dynamics.nonsmooth.joint_friction import friction_of
from exo_pin.chain.dynamics.nonsmooth.projected_motion import Applied, ProjectedMotion, projected_motion, response_at

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf
MASSES = (2.0, 0.5)


def blocks(friction=(0.0, 0.0), on_each_other=False):
    """Two blocks on level slides along x, each from the world or the second on the first."""
    model, joint = pin.Model(), 0
    for k, mass in enumerate(MASSES):
        parent = joint if on_each_other else 0
        joint = model.addJoint(parent, pin.JointModelPX(), pin.SE3.Identity(), f"slide_{k}")
        model.appendBodyToJoint(joint, pin.Inertia(mass, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"block_{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.upperDryFrictionLimit, model.lowerDryFrictionLimit = np.array(friction), -np.array(friction)
    return ClosedChain(model, Closures("blocks"))


def mode_of(chain, stops=(), sliding=(0.0, 0.0)):
    """All that rests, at stops given as pairs of a coordinate and its side."""
    state, pairs = chain._state, np.array(stops, dtype=np.int64).reshape(-1, 2)
    held = contacts_of(friction_of(state, np.zeros(2)), pairs[:, 0], pairs[:, 1])
    return ContactMode(state, np.array(sliding), np.zeros(2, dtype=int), held)


def pushed(*efforts):
    return Applied(np.array(efforts), None)


REST = np.zeros(2), np.zeros(2)


def test_what_sticks_bears_its_load_and_the_rest_moves():
    mode = mode_of(blocks((4.0, 0.0)), sliding=(0.0, -0.25))
    a, force = mode.acceleration(*REST, pushed(3.0, 1.0))
    assert mode.index.tolist() == [0]
    np.testing.assert_allclose(a, [0.0, 0.75 / MASSES[1]], atol=1e-12)
    np.testing.assert_allclose(force, [-3.0], rtol=1e-12)
    free, nothing = mode_of(blocks()).acceleration(*REST, pushed(3.0, 1.0))
    np.testing.assert_allclose(free, [1.5, 2.0], rtol=1e-12)
    assert nothing.shape == (0,)
    # On a block that sticks the other does not care; on one that is free both are in the way of each other.
    stacked, held = mode_of(blocks((4.0, 0.0), True)).acceleration(*REST, pushed(3.0, 1.0))
    np.testing.assert_allclose(stacked, [0.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(held, [-2.0], rtol=1e-12)


@pytest.mark.parametrize("unit", [1.0, 1e7 / 3.0])
@pytest.mark.parametrize("share", [0.0, 0.75, -1.0, 1.0 + 5e-10, 1.0 + 2e-9, -1.3])
def test_friction_holds_within_a_billionth_of_its_range(share, unit):
    mode = mode_of(blocks((4.0 * unit, 0.0)))
    assert mode.holds(*REST, pushed(4.0 * unit * share, 0.0)) == (abs(share) <= 1.0 + 1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_stops_hold_what_is_pressed_on_them(side):
    """A lower stop pushes up, so the load presses down on it; beside friction of 4 N, or alone."""
    for friction in (0.0, 4.0):
        mode = mode_of(blocks((friction, 0.0)), [(1, side)])
        assert mode.holds(*REST, pushed(0.0, -2.0 * side))
        # Nothing pushes: it has not left.
        assert mode.holds(*REST, pushed(0.0, 0.0))
        assert not mode.holds(*REST, pushed(0.0, 2.0 * side))
    # Friction at a stop: both bear what pulls off.
    same = mode_of(blocks((0.0, 4.0)), [(1, side)])
    assert same.index.tolist() == [1]
    assert same.holds(*REST, pushed(0.0, 3.9 * side))
    assert not same.holds(*REST, pushed(0.0, 4.1 * side))


@pytest.mark.parametrize("load", [0.0, 2.0, -4.9, 5.1])
def test_geared_blocks_share_a_load(load):
    """One motion and two frictions, of 4 N and 1 N: they hold what both bear, though the least forces are alike."""
    gear = Closure("gear", "coupling", "slide_0", "slide_1", polynomial=(0.0, 1.0))
    chain = ClosedChain(blocks((4.0, 1.0)).model, Closures("geared", closures=(gear,)))
    mode = mode_of(chain)
    assert mode.holds(*REST, pushed(load, 0.0)) == (abs(load) < 5.0)
    a, force = mode.acceleration(*REST, pushed(load, 0.0))
    np.testing.assert_allclose(a, 0.0, atol=1e-12)
    np.testing.assert_allclose(force, [-0.5 * load, -0.5 * load], atol=1e-9)


@pytest.mark.parametrize(("excess", "sticks"), [(2e-12, True), (1e-10, False)])
@pytest.mark.parametrize("other", [0.0, 1e-12, 3.0])
def test_what_is_pushed_by_a_hair_more_than_friction_bears_does_not_move(excess, sticks, other):
    """Rest is told by the largest push on any contact, and not by that on another one."""
    chain = blocks((4.0, 4.0))
    held = contacts_of(friction_of(chain._state, np.zeros(2)), np.zeros(0, dtype=int), np.zeros(0, dtype=int))
    motion = projected_motion_of(chain, pushed(other, 4.0 * (1.0 + excess)))
    found = contact_forces(chain._state, motion, held, np.zeros(2))
    assert found.sticks.tolist() == [True, sticks]
    np.testing.assert_allclose(found.friction, [-other, -4.0], rtol=1e-9, atol=1e-15)


def test_contacts_are_friction_at_rest_and_then_stops():
    chain = blocks((4.0, 0.0))
    held = contacts_of(friction_of(chain._state, np.zeros(2)), np.array([1, 0]), np.array([1, -1]))
    assert held.place.tolist() == [0, 1, 0]
    assert held.side.tolist() == [0, 1, -1]
    np.testing.assert_array_equal(held.low, [-4.0, 0.0, -INF])
    np.testing.assert_array_equal(held.high, [4.0, INF, 0.0])
    assert held.pairs == {(0, 0), (1, 1), (0, -1)}
    assert held.only(np.array([False, True, False])).pairs == {(1, 1)}
    assert isinstance(held.only(np.zeros(3, dtype=bool)), Contacts)


@pytest.mark.parametrize("restitution", [0.0, 0.4, 1.0])
@pytest.mark.parametrize(("side", "speed"), [(1, -3.0), (-1, 3.0), (1, 3.0), (-1, -3.0)])
def test_impacts_return_a_share_of_the_speed_into_a_stop(side, speed, restitution):
    """A lower stop returns what moves down, an upper one what moves up; the second block rides on the first."""
    chain = blocks(on_each_other=True)
    motion, v = response_at(chain._state, np.zeros(2)), np.array([speed, 0.5])
    after = impact(motion, v, (np.array([0]), np.array([side])), restitution)
    hits = side * speed < 0.0
    expected = -restitution * speed if hits else speed
    assert after[0] == pytest.approx(expected)
    # The second block keeps its speed against the world: nothing pushes it.
    assert after.sum() == pytest.approx(v.sum())


def test_responses_are_inverse_masses_in_characteristic_lengths():
    chain = blocks()
    motion = projected_motion_of(chain, pushed(1.0, 1.0))
    np.testing.assert_allclose(motion.a, [0.5, 2.0])
    np.testing.assert_allclose(motion.response @ motion.response.T, np.diag(1.0 / np.array(MASSES)), atol=1e-12)
    rows, start = motion.of(np.array([1]))
    length = chain.characteristic_length
    np.testing.assert_allclose(rows @ rows.T, 1.0 / MASSES[1] / length**2)
    np.testing.assert_allclose(start, 2.0 / length)
    still = response_at(chain._state, np.zeros(2))
    np.testing.assert_array_equal(still.a, 0.0)
    np.testing.assert_allclose(np.abs(still.response), np.abs(motion.response), atol=1e-12)


@pytest.mark.parametrize("size", [1e-5, 1.0, 1e4])
def test_a_locked_coordinate_has_no_response_and_no_acceleration_of_rounding(size):
    """The second of three is locked: its acceleration counts from a share of 1e-11 of the largest."""
    basis, column = np.array([[0.6, 0.0], [1e-10, 0.0], [0.8, 1.0]]), np.array([0.5, 0.5, 1.0])
    for share, kept in ((0.9e-11, False), (1.1e-11, True)):
        a = size * np.array([0.25, 0.5 * share, -1.0])
        motion = ProjectedMotion(a, basis, np.eye(2), np.array([1.0, 4.0]), column)
        rows, start = motion.of(np.array([1, 0, 2]))
        np.testing.assert_allclose(start, size * np.array([share if kept else 0.0, 0.5, -1.0]), rtol=1e-12)
        np.testing.assert_allclose(rows, [[0.0, 0.0], [0.6, 0.0], [0.8, 0.5]], rtol=1e-12)


def projected_motion_of(chain, applied):
    moving_loops(chain._state, *REST)
    return projected_motion(chain._state, *REST, applied)
