"""Parts of closing alone: damping, patience, restarts, limits, and the rank of open loops."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar, parallelogram

from exo_pin import BeyondLimits, LoopNotClosed
from exo_pin.chain.dynamics.nonsmooth.projected_motion import residual_of_rank
from exo_pin.chain.kinematics import closing
from exo_pin.chain.kinematics.branches import forward_kinematics
from exo_pin.chain.kinematics.closing import NOTHING_HELD, close, nearest_closed
from exo_pin.chain.kinematics.closing_steps import CLOSED_THERE, GOING, STUCK, Attempt, advance, attempt
from exo_pin.chain.kinematics.loops import closed_configuration, scaled_jacobian
from exo_pin.chain.kinematics.rank import ROUNDING, rank_tolerance
from exo_pin.chain.structure.motion_axes import limits_of

pytestmark = pytest.mark.usefixtures("plain")

OFF = np.array([0.05, -0.03, 0.02])


class Judged:
    """One call of ``advance`` for a four-bar off its closed configuration, with a memory of choice."""

    def __init__(self, count=1, memory=(1.0, 1.0, 1.0, 1.0), tolerance=1e-12, within=True, off=OFF, weight=None):
        named = four_bar()
        self.state = state = named.chain()._state
        work, top = state.buffers, state.topology
        self.trial = named.q + off
        pin.computeJointJacobians(state.model, work.data, self.trial)
        self.memory, self.q = np.array(memory, dtype=float), named.q.copy()
        self.here = np.full(3, 0.5), np.full((3, 3), 0.25)
        self.there, self.move = (np.empty(3), np.empty((3, 3))), np.full(3, np.nan)
        self.weight = top.weight.copy() if weight is None else np.array(weight)
        self.status = advance(
            work.poses, work.J, top.loops, self.trial, count, within, self.weight, tolerance, top.scales,
            self.q, self.memory, self.here, self.there, self.move,
        )  # fmt: skip
        work.linearise(self.trial)
        self.gap, self.J, self.scale = work.gap.copy(), work.jacobian.copy(), top.row_scale
        self.size, self.worst = float(np.linalg.norm(self.gap * self.scale)), float(np.abs(self.gap).max())

    def step(self, damping, gap=None, J=None):
        """The damped least step by its normal equations."""
        gap, J = self.gap if gap is None else gap, self.J if J is None else J
        A = self.scale[:, None] * J
        W = np.diag(self.weight)
        matrix = A @ W @ A.T
        matrix += damping * np.trace(matrix) / len(A) * np.eye(len(A))
        return -W @ A.T @ np.linalg.solve(matrix, self.scale * gap)


SIZE = Judged().size


def test_the_first_step_is_damped_by_a_hundredth_of_the_gap():
    one = Judged(count=0, memory=(np.nan, np.nan, np.nan, np.nan))
    assert one.status == GOING
    np.testing.assert_allclose(one.memory, [one.size, one.size, 1.0, one.worst])
    np.testing.assert_array_equal(one.q, one.trial)
    np.testing.assert_array_equal(one.here[0], one.gap)
    np.testing.assert_array_equal(one.here[1], one.J)
    np.testing.assert_allclose(one.move, one.step(1e-2 * one.size), rtol=1e-9)
    held = Judged(count=0, weight=[1.0, 0.0, 2.0])
    np.testing.assert_allclose(held.move, held.step(1e-2 * held.size), rtol=1e-9)
    assert held.move[1] == 0.0
    # Never by less than rounding needs.
    small = Judged(memory=(5.0 * SIZE, 1.0, 1e-12, 1.0))
    assert small.memory[2] == pytest.approx(3e-13)
    np.testing.assert_allclose(small.move, small.step(1e-13), rtol=1e-6)


@pytest.mark.parametrize(
    ("ratio", "factor"), [(0.24, 0.3), (0.26, 1.0), (0.74, 1.0), (0.76, 3.0), (0.99, 3.0), (1.01, 10.0), (5.0, 10.0)]
)
def test_damping_falls_after_good_steps_and_grows_after_poor_ones(ratio, factor):
    one = Judged(memory=(SIZE / ratio, 1.0, 2.0, 7.0))
    assert one.status == GOING
    assert one.memory[2] == pytest.approx(2.0 * factor)
    if ratio < 1.0:
        np.testing.assert_allclose(one.memory[[0, 1, 3]], [one.size, 1.0, one.worst])
        np.testing.assert_array_equal(one.q, one.trial)
        np.testing.assert_allclose(one.move, one.step(2e-2 * factor * one.size), rtol=1e-9)
    else:
        # The step is taken back, and another one tried from where it began.
        np.testing.assert_allclose(one.memory[[0, 1, 3]], [SIZE / ratio, 1.0, 7.0])
        assert np.abs(one.q - one.trial).max() > 0.01
        np.testing.assert_array_equal(one.here[0], 0.5)
        again = one.step(2e-2 * factor * SIZE / ratio, one.here[0], one.here[1])
        np.testing.assert_allclose(one.move, again, rtol=1e-9)


@pytest.mark.parametrize(
    ("count", "share", "status"),
    [(8, 0.79, GOING), (8, 0.81, STUCK), (16, 0.81, STUCK), (7, 0.81, GOING), (9, 0.81, GOING), (0, 2.0, GOING)],
)
def test_eight_steps_have_to_lessen_the_gap_by_a_fifth(count, share, status):
    one = Judged(count=count, memory=(2.0 * SIZE, SIZE / share, 1.0, 1.0))
    assert one.status == status
    assert one.memory[1] == pytest.approx(one.size if count in (0, 8) and status == GOING else SIZE / share)


def test_steps_are_stuck_where_damping_grows_beyond_all_or_numbers_fail():
    for damping, status in ((0.99e7 / SIZE * 1.01, GOING), (1.01e7 / SIZE * 1.01, STUCK)):
        assert Judged(memory=(SIZE / 1.01, 1.0, damping, 1.0)).status == status
    assert Judged(memory=(np.nan, 1.0, 1.0, 1.0)).status == STUCK


def test_a_trial_is_closed_within_the_tolerance_and_the_limits():
    for share, within, status in ((1.01, True, CLOSED_THERE), (0.99, True, GOING), (1.01, False, GOING)):
        one = Judged(memory=(0.5 * SIZE, 1.0, 1.0, 1.0), tolerance=share * Judged().worst, within=within)
        assert one.status == status
        # Closed is closed, though another place was nearer.
        assert (np.abs(one.q - one.trial).max() == 0.0) == (status == CLOSED_THERE)


def test_steps_run_out_or_close_after_so_many():
    named = four_bar()
    state = named.chain()._state
    weight, start = state.topology.weight, named.q + OFF
    whole = attempt(state, start, weight, 1e-12, 60, None)
    assert (whole.closed, whole.stuck) == (True, False)
    assert 3 <= whole.steps <= 6
    assert whole.residual == pytest.approx(np.abs(state.buffers.residual(whole.q)), abs=1e-15)
    enough = attempt(state, start, weight, 1e-12, whole.steps, None)
    assert enough.closed
    few = attempt(state, start, weight, 1e-12, whole.steps - 1, None)
    assert (few.closed, few.stuck, few.steps) == (False, False, whole.steps - 1)
    assert 1e-12 < few.residual < 1e-3
    assert attempt(state, named.q, weight, 1e-9, 0, None).steps == 0
    # Without a coordinate that moves.
    assert attempt(state, start, 0.0 * weight, 1e-12, 60, None).stuck


def limited(low, high):
    named = four_bar()
    chain = named.chain()
    chain.model.lowerPositionLimit, chain.model.upperPositionLimit = named.q + low, named.q + high
    return chain, named.q


def test_steps_stop_at_limits_and_the_others_go_on():
    chain, q = limited(np.array([-0.01, -3.0, -3.0]), np.array([0.01, 3.0, 3.0]))
    state = chain._state
    start = q + np.array([0.2, 0.1, 0.15])
    free = attempt(state, start, state.topology.weight, 1e-12, 60, None).q
    assert free[0] > q[0] + 0.05
    kept = attempt(state, start, state.topology.weight, 1e-12, 60, limits_of(chain.model))
    assert kept.closed
    assert kept.q[0] == pytest.approx(q[0] + 0.01, abs=1e-12)
    np.testing.assert_allclose(kept.q, chain.close(kept.q), atol=1e-11)
    # A joint that is held may be beyond its limit, but then nothing is within.
    np.testing.assert_array_equal(close(state, start, respect_limits=True)[0], kept.q[0])
    chain, q = limited(np.array([0.05, -3.0, 0.05]), np.array([0.1, -0.5, 0.1]))
    with pytest.raises(BeyondLimits) as beyond:
        close(chain._state, start, respect_limits=True, restarts=2)
    assert len(beyond.value.joints) > 0
    np.testing.assert_allclose(np.abs(chain.residual(beyond.value.q)).max(), 0.0, atol=1e-12)


@pytest.mark.parametrize("held", [[], [1]])
def test_restarts_spread_twice_as_far_each_time_up_to_a_limit(held, monkeypatch):
    named = five_bar()
    state, starts = named.chain()._state, []

    def failing(state, q, weight, tolerance, iterations, limits):
        starts.append(np.array(q))
        assert (weight == 0.0).nonzero()[0].tolist() == held
        return Attempt(np.array(q), 10.0 - len(starts), 3, False, True)

    monkeypatch.setattr(closing, "attempt", failing)
    monkeypatch.setattr(
        np.random, "default_rng", lambda seed: SimpleNamespace(uniform=lambda low, high, n: np.full(n, high))
    )
    with pytest.raises(LoopNotClosed) as failed:
        nearest_closed(state, named.q, np.array(held, dtype=int), 1e-12, 60, False, 7)
    assert len(starts) == 8
    assert failed.value.iterations == 24
    assert failed.value.residual == pytest.approx(2.0)
    np.testing.assert_array_equal(failed.value.q, starts[-1])
    away = np.array(starts[1:]) - named.q
    for k, spread in enumerate([0.1, 0.2, 0.4, 0.8, 1.6, 1.6, 1.6]):
        expected = np.full(4, spread)
        expected[held] = 0.0
        np.testing.assert_allclose(away[k], expected, atol=1e-12)
    # Nothing that moves: no restarts. Steps that ran out: none either.
    starts.clear()
    monkeypatch.setattr(closing, "attempt", lambda s, q, *_: starts.append(q) or Attempt(q, 1.0, 3, False, True))
    with pytest.raises(LoopNotClosed):
        nearest_closed(state, named.q, np.arange(4), 1e-12, 60, False, 7)
    assert len(starts) == 1
    starts.clear()
    monkeypatch.setattr(closing, "attempt", lambda s, q, *_: starts.append(q) or Attempt(q, 1.0, 60, False, False))
    with pytest.raises(LoopNotClosed):
        nearest_closed(state, named.q, NOTHING_HELD, 1e-12, 60, False, 7)
    assert len(starts) == 1


def test_a_start_that_closes_ends_the_search(monkeypatch):
    named = five_bar()
    closed = iter([False, False, True])
    counts = []

    def attempt(state, start, *arguments):
        counts.append(start)
        return Attempt(start, 0.5, 3, next(closed), True)

    monkeypatch.setattr(closing, "attempt", attempt)
    found, steps = nearest_closed(named.chain()._state, named.q, NOTHING_HELD, 1e-12, 60, restarts=5)
    assert steps == 9
    np.testing.assert_array_equal(found, counts[-1])


def test_the_best_of_all_restarts_is_told(monkeypatch):
    named = five_bar()
    state, residuals = named.chain()._state, iter([5.0, 7.0, 2.0, 6.0])
    monkeypatch.setattr(closing, "attempt", lambda s, q, *_: Attempt(q, next(residuals), 1, False, True))
    with pytest.raises(LoopNotClosed) as failed:
        nearest_closed(state, named.q, NOTHING_HELD, 1e-12, 60, False, 3)
    assert (failed.value.residual, failed.value.iterations) == (2.0, 4)


def test_open_loops_of_a_parallelogram_have_the_rank_of_closed_ones():
    named = parallelogram()
    chain = named.chain()
    state, q = chain._state, chain.close(named.q)
    rank = chain.mobility(q).rank
    # Where closed, or open by no more than closed loops may be, it is the residual itself.
    for gap in (0.0, 3e-10, 1e-8):
        assert residual_of_rank(state, q, gap) == gap
    joints, shape = chain.model.njoints, chain.constraint_jacobian(q).shape
    for size in (3e-3, 1e-2):
        there = q + size * np.array([1.0, -0.4, 0.7, 0.2])[: len(q)]
        J, _ = scaled_jacobian(state, there)
        gap = float(np.abs(state.buffers.gap * state.topology.row_scale).max())
        assert gap > 1e-8
        values = np.linalg.svd(J, compute_uv=False)
        assert np.count_nonzero(values > rank_tolerance(shape, values[0], joints, 1e-8)) > rank
        found = residual_of_rank(state, there, gap)
        # Between the two singular values that part: their geometric mean.
        zero = rank_tolerance(shape, values[0], 0, found)
        assert zero == pytest.approx(np.sqrt(values[rank - 1] * values[rank]))
    regular = five_bar()
    state = regular.chain()._state
    there = regular.q + 1e-4
    state.buffers.linearise(there)
    gap = float(np.abs(state.buffers.gap * state.topology.row_scale).max())
    assert residual_of_rank(state, there, gap) == 1e-8


def test_scaled_jacobians_have_the_tolerance_of_their_gap():
    named = four_bar()
    state = named.chain()._state
    for off in (0.0, 1e-3):
        J, tolerance = scaled_jacobian(state, named.q + off * OFF)
        gap = np.abs(state.buffers.gap * state.topology.row_scale).max()
        assert tolerance == pytest.approx(3 * np.linalg.norm(J, 2) * (state.model.njoints * ROUNDING + gap))
        assert np.count_nonzero(state.buffers.gap) < 3  # the row across the plane stays closed
    with pytest.raises(LoopNotClosed):
        closed_configuration(state, named.q + 1e-6)


def test_given_joints_are_exactly_where_they_were_asked_to_be():
    named = five_bar()
    chain = named.chain()
    state, joints = chain._state, ["left_crank_hinge", "right_crank_hinge"]
    index = [chain.configuration_slice(name).start for name in joints]
    rng = np.random.default_rng(5)
    for _ in range(4):
        asked = named.q[index] + rng.uniform(-0.35, 0.35, 2)
        found = forward_kinematics(state, asked, named.q, joints)
        np.testing.assert_array_equal(found[index], asked)
        assert np.abs(chain.residual(found)).max() <= 1e-12
