"""The step of the quadratic model of a posture's objective, by hand and by SciPy, and what else a search tries."""

import numpy as np
import pinocchio as pin
import pytest
import scipy
from posture_functions import INF, NONE, Function, circle, problem

from exo_pin import LoopNotClosed
from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.postures.constrained_minimum import (
    STATIONARY,
    _falls,
    _free_curvature,
    _moved,
    _Point,
    _point,
    _step,
    _Stops,
)
from exo_pin.chain.postures.inverse_kinematics import _random_postures
from exo_pin.chain.postures.posture_problem import PostureProblem

pytestmark = pytest.mark.usefixtures("plain")


def made(values, slope, room=(), rows=None, scale=1.0, kkt=1.0):
    """A point with a diagonal matrix."""
    n = len(values)
    rows = np.zeros((0, n)) if rows is None else np.array(rows, dtype=float)
    stops = _Stops(rows, np.array(room, dtype=float), np.zeros(len(rows), dtype=int), np.ones(len(rows)))
    slope, matrix = np.array(slope, dtype=float), np.diag(np.array(values, dtype=float))
    return _Point(0.0, np.eye(n), slope * scale, matrix * scale, stops, kkt, scale)


@pytest.mark.parametrize("scale", [1.0, 7.0])
def test_steps_of_the_model_by_hand(scale):
    # Newton's, in full and cut to the radius.
    np.testing.assert_allclose(_step(made([2.0, 4.0], [0.1, -0.4], scale=scale), 1.0), [-0.05, 0.1])
    np.testing.assert_allclose(_step(made([2.0, 4.0], [1.0, -4.0], scale=scale), 0.2), [-0.1, 0.2])
    # Against the slope also where the curvature is negative.
    np.testing.assert_allclose(_step(made([-2.0, 4.0], [0.1, 0.0], scale=scale), 1.0), [-0.05, 0.0])
    # Curvatures below a ten-millionth of the largest count as that: slopes that are not rounding.
    np.testing.assert_allclose(_step(made([1.0, 0.0], [1e-3, 1e-9], scale=scale), 1.0), [-1e-3, -1e-2])
    # Those that are rounding against the others make no step.
    np.testing.assert_allclose(_step(made([1.0, 0.0], [1e-3, 0.9e-10], scale=scale), 1.0), [-1e-3, 0.0])
    np.testing.assert_allclose(_step(made([1.0, 0.0], [1e-3, 1.2e-10], scale=scale), 1.0), [-1e-3, -1.2e-3])
    np.testing.assert_allclose(_step(made([1.0, 0.0], [0.0, 0.9e-13], scale=scale), 1.0), [0.0, 0.0])
    np.testing.assert_allclose(_step(made([1.0, 0.0], [0.0, 1.2e-13], scale=scale), 1.0), [0.0, -1.2e-6])
    # Where all curvatures are small, they count against a thousandth of the scale.
    np.testing.assert_allclose(_step(made([0.9e-10, 1e-12], [1e-11, 0.0], scale=scale), 1.0), [-0.1, 0.0])


def test_a_saddle_gets_a_slope_only_where_all_others_are_balanced():
    step = _step(made([-2.0, 4.0], [0.0, 0.0], kkt=0.0), 0.1)
    np.testing.assert_allclose(np.abs(step), [1e-4, 0.0])
    np.testing.assert_array_equal(_step(made([-2.0, 4.0], [0.0, 0.0], kkt=2 * STATIONARY), 0.1), 0.0)
    np.testing.assert_array_equal(_step(made([-0.9e-7, 1.0], [0.0, 0.0], kkt=0.0), 0.1), 0.0)
    # A slope that is there already is taken as it is.
    np.testing.assert_allclose(_step(made([-2.0, 4.0], [3e-4, 0.0], kkt=0.0), 0.1), [-1.5e-4, 0.0])
    assert _falls(made([-2.0, 4.0], [0.0, 0.0]))
    assert _falls(made([-2e-7, 1.0], [0.0, 0.0]))
    assert not _falls(made([-0.5e-7, 1.0], [0.0, 0.0]))
    assert not _falls(made([-0.5e-6, 10.0], [0.0, 0.0], scale=3.0))
    np.testing.assert_allclose(_free_curvature(made([-2.0, 4.0], [0.0, 0.0], scale=7.0))[0], [-2.0, 4.0])
    assert not _falls(made([2.0, 4.0], [0.0, 0.0]))
    # A limit that is reached stops the falling way.
    assert not _falls(made([-2.0, 4.0], [0.0, 0.0], [0.0], [[1.0, 0.0]]))
    assert _falls(made([-2.0, 4.0], [0.0, 0.0], [1e-3], [[1.0, 0.0]]))


