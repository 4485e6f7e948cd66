"""Which efforts are known where joints rest with dry friction."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain import ClosedChain, Closures

pytestmark = pytest.mark.usefixtures("plain")

FRICTION, MASSES = 3.0, (2.0, 1.0, 0.5)


def slides(friction):
    """Three blocks on slides upwards, each from the world."""
    model = pin.Model()
    for k, mass in enumerate(MASSES):
        joint = model.addJoint(0, pin.JointModelPZ(), pin.SE3.Identity(), f"slide_{k}")
        model.appendBodyToJoint(joint, pin.Inertia(mass, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"block_{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.upperDryFrictionLimit, model.lowerDryFrictionLimit = np.array(friction), -np.array(friction)
    return ClosedChain(model, Closures("slides"))


def test_an_effort_is_known_without_friction_and_where_friction_holds_alone():
    """The first has no friction, the second has friction and a motor, the third hangs by its friction (5 N)."""
    chain = slides([0.0, FRICTION, 6.0])
    forces = chain.inverse_dynamics(np.zeros(3), np.zeros(3), np.zeros(3), actuated=["slide_0", "slide_1"])
    weights = 9.81 * np.array(MASSES)
    np.testing.assert_array_equal(forces.effort_is_unique, [True, False, True])
    np.testing.assert_allclose(forces.effort("slide_0"), weights[0], rtol=1e-12)
    assert forces.effort("slide_2")[0] == 0.0
    assert abs(forces.effort("slide_1")[0] - weights[1]) <= FRICTION
    np.testing.assert_allclose(forces.tau + forces.friction, weights, rtol=1e-12)
    assert forces.friction[2] == pytest.approx(weights[2])


def test_all_efforts_are_known_in_motion():
    """Then friction acts at its limit, against the motion."""
    chain = slides([0.0, FRICTION, 6.0])
    forces = chain.inverse_dynamics(
        np.zeros(3), np.array([0.1, 0.1, -0.1]), np.zeros(3), actuated=list(chain.model.names)[1:]
    )
    assert forces.effort_is_unique.all()
    np.testing.assert_allclose(forces.tau, 9.81 * np.array(MASSES) + [0.0, FRICTION, -6.0], rtol=1e-12)
    np.testing.assert_allclose(forces.friction, [0.0, -FRICTION, 6.0], rtol=1e-12)
