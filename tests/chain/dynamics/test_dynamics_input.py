"""Open loops, rounding and ambiguous names in questions about forces."""

import dataclasses

import numpy as np
import pytest
from senseless_questions import NAMED, Q, asked

from exo_pin import InvalidInput, LoopNotClosed
from exo_pin.chain import ClosedChain


def test_open_loops_are_reported_with_their_residual():
    with pytest.raises(LoopNotClosed) as refusal:
        asked(Q + np.array([0.1, 0.0, 0.0]))
    # The crank turns by 0.1 and takes the coupler's tip along, away from the rocker's, seen along and across the
    # coupler, which has turned as well.
    turn = np.array([[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]])
    away = turn @ [0.7, 0.4] - [0.7, 0.4]
    along = turn @ np.array([7.0, 1.0]) / np.sqrt(50)
    gap = max(abs(along @ away), abs(along[0] * away[1] - along[1] * away[0]))
    assert refusal.value.residual == pytest.approx(gap, rel=1e-9)


def test_rounding_of_a_chain_at_rest_is_no_motion_that_opens_its_loops():
    still = asked()
    for v, a in (([1e-12, 0, 0], None), (None, [0, 1e-11, 0]), ([0, 0, 1e-14], [1e-13, 0, 0])):
        np.testing.assert_allclose(asked(Q, v, a).tau, still.tau, atol=1e-9)


def test_a_name_of_a_joint_and_a_closure_is_ambiguous():
    closures = tuple(dataclasses.replace(item, name="crank_hinge") for item in NAMED.closures.closures)
    chain = ClosedChain.from_urdf(NAMED.urdf, dataclasses.replace(NAMED.closures, closures=closures))
    with pytest.raises(InvalidInput, match="joint as well as a closure"):
        chain.joint_reaction("crank_hinge", Q)
