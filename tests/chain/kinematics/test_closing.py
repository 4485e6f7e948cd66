"""Closing: how fast, how far, within which limits, from where again."""

import numpy as np
import pytest
from closed_chains import CHAINS, off
from mechanisms import five_bar

from exo_pin import LoopNotClosed


@pytest.fixture(params=CHAINS)
def case(request):
    return CHAINS[request.param]


def test_ten_steps_are_enough_from_0_3_rad_off(case):
    chain, q = case
    rng = np.random.default_rng(0)
    for _ in range(30):
        closed = chain.close(off(chain, q, rng, 0.3), max_iterations=10, restarts=0)
        assert np.abs(chain.residual(closed)).max() <= 1e-12


def test_moving_one_slide_of_the_free_flying_wrist_far_needs_new_starts():
    chain, q = CHAINS["wrist-wrist"]
    slide = chain.roles.actuated[0]
    stuck = 0
    for seed in range(20):
        start = off(chain, q, np.random.default_rng(seed), 0.3, [slide])
        start[chain.configuration_slice(slide)] += 0.05
        try:
            chain.close(start, hold=[slide], restarts=0)
        except LoopNotClosed:
            stuck += 1
        closed = chain.close(start, hold=[slide])
        assert np.abs(chain.residual(closed)).max() <= 1e-12
        np.testing.assert_array_equal(closed, chain.close(start, hold=[slide]))
    assert stuck > 0  # otherwise this test shows nothing


def limited(joint, lower, upper):
    named = five_bar()
    chain = named.chain()
    index = chain.configuration_slice(joint)
    chain.model.lowerPositionLimit[index] = lower
    chain.model.upperPositionLimit[index] = upper
    return chain, named.q


def test_limits_are_respected():
    # At rest the left crank stands at 126.87°; it may not go there.
    chain, q = limited("left_crank_hinge", -1.0, 2.0)
    assert chain.beyond_limits(q) == ("left_crank_hinge",)
    rng = np.random.default_rng(3)
    for _ in range(20):
        start = off(chain, q, rng, 0.2)
        closed = chain.close(start, respect_limits=True)
        assert chain.beyond_limits(closed) == ()
        assert np.abs(chain.residual(closed)).max() <= 1e-12
    assert 1.9 < chain.close(q, respect_limits=True)[0] <= 2.0
    assert chain.close(q)[0] == q[0]
