"""Questions about forces that make no sense get a typed error."""

import dataclasses

import numpy as np
import pytest
from mechanisms import four_bar

from exo_pin import ExoPinError, InvalidInput, LoopNotClosed, UnknownName
from exo_pin.chain import ClosedChain

NAMED = four_bar()
Q = NAMED.q
NAN = np.nan


def asked(*state, **problem):
    return NAMED.chain().inverse_dynamics(*(state or (Q,)), **problem)


WRONG = {
    "q of another size": lambda: asked(Q[:2]),
    "a stack of stacks": lambda: asked(np.stack([Q, Q])[None]),
    "a stack of another size": lambda: asked(np.stack([Q, Q])[:, :2]),
    "q with NaN": lambda: asked(Q * NAN),
    "no q": lambda: asked(None),
    "words for q": lambda: asked("closed"),
    "v of another size": lambda: asked(Q, [1.0]),
    "infinite v": lambda: asked(Q, [np.inf] * 3),
    "a with NaN": lambda: asked(Q, None, [NAN] * 3),
    "v that opens the loop": lambda: asked(Q, [1.0, 0.0, 0.0]),
    "slow v that opens the loop": lambda: asked(Q, [1e-6, 0.0, 0.0]),
    "a that opens the loop": lambda: asked(Q, None, [1.0, 0.0, 0.0]),
    "a that forgets the drift": lambda: asked(Q, NAMED.chain().project_velocity(Q, [1.0, 0.0, 0.0])),
    "external as a list": lambda: asked(external=[1.0]),
    "external of five numbers": lambda: asked(external={"crank": np.zeros(5)}),
    "external with NaN": lambda: asked(external={"crank": [NAN] * 6}),
    "one number as bounds": lambda: asked(effort_bounds={"crank_hinge": 3.0}),
    "no bounds of a joint": lambda: asked(effort_bounds={"crank_hinge": None}),
    "three numbers as bounds": lambda: asked(effort_bounds={"crank_hinge": (1, 2, 3)}),
    "words as bounds": lambda: asked(effort_bounds={"crank_hinge": "no"}),
    "ragged bounds": lambda: asked(effort_bounds={"crank_hinge": ([0, [0]], 1)}),
    "bounds of two for one coordinate": lambda: asked(effort_bounds={"crank_hinge": ([0, 0], [1, 1])}),
    "bounds that cross": lambda: asked(effort_bounds={"crank_hinge": (1, 0)}),
    "bounds with NaN": lambda: asked(effort_bounds={"crank_hinge": (NAN, 0)}),
    "bounds at infinity": lambda: asked(effort_bounds={"crank_hinge": (np.inf, np.inf)}),
    "bounds as a list": lambda: asked(effort_bounds=[(0, 1)]),
    "bounds of a passive joint": lambda: asked(effort_bounds={"rocker_hinge": (0, 1)}),
    "reaction bounds of three": lambda: asked(reaction_bounds={"tip": ([0, 0, 0], 1)}),
    "reaction bounds with NaN": lambda: asked(reaction_bounds={"tip": (NAN, 1)}),
    "reaction bounds that cross in one": lambda: asked(reaction_bounds={"tip": (0, [1, 1, 1, 1, 1, -1])}),
    "reaction bounds as a list": lambda: asked(reaction_bounds=["tip"]),
    "two weights": lambda: asked(objective={"tip": [1, 2]}),
    "a weight of NaN": lambda: asked(objective={"tip": NAN}),
    "a weight in words": lambda: asked(objective={"tip": "much"}),
    "ragged weights": lambda: asked(objective={"tip": [1, [2]]}),
    "an objective as a list": lambda: asked(objective=["tip"]),
    "an objective as a number": lambda: asked(objective=1.0),
    "the other link": lambda: asked().joint_reaction("tip", on="crank"),
    "a point with NaN": lambda: asked().joint_reaction("tip", at=[NAN, 0, 0]),
    "a point of two": lambda: asked().joint_reaction("tip", at=[0, 0]),
}
UNKNOWN = {
    "frame of a load": lambda: asked(external={"rocket": np.zeros(6)}),
    "actuated joint": lambda: asked(actuated=["rocket"]),
    "actuated closure": lambda: asked(actuated=["tip"]),
    "bounded joint": lambda: asked(effort_bounds={"rocket": (0, 1)}),
    "closure with an effort": lambda: asked(effort_bounds={"tip": (0, 1)}),
    "word for bounds": lambda: asked(effort_bounds="pull"),
    "bounded reaction": lambda: asked(reaction_bounds={"rocket": (0, 1)}),
    "bounded world": lambda: asked(reaction_bounds={"universe": (0, 1)}),
    "objective": lambda: asked(objective="comfort"),
    "joint of the objective": lambda: asked(objective={"rocket": 1.0}),
    "metric": lambda: asked(metric="taxi"),
    "no metric": lambda: asked(metric=None),
    "joint": lambda: asked().joint_reaction("rocket"),
    "world as a joint": lambda: asked().joint_reaction("universe"),
    "joint of the short form": lambda: NAMED.chain().joint_reaction("rocket", Q),
    "body": lambda: asked().joint_reaction("tip", on="rocket"),
    "list as a body": lambda: asked().joint_reaction("tip", on=["coupler"]),
    "point": lambda: asked().joint_reaction("tip", at="rocket"),
    "axes": lambda: asked().joint_reaction("tip", in_frame="rocket"),
    "list as axes": lambda: asked().joint_reaction("tip", in_frame=["world"]),
    "loaded body": lambda: asked().wrench_on("rocket"),
    "joint with an effort": lambda: asked().effort("tip"),
    "joint with an interval": lambda: asked().effort_interval("rocket"),
}


@pytest.mark.parametrize("what", WRONG)
def test_refuses(what):
    with pytest.raises(InvalidInput) as refusal:
        WRONG[what]()
    assert isinstance(refusal.value, ExoPinError)
    assert isinstance(refusal.value, ValueError)


@pytest.mark.parametrize("what", UNKNOWN)
def test_does_not_know(what):
    with pytest.raises(UnknownName) as refusal:
        UNKNOWN[what]()
    assert refusal.value.available


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
