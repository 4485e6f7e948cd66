"""Steps along a path of which some are too long, and random postures: recorded, and judged by hand."""

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS

from exo_pin import LoopNotClosed
from exo_pin.chain.kinematics.closing import follow

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

    end = follow(CHAIN._state, Q, reach, correct)
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
        follow(CHAIN._state, Q, 0.5, never)
    np.testing.assert_allclose(tried, 0.2 / 2.0 ** np.arange(13), rtol=1e-12)
    # A step that ends more than half a unit from its guess may be on another branch.
    with pytest.raises(LoopNotClosed):
        line(1.0, bend=0.6)
    line(1.0, bend=0.3)
