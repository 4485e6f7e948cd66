"""What a map keeps, takes and refuses."""

import tracemalloc

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import map_of, random_mechanism

import exo_pin as ep

MECHANISMS = {
    "prototype": lambda: ep.load("prototype").replace(limbs=None).mechanism,
    "worn-right": lambda: (
        ep.load("prototype", side="right")
        .worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
        .replace(limbs=None)
        .mechanism
    ),
    "random-3-mixed": lambda: random_mechanism(np.random.default_rng(71), 3, ["SPS", "UPU", "SPS"]),
    "random-3-cables": lambda: random_mechanism(np.random.default_rng(72), 3, ["SPS"] * 3),
    "random-4": lambda: random_mechanism(np.random.default_rng(73), 4),
    "random-5": lambda: random_mechanism(np.random.default_rng(74), 5, ["UPU", "SPS", "UPU", "SPS", "UPU"]),
}


def exo_of(name):
    return ep.ShoulderExo.from_mechanism(MECHANISMS[name]())


def test_only_what_is_asked_is_kept():
    exo, poses = ep.load("prototype"), Rotation.random(100, np.random.default_rng(79))
    whole = exo.reaction_map(poses)
    few = exo.reaction_map(poses, keep=("magnitude", "status"))
    assert few.shoulder_force is few.actuator_forces is few.constraint_forces is few.margin is None
    np.testing.assert_array_equal(few.magnitude, whole.magnitude)
    np.testing.assert_array_equal(few.status, whole.status)
    np.testing.assert_array_equal(exo.reaction_map(poses, keep="margin").margin, whole.margin)
    assert exo.reaction_map(poses[:0], keep=["margin"]).magnitude is None
    with pytest.raises(ep.InvalidInput, match="keep"):
        _ = exo.reaction_map(poses, keep=["margin"]).has_answer


@pytest.mark.full
@pytest.mark.parametrize("split", ["spherical", "minimal"])
def test_memory_beside_the_answer_does_not_grow(split):
    exo = ep.load("prototype")
    # A load that is the same for every pose, and bounds that are, must not be spread out either.
    question = {"split": split, "load": ep.Load([0, 0, -5.0]), "keep": ("magnitude", "status"), "chunk": 4096}
    if split == "minimal":
        question["constraint_bounds"] = (-5.0, np.array([4.0, 5, 6]))
    exo.reaction_map(Rotation.random(10, 0), **question)
    poses = Rotation.random(300_000, np.random.default_rng(80))
    tracemalloc.start()
    try:
        own = exo.reaction_map(poses, **question)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # Blocks of 4096 poses, with forces and limits, are some twenty arrays of 98 kB; all quaternions would be 9.6 MB.
    assert peak - own.magnitude.nbytes - own.status_codes.nbytes - own.unknown.nbytes < 2.5e6


def test_progress_is_shown_only_when_asked_for(capsys):
    exo, poses = ep.load("prototype"), Rotation.random(1000, np.random.default_rng(81))
    exo.reaction_map(poses, chunk=100)
    assert capsys.readouterr() == ("", "")
    exo.reaction_map(poses, chunk=100, threads=2, progress=True)
    out, err = capsys.readouterr()
    assert out == ""
    assert "reaction map" in err


def test_a_pose_that_is_not_finite_is_refused():
    broken = Rotation.from_rotvec([[0.1, 0, 0], [np.nan, 0, 0], [0, 0.2, 0]])
    with pytest.raises(ep.InvalidInput, match="finite"):
        ep.load("prototype").reaction_map(broken)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"split": "fair"}, ep.UnknownName, "elastic, elastic_locked, minimal, spherical"),
        ({"constraint_bounds": (-1.0, 1.0)}, ep.InvalidInput, "minimal"),
        ({"split": "elastic"}, ep.MissingData, "shoulder stiffness"),
        ({"split": "minimal", "constraint_bounds": (1.0, -1.0)}, ep.InfeasibleBounds, "0, 1, 2"),
        ({"split": "minimal", "constraint_bounds": ([0, 2, 0], [1, 1, 1])}, ep.InfeasibleBounds, "index 1$"),
        ({"split": "minimal", "constraint_bounds": (np.zeros(4), 1.0)}, ep.InvalidInput, "broadcast"),
        ({"load": [0, 0, 1]}, ep.InvalidInput, "Load"),
        ({"motion": [0, 0, 1]}, ep.InvalidInput, "Motion"),
        ({"load": ep.Load(np.zeros((3, 3)))}, ep.InvalidInput, "broadcast"),
        ({"threads": 0}, ep.InvalidInput, "threads"),
        ({"chunk": 1.5}, ep.InvalidInput, "chunk"),
        ({"keep": ["ratio"]}, ep.UnknownName, "magnitude"),
        ({"keep": 3}, ep.InvalidInput, "keep"),
    ],
)
def test_bad_questions(arguments, error, message):
    with pytest.raises(error, match=message):
        ep.load("prototype").reaction_map(Rotation.random(2, 0), **arguments)


def test_bad_mechanisms():
    exo, pose = ep.load("prototype"), Rotation.identity()
    with pytest.raises(ep.InvalidInput, match="Rotation"):
        exo.reaction_map(np.eye(3))
    with pytest.raises(ep.MissingData, match="arm mass"):
        map_of(ep.load("scenario-one").mechanism, pose)
    example = ep.load("appendix-d")
    assert example.reaction_map(pose).status == "ok"
    with pytest.raises(ep.MissingData, match="inertia"):
        example.reaction_map(pose, ep.Motion([1, 0, 0], [0, 0, 0]))
    with pytest.raises(ep.NonConvexBound):
        exo_of("random-5").reaction_map(pose, split="minimal", constraint_bounds="actuator")
    with pytest.raises(ep.InvalidInput, match="too few"):
        exo_of("random-3-mixed").reaction_map(pose, split="standalone")
