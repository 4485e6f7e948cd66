"""What a check of a design says, of answers that are given."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

import exo_pin as ep
from exo_pin.workspace import CRITERIA, optimisation

NAN = np.nan


def lifting(inside, magnitude, moment):
    return SimpleNamespace(inside=np.array(inside), magnitude=np.array(magnitude), margins={"forces": np.array(moment)})


def some_check(index=0.8, blocked=False, left_out=(), lifts=(True, True), region=(True, False), **changes):
    vital = [name for name, each in CRITERIA.items() if each.is_vital and name not in left_out]

    class Grid(SimpleNamespace):
        def __str__(self):
            return "the grid"

    grid = Grid(
        index=index, margins=dict.fromkeys(vital), blocks_elbow=blocked, region=np.array(region), region_distance=0.5
    )
    lines = [lifting([True, lift], [30.0, NAN], [2.0, -1.0]) for lift in lifts]
    fields = {
        "pinocchio_poses": 78, "pinocchio_difference": 2.5e-9, "persons": {"woman": 0.5}, "offsets": {"up": 0.25},
        "beyond_elbow": {"woman": "limb 1"},
    }  # fmt: skip
    return optimisation.Recheck(grid, 0.75, 2.0, *lines, **(fields | changes))


def test_which_designs_work():
    assert some_check().works
    assert not some_check(index=0.7999).works
    assert not some_check(blocked=True).works
    for lifts in ((False, True), (True, False)):
        assert not some_check(lifts=lifts).works
    for name, each in CRITERIA.items():
        if each.is_vital:
            assert not some_check(left_out=(name,)).works


def test_words_of_a_check():
    assert str(some_check()).splitlines() == [
        "the grid",
        "",
        "On the grid of 2°: 75.0 %.",
        "Largest connected region on one side of det X = 0: 50.0 % of the poses, the nearest 29° from rest.",
        "Flexion 0 to 90°: 2 of 2 poses inside, shoulder force at most 30 N, least moment margin -1.0 N m.",
        "Abduction 0 to 90°: 2 of 2 poses inside, shoulder force at most 30 N, least moment margin -1.0 N m.",
        "Checked with Pinocchio: 78 poses, |F_s| differs by at most 2.5e-09 N.",
        "woman: 50.0 %; limb 1",
        "up: 25.0 %",
    ]
    bare = str(
        some_check(pinocchio_poses=0, region=(False, False), centre_offset=ep.CentreOffset.together(np.zeros(3)))
    )
    assert bare.startswith("The device's centre is off the shoulder's by (0, 0, 0) mm")
    assert "Pinocchio" not in bare
    assert "region" not in bare
    # Lines without forces, or on which no pose is held, say nothing of them.
    for line in (SimpleNamespace(magnitude=np.array([30.0]), margins={}), lifting([False], [NAN], [-1.0])):
        assert "0 to 90°" not in str(replace(some_check(), flexion=line, abduction=line))
