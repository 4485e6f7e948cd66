"""``exo-pin forces`` on robots of any kind."""

import json

import pytest
from mechanisms import four_bar
from spatial_mechanisms import stewart

from exo_pin.cli import main


def run(capsys, *arguments):
    status = main([str(argument) for argument in arguments])
    return status, *capsys.readouterr()


def test_forces_of_a_preset_on_a_person(capsys):
    person = ("--person", "1.75,75,male", "--flexion", "60", "--abduction", "30")
    status, out, _ = run(capsys, "forces", "prototype", *person, "--json")
    assert status == 0
    told = json.loads(out)
    assert told["forces"]["undetermined"] == 3
    efforts = [item["value"][0] for item in told["efforts"].values()]
    # Values that the README prints: tension pulls, and a slide's effort pushes.
    assert efforts == pytest.approx([264.39, -384.38, 221.77], abs=5e-3)
    shoulder = told["reactions"]["root_joint"]
    assert shoulder["unique"] == [False] * 3 + [True] * 3
    assert shoulder["interval"][0] == [None, None]


def test_the_least_force_in_the_shoulder(capsys):
    _, out, _ = run(capsys, "forces", "prototype", "--least", "root_joint", "--json")
    force = json.loads(out)["reactions"]["root_joint"]["wrench"][:3]
    assert force == pytest.approx([0.0] * 3, abs=1e-9)


def test_forces_of_any_robot_with_a_load(capsys, robot):
    path = robot(stewart())
    status, out, _ = run(
        capsys, "forces", path, "--external", "platform=0,0,-100", "--joint", "ball_0", "--joint", "flight"
    )
    assert status == 0
    assert out.count("effort of slide_") == 6
    assert "ball_0 on upper_0" in out
    assert "undetermined" not in out
    status, out, _ = run(capsys, "forces", path, "--in", "platform", "--at", "platform", "--joint", "slide_1")
    assert status == 0


def test_loads_on_one_body_add_up(capsys, robot):
    path = robot(stewart())
    once = run(capsys, "forces", path, "--external", "platform=1,2,-100,3,0,1", "--joint", "ball_0")
    twice = ("--external", "platform=1,2,-60", "--external", "platform=0,0,-40,3,0,1")
    assert run(capsys, "forces", path, *twice, "--joint", "ball_0") == once


def test_invalid_arguments_are_reported(capsys, robot):
    path = robot(four_bar())
    for arguments, words in (
        (("--external", "rocker=1,2"), "FRAME=FX"),
        (("--external", "knee=1,2,3"), "knee"),
        (("--joint", "knee"), "knee"),
        (("--actuated", "knee"), "knee"),
        (("--external", "coupler=100,0,0", "--actuated", "crank_hinge", "--pull"), "at most"),
    ):
        status, out, error = run(capsys, "forces", path, *arguments)
        assert (status, out) == (2, "")
        assert words in error


def test_limbs_that_only_pull_cannot_push(capsys):
    status, _, error = run(capsys, "forces", "prototype", "--person", "1.75,75,male", "--flexion", "60", "--pull")
    assert status == 2
    assert "limb_" in error
    assert "N" in error
