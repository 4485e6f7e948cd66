"""What a query takes and refuses, and what its answers are like."""

import dataclasses
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import (
    DEGREES,
    MECHANISMS,
    PERSON,
    exo_of,
    map_of,
)

import exo_pin as ep


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def test_answers_print_and_turn_into_json(prototype):
    exo = prototype.worn_by(PERSON)
    single = exo.reaction(ep.shoulder_rotation(30, 20, 0, **DEGREES))
    assert single.percent_body_weight == pytest.approx(100 * single.magnitude / (75 * 9.81))
    text = str(single)
    for part in (
        "% of body weight",
        "limb 3 side force",
        "Equilibrium alone does not determine 3 of the reactions",
        "cuff",
    ):
        assert part in text
    back = json.loads(single.to_json())
    np.testing.assert_array_equal(back["shoulder_force"], single.shoulder_force)
    stack = exo.reaction(ep.thesis_rotation([10, 90], 0, 0, **DEGREES))
    assert json.loads(stack.to_json())["shoulder_force"][1] == [None] * 3
    assert "in equilibrium" in str(stack)
    for part in ("poses", "crossings"):
        assert part in str(prototype.reaction(Rotation.random(0)))


def arrays_of(record):
    """All arrays of a record and of the records in it, by name."""
    for name, value in vars(record).items():
        if isinstance(value, np.ndarray):
            yield name, value
        elif dataclasses.is_dataclass(value):
            yield from arrays_of(value)


def test_answers_are_read_only(prototype):
    poses = ep.shoulder_rotation([10, 60], 30, 0, **DEGREES)
    pulling = prototype.reaction(poses, limits="pull")
    assert pulling.infeasibility is not None
    by_stiffness = prototype.replace(shoulder=ep.Shoulder(stiffness=2e4)).reaction(poses, split="elastic")
    records = [
        pulling,
        by_stiffness,
        pulling.certificate,
        prototype.reaction_map(poses),
        map_of(prototype.mechanism, poses),
    ]
    for record in records:
        named = list(arrays_of(record))
        assert len(named) >= 5
        assert [name for name, array in named if array.flags.writeable] == []
    with pytest.raises(ValueError, match="read-only"):
        by_stiffness.shoulder_force[0] = 0.0


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"split": "fair"}, ep.UnknownName, "minimal, spherical, standalone"),
        ({"constraint_bounds": "actuator"}, ep.InvalidInput, "minimal"),
        ({"split": "minimal", "constraint_bounds": "muscle"}, ep.UnknownName, "actuator"),
        ({"split": "minimal", "constraint_bounds": (1.0, -1.0)}, ep.InfeasibleBounds, "lower bound above"),
        ({"split": "minimal", "constraint_bounds": (np.nan, 1.0)}, ep.InvalidInput, "NaN"),
        ({"split": "minimal", "constraint_bounds": (np.zeros(4), 1.0)}, ep.InvalidInput, "broadcast"),
        ({"split": "minimal", "constraint_bounds": -3.0}, ep.InvalidInput, "zero or more"),
        ({"split": "minimal", "constraint_bounds": True}, ep.InvalidInput, "lower, upper"),
        ({"split": "minimal", "constraint_bounds": float("nan")}, ep.InvalidInput, "NaN"),
        ({"load": [0, 0, 1]}, ep.InvalidInput, "Load"),
        ({"motion": [0, 0, 1]}, ep.InvalidInput, "Motion"),
    ],
)
def test_bad_questions(prototype, arguments, error, message):
    with pytest.raises(error, match=message):
        prototype.reaction(Rotation.identity(), **arguments)


def test_questions_that_lack_data(prototype):
    with pytest.raises(ep.MissingData, match="arm mass"):
        ep.load("scenario-one").reaction(Rotation.identity())
    example = ep.load("appendix-d")
    assert example.reaction(Rotation.identity()).equilibrium_status == "ok"
    with pytest.raises(ep.MissingData, match="inertia"):
        example.reaction(Rotation.identity(), ep.Motion([1, 0, 0], [0, 0, 0]))
    with pytest.raises(ep.NonConvexBound):
        exo_of(MECHANISMS["random-5"]()).reaction(Rotation.identity(), split="minimal", constraint_bounds="actuator")
    with pytest.raises(ep.InvalidInput, match="too few"):
        exo_of(MECHANISMS["random-3-mixed"]()).reaction(Rotation.identity(), split="standalone")
