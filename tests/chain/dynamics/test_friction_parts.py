"""Parts of dry friction and stops alone: signs and impulses, by hand and by the mass matrix."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import sliders
from rubbing_chains import with_friction

from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.dynamics.nonsmooth.contact_forces import at_rest
from exo_pin.chain.dynamics.nonsmooth.joint_friction import REST, friction_of, refuse_rest
from exo_pin.core import errors

pytestmark = pytest.mark.usefixtures("plain")


def arm(count=3):
    """Hinges about y, one below the other."""
    model = pin.Model()
    joint = 0
    for k in range(count):
        place = pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.4 if k else 0.0]))
        joint = model.addJoint(joint, pin.JointModelRY(), place, f"hinge_{k}")
        model.appendBodyToJoint(
            joint, pin.Inertia(1.0 + k, np.array([0.02, 0.0, -0.2]), 0.02 * np.eye(3)), pin.SE3.Identity()
        )
        model.addFrame(pin.Frame(f"link_{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return ClosedChain(model, Closures("arm"))


def test_friction_is_against_the_motion_or_that_to_come_or_a_range():
    chain = with_friction(arm(), [2.0, 0.0, 3.0])
    state = chain._state
    found = friction_of(state, np.array([0.5, -0.5, -1.0]))
    np.testing.assert_array_equal(found.force, [-2.0, 0.0, 3.0])
    assert found.rest.tolist() == []
    # Slower than rest: the direction to come counts; without friction nothing rests.
    still = np.array([0.5 * REST, 0.0, -0.5 * REST])
    found = friction_of(state, still)
    np.testing.assert_array_equal(found.force, 0.0)
    assert found.rest.tolist() == [0, 2]
    np.testing.assert_array_equal([found.low, found.high], [[-2.0, 0.0, -3.0], [2.0, 0.0, 3.0]])
    found = friction_of(state, still, np.array([-2.0 * REST, 1.0, 1.0]))
    np.testing.assert_array_equal(found.force, [2.0, 0.0, -3.0])
    assert found.rest.tolist() == []
    # Friction in one direction alone.
    model = chain.model.copy()
    model.upperDryFrictionLimit, model.lowerDryFrictionLimit = np.array([0.0, 4.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    one_way = ClosedChain(model, chain.description)._state
    assert friction_of(one_way, np.zeros(3)).rest.tolist() == [0, 1]
    np.testing.assert_array_equal(friction_of(one_way, np.full(3, -1.0)).force, [0.0, 4.0, 0.0])
    np.testing.assert_array_equal(friction_of(one_way, np.full(3, 1.0)).force, [-1.0, 0.0, 0.0])


@pytest.mark.parametrize("length", [0.01, 100.0])
def test_rest_counts_in_characteristic_lengths_of_a_chain_of_any_size(length):
    chain = with_friction(sliders(length).chain(), np.ones(3))
    state, unit = chain._state, chain.characteristic_length
    assert abs(np.log10(unit)) > 1.0
    speeds = np.array([0.9, 1.1, -1.1]) * REST * unit
    found = friction_of(state, speeds)
    np.testing.assert_array_equal(found.force, [0.0, -1.0, 1.0])
    assert found.rest.tolist() == [0]
    # So do the directions to come.
    still = friction_of(state, np.zeros(3), speeds)
    np.testing.assert_array_equal(still.force, found.force)
    assert still.rest.tolist() == [0]


@pytest.mark.parametrize("length", [0.01, 100.0])
@pytest.mark.parametrize("joint", ["slide_x", "slide_both"])
def test_slides_of_one_freedom_stop_together_at_any_size(length, joint):
    named = sliders(length)
    chain = named.chain()
    v, _ = chain.dependent_motion(named.q, ["slide_both"], [2.0])
    assert np.abs(v).min() > 1.0
    after = at_rest(chain._state, named.q, v, chain.velocity_indices([joint]))
    np.testing.assert_allclose(after, 0.0, atol=1e-12)


def test_what_needs_a_motion_refuses_joints_at_rest_by_name():
    state = with_friction(arm(), [2.0, 0.0, 3.0])._state
    refuse_rest(state, friction_of(state, np.ones(3)), "move them")
    with pytest.raises(errors.UnsupportedDynamics, match=r"(?s)hinge_2.*move them"):
        refuse_rest(state, friction_of(state, np.array([1.0, 0.0, 0.0])), "move them")


@pytest.mark.parametrize("index", [[0], [1], [0, 2], [0, 1, 2]])
def test_impulses_that_stop_joints_leave_the_momenta_of_the_others(index):
    chain, rng = arm(), np.random.default_rng(280)
    q, v = rng.normal(size=3), rng.normal(size=3)
    after = at_rest(chain._state, q, v, np.array(index))
    M = pin.crba(chain.model, chain.model.createData(), q)
    np.testing.assert_array_equal(after[index], 0.0)
    others = np.setdiff1d(range(3), index)
    np.testing.assert_allclose((M @ (after - v))[others], 0.0, atol=1e-12)
    assert v @ M @ v > after @ M @ after
    np.testing.assert_array_equal(at_rest(chain._state, q, after, np.array(index)), after)
    assert at_rest(chain._state, q, v, np.zeros(0, dtype=int)) is v
