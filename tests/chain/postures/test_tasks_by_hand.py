"""Tasks and restarts on a rod whose answers are known by hand, and stacks that print."""

import numpy as np
import pinocchio as pin
import pytest
from rubbing_chains import slide

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closures, ComTask, FrameTask, PostureTask

pytestmark = pytest.mark.usefixtures("plain")

LENGTH = 0.5


def rod(low=-2.5, high=2.5, mass=2.0):
    """On a hinge about y, along x at zero: it points to (cos, 0, -sin)."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "hinge")
    if mass:
        model.appendBodyToJoint(1, pin.Inertia(mass, np.array([LENGTH, 0.0, 0.0]), np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", 1, 0, pin.SE3(np.eye(3), np.array([LENGTH, 0.0, 0.0])), pin.FrameType.BODY))
    model.lowerPositionLimit, model.upperPositionLimit = np.array([low]), np.array([high])
    return ClosedChain(model, Closures("rod"))


def at(angle):
    return LENGTH * np.array([np.cos(angle), 0.0, -np.sin(angle)])


@pytest.mark.parametrize("start", [-2.0, 2.0])
def test_restarts_find_the_side_of_the_limits_that_is_nearer(start):
    """The target is half a radian beyond the upper limit, and 0.78 beyond the lower one."""
    chain = rod()
    near = chain.inverse_kinematics(ComTask(at(3.0)), [start])
    assert near.q[0] == pytest.approx(np.sign(start) * 2.5, abs=1e-9)
    assert near.error == pytest.approx(2 * LENGTH * np.sin(0.5 * (0.5 if start > 0 else 2 * np.pi - 5.5)))
    assert near.at_limits == ("hinge",)
    assert not near.reached
    best = chain.inverse_kinematics(ComTask(at(3.0)), [start], restarts=6)
    assert best.q[0] == pytest.approx(2.5, abs=1e-9)
    assert best.error <= near.error
    # Nothing is tried again where the task is reached.
    exact = chain.inverse_kinematics(ComTask(at(1.0)), [start], restarts=6)
    assert exact.q[0] == pytest.approx(1.0, abs=1e-9)
    assert exact.reached
    with pytest.raises(InvalidInput, match="restarts"):
        chain.inverse_kinematics(ComTask(at(1.0)), [start], restarts=-1)


@pytest.mark.parametrize("task", ["com", "position", "orientation", "posture"])
def test_errors_and_their_jacobians_are_differences(task):
    chain = rod()
    goal = pin.SE3(pin.exp3(np.array([0.3, -0.4, 0.8])), np.array([0.2, -0.1, 0.5]))
    made = {
        "com": ComTask([0.1, 0.2, 0.3], [1.0, 0.0, 2.0]),
        "position": FrameTask("tip", goal, 3.0, 0.0),
        "orientation": FrameTask("tip", goal, 0.0, [1.0, 2.0, 0.0]),
        "posture": PostureTask({"hinge": 0.7}, 4.0),
    }[task]
    state, q, h = chain._state, np.array([0.4]), 1e-6
    costs = {"com": [1, 0, 2], "position": [3, 3, 3, 0, 0, 0], "orientation": [0, 0, 0, 1, 2, 0], "posture": [4]}[task]
    np.testing.assert_array_equal(made.costs(state), costs)
    error, J = made.linearised(state, q)
    ends = [made.linearised(state, q + s * h)[0] for s in (1, -1)]
    np.testing.assert_allclose(J[:, 0], (ends[0] - ends[1]) / (2 * h), atol=1e-8)
    place = at(0.4)
    expected = {"com": place - [0.1, 0.2, 0.3], "posture": [0.4 - 0.7]}
    if task in expected:
        np.testing.assert_allclose(error, expected[task], atol=1e-15)
    else:
        np.testing.assert_allclose(error[:3], goal.rotation.T @ (place - goal.translation), atol=1e-15)
        turned = goal.rotation @ pin.exp3(error[3:])
        np.testing.assert_allclose(turned, pin.exp3(np.array([0.0, 0.4, 0.0])), atol=1e-14)


def test_two_tasks_share_a_joint_by_the_squares_of_their_costs():
    chain = rod()
    both = [PostureTask({"hinge": 1.0}, 2.0), PostureTask({"hinge": -0.5}, 1.0)]
    found = chain.inverse_kinematics(both, [0.2])
    mean = (4.0 * 1.0 + 1.0 * -0.5) / 5.0
    assert found.q[0] == pytest.approx(mean, abs=1e-9)
    assert found.error == pytest.approx(np.hypot(2.0 * (mean - 1.0), mean + 0.5))
    np.testing.assert_allclose(np.concatenate(found.errors), [mean - 1.0, mean + 0.5], atol=1e-9)
    for cost in (-1.0, [1.0, -1.0, 0.0], np.nan):
        with pytest.raises(InvalidInput):
            ComTask([0.0, 0.0, 0.0], cost)
    with pytest.raises(InvalidInput, match="no mass"):
        rod(mass=0.0).inverse_kinematics(ComTask([0.0, 0.0, 0.0]), [0.0])
    with pytest.raises(InvalidInput, match="costs of the tasks are zero"):
        chain.inverse_kinematics(PostureTask({"hinge": 1.0}, 0.0), [0.0])


def test_a_rod_comes_to_rest_below_its_hinge_with_its_energy():
    chain = rod(-np.inf, np.inf)
    found = chain.equilibrium([0.3])
    assert found.q[0] == pytest.approx(np.pi / 2, abs=1e-9)
    assert found.energy == pytest.approx(-2.0 * 9.81 * LENGTH)
    assert found.curvature == pytest.approx(1.0, rel=1e-6)
    assert str(found).startswith("stable equilibrium")
    held = chain.equilibrium([0.3], hold=["hinge"])
    assert held.q[0] == 0.3
    np.testing.assert_allclose(held.forces.tau, -2.0 * 9.81 * LENGTH * np.cos(0.3))


def test_a_tree_has_no_dependent_coordinates():
    chain = rod()
    split = chain.split([0.2])
    assert (split.independent.tolist(), split.dependent.tolist(), split.condition) == ([0], [], 1.0)
    np.testing.assert_array_equal(chain.reduced_jacobian([0.2]), [[1.0]])


def test_a_stack_of_reactions_prints_least_and_greatest():
    chain = slide(0.0)
    found = chain.inverse_dynamics(np.zeros((2, 1)), a=np.array([[1.0], [-3.0]]), actuated=["slide"])
    text = str(found.joint_reaction("slide"))
    assert "2 samples: least, greatest" in text
    lines = {line.split()[0]: line.split()[1:] for line in text.splitlines()[1:]}
    assert lines["F_x"] == ["-6.000000", "2.000000", "N", "unique"]
    assert lines["F_z"] == ["19.620000", "19.620000", "N", "unique"]
    assert lines["M_y"] == ["0.000000", "0.000000", "N", "m", "unique"]
    assert "effort" not in str(found)
