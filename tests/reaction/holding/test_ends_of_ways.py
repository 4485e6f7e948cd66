"""Where the way of a device ends, and what else a verdict counts, in words, from records that are written down."""

from types import SimpleNamespace

import numpy as np

import exo_pin as ep
from exo_pin.reaction.holding.verdict import _end_of_load, _end_of_way


def ended(status, share=None, followed=1.0, matrices=None, shape=(), offset=None, stress=0):
    placed, mechanism = SimpleNamespace(share=np.array([followed])), SimpleNamespace(side="left")
    poses = SimpleNamespace(placed=placed, matrices=matrices, mechanism=mechanism)
    full = None if share is None else np.full(shape, share)
    case = SimpleNamespace(offset=offset)
    poses.tensions, split = (
        SimpleNamespace(self_stress=np.zeros((1, 3, stress))),
        SimpleNamespace(chooses_tensions=True),
    )
    return SimpleNamespace(
        source=SimpleNamespace(poses=poses, split=split), status=np.full(shape, status), load_share=full, case=case
    )


def test_where_the_way_of_a_device_ends():
    assert _end_of_load(0.25, "out_of_reach", False) == (
        "Beyond 25 % of the offset its loops open: what is rigid of it does not follow."
    )
    assert _end_of_load(0.0, "out_of_reach", False) == (
        "With the offset its loops open: what is rigid of it does not follow."
    )
    assert _end_of_load(0.5, "no_equilibrium", False) == "At 50 % of load and offset what is soft gives way."
    assert _end_of_load(0.5, "not_solved", False) == ""
    # Of an elastic device the share of the load, of single poses that did not get to the end.
    others = 'With other efforts it may hold: split="elastic_locked" keeps the drives where they are.'
    assert _end_of_way(ended("no_equilibrium", 0.4, stress=1)).endswith(others)
    assert _end_of_way(ended("no_equilibrium", 0.4)) == "At 40 % of load and offset what is soft gives way."
    assert _end_of_way(ended("no_equilibrium", 1.0)) == ""
    assert _end_of_way(ended("no_equilibrium", 0.4, shape=(2,))) == ""
    assert _end_of_way(ended("ok")) == ""
    # Of a rigid one the pose up to which it turns: a share of the way from rest.
    pose = ep.shoulder_rotation(40, 0, 0, degrees=True)

    def lost(followed, status="out_of_reach", **case):
        return _end_of_way(ended(status, followed=followed, matrices=pose.as_matrix()[None], **case))

    assert lost(0.75) == "On the way from rest it gets as far as flexion 30°, abduction 0°, internal rotation 0°."
    assert lost(0.75, "beyond_singular") == lost(0.75)
    assert lost(0.0) == "From rest it cannot turn the arm this way."
    assert lost(0.0, offset=ep.CentreOffset.together([0.0, 0.0, 0.01])) == (
        "Its loops do not close even at rest: off its centre a rigid device needs a cuff that gives way."
    )
    assert lost(0.0, "beyond_singular") == "It is singular at rest, so that it has no assembly mode to follow."
    assert lost(0.75, "singular") == ""
    assert _end_of_way(ended("out_of_reach", shape=(1,))) == ""
