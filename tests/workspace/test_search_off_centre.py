"""Searches whose designs are judged with the device's centre off the shoulder's."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import Criteria, free_joints, lifting_poses, starting_design
from exo_pin.wrist import BodyShape

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))
PATH = ep.CentrePath([0.0, 1.6, np.pi], [[0, 0, 0], [-0.027, -0.011, 0.024], [-0.046, -0.048, 0.054]])


def cables():
    return ep.ShoulderExo.from_mechanism(starting_design(ep.Actuator("cable", pull_limit=400.0), ARM, 4))


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
