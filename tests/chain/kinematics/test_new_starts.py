"""Where the search for closed loops starts anew, and its steps: recorded, and judged by hand."""

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS

from exo_pin import LoopNotClosed
from exo_pin.chain.kinematics import closing
from exo_pin.chain.kinematics.closing_steps import GOING, STUCK, Attempt


@pytest.mark.parametrize("name", ["five_bar", "stewart", "wrist-floating"])
def test_new_starts_are_spread_twice_as_wide_each_time(name, monkeypatch):
    chain, q = CHAINS[name]
    state, starts = chain._state, []
    residuals = iter([0.5, 0.9, 0.3, 0.4, 0.2, 0.7, 0.6, 0.8])

    def attempt(state, start, *arguments):
        starts.append(start.copy())
        return Attempt(start, next(residuals), 7, False, True)

    monkeypatch.setattr(closing, "attempt", attempt)
    held = np.array([0])
    with pytest.raises(LoopNotClosed) as caught:
        closing.nearest_closed(state, q, held, 1e-12, 60, restarts=7)
    assert len(starts) == 8
    assert caught.value.iterations == 8 * 7
    # The best of all that was found.
    assert caught.value.residual == 0.2
    np.testing.assert_array_equal(caught.value.q, starts[4])
    size = np.where(state.topology.metres, chain.characteristic_length, 1.0)
    away = np.array([pin.difference(chain.model, q, start) / size for start in starts])
    np.testing.assert_array_equal(away[0], 0.0)
    np.testing.assert_allclose(away[:, 0], 0.0, atol=1e-12)
    # Up to 0.8 a turn is known from its configuration.
    for k, spread in enumerate((0.1, 0.2, 0.4, 0.8), start=1):
        free = away[k, 1:]
        assert np.abs(free).max() <= 1.9 * spread
        assert np.abs(free).max() >= 0.3 * spread
        single = np.array(
            [chain.model.nvs[j] for j in range(1, chain.model.njoints) for _ in range(chain.model.nvs[j])]
        )
        assert np.abs(free[single[1:] == 1]).max(initial=0.0) <= spread + 1e-12
    both = np.concatenate([away[k, 1:] for k in range(1, 5)])
    assert both.min() < 0.0 < both.max()
    single = np.flatnonzero(single[1:] == 1)
    if name == "five_bar":
        widest = np.array([start - q for start in starts])[5:, 1:][:, single]
        assert 0.8 < np.abs(widest).max() <= 1.6


def test_no_new_starts_where_nothing_may_move_or_steps_ran_out(monkeypatch):
    chain, q = CHAINS["five_bar"]
    told, stuck = [], [True]

    def attempt(state, start, *arguments):
        told.append(start)
        return Attempt(start, 0.5, 3, False, stuck[0])

    monkeypatch.setattr(closing, "attempt", attempt)
    for held, stuck[0] in ((np.arange(chain.model.nv), True), (closing.NOTHING_HELD, False)):
        told.clear()
        with pytest.raises(LoopNotClosed) as caught:
            closing.nearest_closed(chain._state, q, held, 1e-12, 60, restarts=5)
        assert len(told) == 1
        assert caught.value.iterations == 3


def test_a_start_that_closes_ends_the_search(monkeypatch):
    chain, q = CHAINS["five_bar"]
    closed = iter([False, False, True])
    counts = []

    def attempt(state, start, *arguments):
        counts.append(start)
        return Attempt(start, 0.5, 3, next(closed), True)

    monkeypatch.setattr(closing, "attempt", attempt)
    found, steps = closing.nearest_closed(chain._state, q, closing.NOTHING_HELD, 1e-12, 60, restarts=5)
    assert steps == 9
    np.testing.assert_array_equal(found, counts[-1])


def test_steps_adapt_their_damping_and_stop_when_stuck():
    """The factor of the damping follows how much of the gap a step left; poorer steps end at the best one."""
    from exo_pin.chain.kinematics.closing_steps import _damping, advance

    chain, q = CHAINS["five_bar"]
    state = chain._state
    work, top = state.buffers, state.topology
    weight, memory = top.weight, np.zeros(4)
    best, move = q.copy(), np.zeros(chain.model.nv)
    here = np.zeros_like(work.gap), np.zeros_like(work.jacobian)
    there = np.zeros_like(work.gap), np.zeros_like(work.jacobian)

    def tried(size, count, within=True):
        """A trial whose first hinge is off."""
        trial = q.copy()
        trial[0] += size
        pin.computeJointJacobians(state.model, work.data, trial)
        return advance.plain(
            work.poses, work.J, top.loops, trial, count, within, weight, 1e-12, top.scales, best, memory, here, there,
            move,
        )  # fmt: skip

    def gap(size):
        trial = q.copy()
        trial[0] += size
        return np.linalg.norm(chain.residual(trial) * top.row_scale)

    assert tried(0.2, 0) == GOING
    np.testing.assert_allclose(memory, [gap(0.2), gap(0.2), 1.0, np.abs(chain.residual(best)).max()], rtol=1e-12)
    assert _damping.plain(memory) == pytest.approx(1e-2 * gap(0.2))
    for size, count, factor in ((0.02, 1, 0.3), (0.018, 2, 0.9), (0.009, 3, 0.9), (0.1, 4, 9.0), (0.1, 5, 90.0)):
        assert tried(size, count) == GOING
        assert memory[2] == pytest.approx(factor), size
    # A poorer trial leaves the best one where it is.
    assert best[0] == pytest.approx(q[0] + 0.009)
    assert memory[0] == pytest.approx(gap(0.009), rel=1e-12)
    assert _damping.plain(np.array([0.0, 0.0, 1.0, 0.0])) == 1e-13
    # Eight steps that leave more than 0.8 of what there was are the last ones.
    memory[1] = memory[0] / 0.79
    assert tried(0.1, 8) == GOING
    assert memory[1] == memory[0]
    memory[1] = memory[0] / 0.81
    assert tried(0.1, 9) == GOING
    assert tried(0.1, 16) == STUCK
    memory[2] = 1e9 / memory[0]
    assert tried(0.1, 17) == STUCK
    # Closed, but beyond a limit, is not closed; within it is.
    assert tried(0.0, 0, within=False) == GOING
    assert tried(0.0, 0) == 1
