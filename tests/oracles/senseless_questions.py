"""Questions about the forces of a four-bar that make no sense, or name what is not there."""

from dataclasses import replace

import numpy as np
from mechanisms import four_bar

from exo_pin.chain import ClosedChain, Placement

NAMED = four_bar()
Q = NAMED.q
NAN = np.nan


def asked(*state, **problem):
    return NAMED.chain().inverse_dynamics(*(state or (Q,)), **problem)


def of_far_loop(rows):
    """What is said of each of some configurations of the four-bar whose loop is to close 10 m away."""
    chain = NAMED.chain()
    closures = [replace(own, placement_b=Placement((10.0, 0.0, 0.0))) for own in chain.closures]
    far = ClosedChain(chain.model, replace(chain.description, closures=tuple(closures)))
    found = far.inverse_dynamics(rows, close=True)
    return [[found.status, [[k, type(error).__name__] for k, error in found.failures.items()]]]


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
    "an array of infinite v": lambda: asked(Q, np.array([np.inf] * 3)),
    "an array of a with NaN": lambda: asked(Q, None, np.array([NAN] * 3)),
    "an array of huge a": lambda: asked(Q, 0.0 * Q, np.array([1e13] * 3)),
    "v that opens the loop": lambda: asked(Q, [1.0, 0.0, 0.0]),
    "slow v that opens the loop": lambda: asked(Q, [1e-6, 0.0, 0.0]),
    "a that opens the loop": lambda: asked(Q, None, [1.0, 0.0, 0.0]),
    "a that forgets the drift": lambda: asked(Q, NAMED.chain().project_velocity(Q, [1.0, 0.0, 0.0])),
    "a stack of v of another size": lambda: asked(np.stack([Q, Q]), np.ones((3, 3))),
    "a stack of NaN and a loop that cannot close": lambda: of_far_loop(np.stack([Q * NAN, Q, Q, 1e13 + Q, Q - 1e13])),
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
    "frame of the load of a stack": lambda: asked(np.stack([Q, Q]), external={"rocket": np.zeros(6)}),
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
