"""Searches whose designs are judged with the device's centre off the shoulder's."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import Criteria, free_joints, lifting_poses, recheck, starting_design
from exo_pin.wrist import BodyShape

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))
PATH = ep.CentrePath([0.0, 1.6, np.pi], [[0, 0, 0], [-0.027, -0.011, 0.024], [-0.046, -0.048, 0.054]])
SHIFT = ep.CentreOffset.together([0.0, 0.01, 0.0])


def cables():
    return ep.ShoulderExo.from_mechanism(starting_design(ep.Actuator("cable", pull_limit=400.0), ARM, 4))


def judged(exo, centres):
    """A design on the poses of a search, as the start of one of a single generation."""
    found = ep.optimise(
        exo, {"A[1].radius": (0.1, 0.6)}, lifting_poses(counts=(3, 3, 2)), constraints=LIMITS, centre_offset=centres,
        refine=True, fit_strokes=False, budget=24, run_length=24, step=45.0, finer_step=45.0,
    )  # fmt: skip
    return found.start.run


def test_merit_is_that_of_the_workspace_off_centre():
    exo = ep.load("four-cables")
    poses = lifting_poses(counts=(3, 3, 2))
    limits = LIMITS.replace(names=("stroke", "singularity", "forces", "shoulder_force", "clearance"))
    shares = []
    for centre in (None, PATH, SHIFT):
        found = exo.workspace(poses.poses, limits, centre_offset=centre)
        objectives = judged(exo, (centre,)).objectives
        assert objectives["index"] == pytest.approx(poses.weights[found.inside].sum(), abs=1e-9)
        assert objectives["peak_shoulder_force"] == pytest.approx(found.magnitude[found.inside].max(), rel=1e-9)
        shares.append(objectives["index"])
    assert shares[1] < shares[0] - 0.05
    # Of several offsets each has the same weight.
    assert judged(exo, (None, PATH, SHIFT)).objectives["index"] == pytest.approx(np.mean(shares), abs=1e-9)
    assert judged(exo, (None, None)).merit == pytest.approx(judged(exo, (None,)).merit, abs=1e-12)


@pytest.mark.full
def test_result_of_a_search_is_checked_with_every_offset(tmp_path):
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    options = {
        "constraints": LIMITS, "poses": lifting_poses(counts=(3, 3, 2)), "seed": 3, "budget": 96, "run_length": 96,
        "finer_step": 20.0, "storage": tmp_path / "study.db",
    }  # fmt: skip
    found = ep.optimise(cables(), free_joints(4), centre_offset=(None, PATH), **options)
    candidate = found.best_candidate
    assert [check.centre_offset for check in candidate.checks] == [None, PATH]
    still, moving = (found.best.workspace(4.0, LIMITS, centre_offset=centre).index for centre in (None, PATH))
    assert [check.workspace.index for check in candidate.checks] == [still, moving]
    assert candidate.index == min(still, moving)
    assert candidate.check is candidate.checks[0]
    assert all(check.pinocchio_difference < 1e-6 for check in candidate.checks)
    assert "moves with the arm, by at most 86 mm" in str(found)
    # Cables take any length from 30 mm on, so that hardly a pose of any offset is lost to the strokes that were fitted.
    for check in candidate.checks:
        beyond = check.workspace.margins["stroke"] < 0.0
        assert beyond.mean() < 1e-3
        assert (check.workspace.lengths[beyond].min(axis=-1) < 0.03).all()
    with pytest.raises(InvalidInput, match="centre_offset"):
        ep.optimise(cables(), free_joints(4), centre_offset=PATH, **options)


def test_check_of_a_design_off_centre():
    exo = ep.load("four-cables")
    check = recheck(exo.mechanism, exo.reaction, LIMITS, finer_step=12.0, centre_offset=PATH)
    assert check.workspace.index == exo.workspace(4.0, LIMITS, centre_offset=PATH).index
    assert check.abduction.centre_offset is not None
    assert check.pinocchio_poses > 60
    assert check.pinocchio_difference < 1e-9
    further = replace(PATH, fit=np.add(PATH.fit, [0.01, 0.0, 0.0]))
    assert check.offsets["centre +10 mm forward"] == exo.workspace(8.0, LIMITS, centre_offset=further).index
    off = np.array([0.0, 0.0, -0.01])
    alone = recheck(exo.mechanism, exo.reaction, LIMITS, finer_step=12.0)
    assert alone.offsets["centre -10 mm up"] == exo.workspace(8.0, LIMITS, centre_offset=off).index


@pytest.mark.parametrize(
    "given", [[], np.zeros((2, 3)), [0.0, np.inf, 0.0], "torso", [PATH, "torso"], [12.0, 0.0, 0.0]]
)
def test_offsets_that_a_search_cannot_use(given):
    with pytest.raises(InvalidInput):
        ep.optimise(cables(), free_joints(4), centre_offset=given, budget=24)
