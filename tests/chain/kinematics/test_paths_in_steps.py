"""Steps along a path of which some are too long, and random postures: recorded, and judged by hand."""

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS

from exo_pin import LoopNotClosed
from exo_pin.chain.kinematics.closing import _follow
from exo_pin.chain.postures.inverse_kinematics import _random_postures
from exo_pin.chain.postures.posture_problem import PostureProblem

CHAIN, Q = CHAINS["five_bar"]


def line(longest, reach=1.0, bend=0.0):
    """Fractions at which a path along a line was corrected, where loops follow steps up to ``longest``."""
    way, tried, guesses = reach * np.ones(CHAIN.model.nv), [], []
    at = [0.0]

    def correct(target, guess):
        tried.append(target)
        guesses.append(guess)
        if target - at[0] > longest:
            raise LoopNotClosed(guess, 1.0, 1)
        at[0] = target
        return pin.integrate(CHAIN.model, Q, (target + bend * (target > 0.5)) * way)

    end = _follow(CHAIN._state, Q, reach, correct)
    return end, tried, guesses, way


def test_a_path_goes_in_steps_of_a_tenth_and_guesses_by_the_last_rate():
    end, tried, guesses, way = line(1.0)
    np.testing.assert_allclose(tried, np.arange(1, 11) / 10.0, atol=1e-12)
    assert tried[-1] == 1.0
    np.testing.assert_allclose(end, Q + way, atol=1e-12)
    np.testing.assert_array_equal(guesses[0], Q)
    for fraction, guess in zip(tried[1:], guesses[1:], strict=True):
        np.testing.assert_allclose(guess, Q + fraction * way, atol=1e-12)
    assert len(line(1.0, reach=0.25)[1]) == 3
    assert line(1.0, reach=0.0)[1] == [1.0]


def test_steps_that_the_loops_do_not_follow_are_halved():
    end, tried, _, way = line(0.03)
    np.testing.assert_allclose(end, Q + way, atol=1e-12)
    np.testing.assert_allclose(tried[:3], [0.1, 0.05, 0.025], atol=1e-12)
    assert np.diff(tried[2:]).max() <= 0.025 + 1e-12
    # Twelve times; then the path ends.
    tried = []

    def never(target, guess):
        tried.append(target)
        raise LoopNotClosed(guess, 1.0, 1)

    with pytest.raises(LoopNotClosed):
        _follow(CHAIN._state, Q, 0.5, never)
    np.testing.assert_allclose(tried, 0.2 / 2.0 ** np.arange(13), rtol=1e-12)
    # A step that ends more than half a unit from its guess may be on another branch.
    with pytest.raises(LoopNotClosed):
        line(1.0, bend=0.6)
    line(1.0, bend=0.3)


@pytest.mark.parametrize("name", ["five_bar", "delta", "wrist-floating"])
def test_random_postures_lie_within_limits_or_half_a_turn(name):
    chain, q = CHAINS[name]
    model = chain.model.copy()
    limited = next(j for j in range(1, model.njoints) if model.nqs[j] == model.nvs[j] == 1)
    index, lower, upper = model.idx_qs[limited], model.lowerPositionLimit.copy(), model.upperPositionLimit.copy()
    lower[index], upper[index] = 0.2, 0.3
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    chain = chain.__class__(model, chain.description)
    held = np.array([model.nv - 1])
    problem = PostureProblem(chain._state, None, held, None, 1e-12)
    found = list(_random_postures(problem, q, 40))
    assert len(found) == 40
    reach = np.where(chain._state.topology.metres, chain.characteristic_length, np.pi)
    away = np.array([pin.difference(model, q, one) for one in found]) / reach
    for joint in range(1, model.njoints):
        own = slice(model.idx_vs[joint], model.idx_vs[joint] + model.nvs[joint])
        if held[0] in range(own.start, own.stop):
            np.testing.assert_allclose(away[:, held], 0.0, atol=1e-9)
        elif joint == limited:
            values = np.array(found)[:, index]
            assert 0.2 <= values.min() < 0.22
            assert 0.28 < values.max() <= 0.3
        elif model.nvs[joint] == 1 and not np.isfinite(lower[model.idx_qs[joint]]):
            assert 0.85 < np.abs(away[:, own]).max() <= 1.0 + 1e-12
            assert away[:, own].min() < 0.0 < away[:, own].max()
    again = list(_random_postures(problem, q, 3))
    np.testing.assert_array_equal(again, found[:3])
