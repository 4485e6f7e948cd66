"""One step of closing: its damping, its patience, and when it is closed or stuck."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar

from exo_pin.chain.kinematics.closing_steps import CLOSED_THERE, GOING, STUCK, advance

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
