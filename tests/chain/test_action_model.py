"""Closed chains as Crocoddyl's action models."""

import numpy as np
import pytest
from mechanisms import five_bar
from spatial_mechanisms import delta

from exo_pin import ExoPinError, InvalidInput, UndeterminedMotion
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


def test_the_cost_is_that_of_state_and_effort_and_at_the_end_of_the_state_alone():
    model, x, u = model_of(five_bar(), CRANKS, CRANKS), np.array([0.3, -0.2, 0.5, 0.7]), np.array([0.4, -0.6])
    x[:2] += model.start[[0, 2]]
    data, end = model.createData(), model.createData()
    model.calc(data, x, u)
    model.calc(end, x)
    of_state = np.sum((x - 0.1) ** 2)  # half of the weight of 2
    assert data.cost == pytest.approx(of_state + 0.25 * np.sum(u**2))
    assert end.cost == pytest.approx(of_state)
    model.calcDiff(end, x)
    np.testing.assert_allclose(end.Lx, 2.0 * (x - 0.1))
    assert np.isfinite(end.xout).all()
    assert np.isfinite(end.Fx).all()
    # And it moves as the chain does.
    q = model.configuration(x[:2])
    v, _ = model.chain.dependent_motion(q, CRANKS, x[2:])
    there = model.chain.forward_dynamics(q, v, dict(zip(CRANKS, u, strict=True))).a
    np.testing.assert_allclose(data.xout, there[[0, 2]], rtol=1e-9)


def test_it_starts_with_its_joints_where_they_are_given_and_they_have_to_lead():
    chain, q = five_bar().chain(), five_bar().q.copy()
    q[[0, 2]] += [0.2, -0.1]
    model = action_model(chain, q, CRANKS, CRANKS, lambda state, count: crocoddyl.CostModelSum(state, count))
    np.testing.assert_allclose(model.start[[0, 2]], q[[0, 2]], atol=1e-12)
    for leading in (CRANKS[:1], CRANKS[:1] * 2):
        with pytest.raises(UndeterminedMotion):
            action_model(chain, q, leading, CRANKS, None)
    flying = delta()
    with pytest.raises(InvalidInput, match="joints of one coordinate to lead, got flight"):
        action_model(flying.chain(), flying.q, ["flight"], ["flight"], None)


def test_where_the_loops_do_not_close_it_answers_nan():
    model = model_of(five_bar(), CRANKS, CRANKS)
    far, u = np.concatenate([model.start[[0, 2]] + [0.75, -1.5], np.zeros(2)]), np.zeros(2)
    with pytest.raises(ExoPinError):
        model.configuration(far[:2])
    data = model.createData()
    model.calc(data, far, u)
    model.calcDiff(data, far, u)
    assert np.isnan(data.xout).all()
    assert np.isnan(data.Fx).all()
    assert np.isnan(data.Fu).all()


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
