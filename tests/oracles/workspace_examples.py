"""Designs at random, and examples of the public classes of workspaces and searches."""

from importlib.util import find_spec

import numpy as np

import exo_pin as ep
from exo_pin.load_case.pose_stacks import pose_matrices
from exo_pin.workspace import Criteria, free_joints, lifting_poses, recheck
from exo_pin.workspace.evaluation import PoseOffsets, PoseValues
from exo_pin.workspace.optimisation.merit import Descent, Merit
from exo_pin.workspace.optimisation.optimised import Candidate, Optimised
from exo_pin.workspace.optimisation.search_poses import ContactObjective, DesignVariables
from exo_pin.workspace.optimisation.stored_study import SearchRun, StoredStudy
from exo_pin.wrist import BodyShape


def free_design(limb_count, seed=0, family="cable"):
    """Joints at random around shoulder and arm, with a man's arm; linear actuators push, too."""
    rng = np.random.default_rng(seed)
    directions = rng.standard_normal((limb_count, 3))
    base = 0.2 * directions / np.linalg.norm(directions, axis=1)[:, None]
    angles = rng.uniform(0.0, 2 * np.pi, limb_count)
    platform = np.stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), -rng.uniform(0.08, 0.28, limb_count)], axis=-1)
    push = 300.0 if family == "linear" else None
    limb = ep.Limb("SPS", actuator=ep.Actuator(family, pull_limit=400.0, push_limit=push))
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male")
    return ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=[limb] * limb_count)


def workspace_examples():
    exo = ep.load("four-cables")
    criteria = Criteria(largest_shoulder_force=120.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))
    space = DesignVariables(exo.mechanism, free_joints(4))
    merit = Merit(space, lifting_poses(counts=(2, 2, 2)), criteria)
    check = recheck(exo.mechanism, criteria, finer_step=20.0)
    run = SearchRun(0, [0.5] * 24, 0.3, {"index": 0.8}, 24)
    candidate = Candidate(exo, run, (check,), {"index": 0.8})
    poses = ep.shoulder_rotation([30, 40], [20, 20], [0, 10], degrees=True)
    return [
        criteria,
        exo.workspace(poses, criteria),
        exo.workspace(poses, criteria, centre_offset=[0.01, 0.0, 0.0]),
        PoseOffsets.of([0.01, 0.0, 0.0], poses),
        lifting_poses(counts=(1, 1, 1)).at_centres((None, ep.CentreOffset.together([0.01, 0.0, 0.0]))),
        PoseValues(exo.mechanism, pose_matrices(poses)[1], (2,), criteria, ("forces",)),
        space,
        merit,
        merit.evaluate(np.full(24, 0.4), {}),
        *([_contact_objective(exo, criteria)] if find_spec("myo_sim") else []),
        candidate,
        Optimised((candidate,), (run,), ("index",), ({"index": 0.8},)),
        Descent.__new__(Descent),
        StoredStudy.__new__(StoredStudy),
    ]


def _contact_objective(exo, criteria):
    """One of two poses, of a person whose muscles are known."""
    person = ep.Person(1.75, 75.0, "male")
    return ContactObjective(person, lifting_poses(counts=(1, 1, 1)), type(exo), criteria)
