"""Closed chains as Crocoddyl's action models."""

import numpy as np
import pytest
from mechanisms import five_bar

from exo_pin.chain import action_model

crocoddyl = pytest.importorskip("crocoddyl", reason="crocoddyl is not installed")


def model_of(mechanism, joints, motors):
    chain = mechanism.chain()

    def costs(state, count):
        found = crocoddyl.CostModelSum(state, count)
        left = crocoddyl.ResidualModelState(state, 0.1 * np.ones(state.nx), count)
        found.addCost("state", crocoddyl.CostModelResidual(state, left), 2.0)
        found.addCost("effort", crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state, count)), 0.5)
        return found

    return action_model(chain, chain.close(mechanism.q), joints, motors, costs)


CRANKS = ("left_crank_hinge", "right_crank_hinge")


@pytest.mark.parametrize("motors", [CRANKS, CRANKS[:1]])
def test_derivatives_of_motion_and_cost_are_differences(motors):
    model, rng = model_of(five_bar(), CRANKS, motors), np.random.default_rng(0)
    x = np.concatenate([model.start[[0, 2]] + 0.1, rng.normal(size=2)])
    u, data = rng.normal(size=len(motors)), model.createData()
    model.calc(data, x, u)
    model.calcDiff(data, x, u)
    step = 1e-5

    def at(x, u):
        other = model.createData()
        model.calc(other, x, u)
        return np.append(other.xout, other.cost)

    by_x = np.array([(at(x + step * e, u) - at(x - step * e, u)) / (2 * step) for e in np.eye(4)]).T
    by_u = np.array([(at(x, u + step * e) - at(x, u - step * e)) / (2 * step) for e in np.eye(len(u))]).T
    np.testing.assert_allclose(np.vstack([data.Fx, data.Lx]), by_x, rtol=0, atol=1e-6 * np.abs(by_x).max())
    np.testing.assert_allclose(
        np.vstack([np.reshape(data.Fu, (2, -1)), data.Lu]), by_u, rtol=0, atol=1e-6 * np.abs(by_u).max()
    )


@pytest.mark.full
def test_an_arm_of_four_bars_swings_up_though_its_motor_cannot_lift_it():
    import swing_up

    model, states, efforts, goal, done = swing_up.swing_up()
    assert done
    np.testing.assert_allclose(states[-1], goal, atol=1e-3)
    level = model.chain.inverse_dynamics(model.configuration([0.0]), actuated=swing_up.MOTOR).tau[0]
    assert np.abs(efforts).max() <= swing_up.TORQUE < 0.5 * abs(level)
    # The same motion by the chain itself: no loop opens, and semi-implicit steps of its own forward dynamics.
    q = model.start
    for x, after, u in zip(states, states[1:], efforts, strict=False):
        q = model.configuration(x[:1], q)
        v = model.chain.reduced_jacobian(q, swing_up.MOTOR) @ x[1:]
        speed = x[1:] + swing_up.STEP * model.chain.forward_dynamics(q, v, {"crank": u}).a[:1]
        np.testing.assert_allclose(after, [*(x[:1] + swing_up.STEP * speed), *speed], atol=1e-6)
        assert np.abs(model.chain.residual(q)).max() < 1e-9