@pytest.mark.parametrize("seed", range(8))
def test_steps_within_limits_are_the_best_of_the_model_that_scipy_finds(seed):
    rng = np.random.default_rng(seed)
    values, slope = rng.uniform(1.0, 4.0, 3) * np.array([1.0, -1.0, 1.0]), rng.normal(size=3)
    rows, room, radius = rng.normal(size=(4, 3)), rng.uniform(0.0, 0.3, 4), 0.4
    y = _step(made(values, slope, room, rows), radius)
    assert np.abs(y).max() <= radius + 1e-9
    assert (rows @ y <= room + 1e-9).all()
    # Newton's step, cut to the radius, where it keeps the limits.
    newton = -slope / np.abs(values)
    newton *= min(1.0, radius / np.abs(newton).max())
    if (rows @ newton <= room).all():
        np.testing.assert_allclose(y, newton)
        return
    best = scipy.optimize.minimize(
        lambda z: slope @ z + 0.5 * np.abs(values) @ z**2,
        np.zeros(3),
        jac=lambda z: slope + np.abs(values) * z,
        method="SLSQP",
        bounds=[(-radius, radius)] * 3,
        constraints={"type": "ineq", "fun": lambda z: room - rows @ z},
        options={"ftol": 1e-15, "maxiter": 200},
    )
    assert best.success
    model = slope @ y + 0.5 * np.abs(values) @ y**2
    assert model <= best.fun + 1e-8
    # A step that keeps all limits anyway is not cut.
    wide = _step(made(values, slope, room + 10.0, rows), 10.0)
    np.testing.assert_allclose(wide, -slope / np.abs(values))


def test_closing_that_fails_with_a_stopped_joint_is_tried_without_and_else_is_no_step():
    """Closing with the joint held at the limit that the step reaches comes first, then that without."""
    state = circle()
    data = problem(Function(lambda q: float(q[1]), lambda q: np.array([0.0, 1.0])), state)
    calls = []

    class Refusing:
        def __init__(self, count):
            self.left, self.state, self.limits, self.held, self.objective = count, state, None, NONE, data.objective

        def closed(self, q, held, restarts=0):
            calls.append(held.tolist())
            self.left -= 1
            if self.left >= 0:
                raise LoopNotClosed(q, 1.0, 1)
            return q

    point = _point(data, np.array([0.5, 0.0]))
    stops = _Stops(np.eye(1), np.array([0.1]), np.array([1]), np.ones(1))
    point = point._replace(stops=stops)
    for y, refusals, held, moves in (
        (0.1, 0, [[1]], True),
        (0.1, 1, [[1], []], True),
        (0.1, 2, [[1], []], False),
        (0.1 - 2e-9, 0, [[]], True),
        (0.1 - 0.5e-9, 0, [[1]], True),
        (0.05, 1, [[]], False),
    ):
        calls.clear()
        found = _moved(Refusing(refusals), np.array([0.5, 0.0]), point, np.array([y]))
        assert calls == held
        assert (found is not None) == moves
        if moves:
            np.testing.assert_allclose(found, np.array([0.5, 0.0]) + point.motions[:, 0] * y)


def test_random_postures_are_within_limits_or_half_a_turn_and_a_length():
    model = pin.Model()
    kinds = (pin.JointModelPX(), pin.JointModelRY(), pin.JointModelPZ(), pin.JointModelRX())
    for k, joint in enumerate(kinds):
        model.addJoint(k, joint, pin.SE3(np.eye(3), np.array([0.0, 0.3, 0.0])), f"j{k}")
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    model.lowerPositionLimit = np.array([-INF, -INF, 2.0, -4.0])
    model.upperPositionLimit = np.array([INF, 1.0, 2.5, -3.5])
    state = ClosedChain(model, Closures("four"))._state
    length, q = state.topology.length, np.array([1.0, 0.5, 9.0, 9.0])
    given = PostureProblem(state, None, NONE, None, 1e-12)
    places = np.array(list(_random_postures(given, q, 400)))
    assert places.shape == (400, 4)
    low, high = places.min(axis=0), places.max(axis=0)
    ends = np.array([[1.0 - length, 0.5 - np.pi, 2.0, -4.0], [1.0 + length, 0.5 + np.pi, 2.5, -3.5]])
    assert (low >= ends[0]).all()
    assert (high <= ends[1]).all()
    assert (high - low >= 0.95 * (ends[1] - ends[0])).all()
    held = np.array(list(_random_postures(given._replace(held=np.array([0, 2])), q, 5)))
    np.testing.assert_array_equal(held[:, [0, 2]], np.tile(q[[0, 2]], (5, 1)))
    assert (held[:, 3] < -3.4).all()
