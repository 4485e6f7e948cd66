"""Examples of the public classes of workspaces and searches."""

import functools
from importlib.util import find_spec

import numpy as np

import exo_pin as ep
from exo_pin.design.actuator_families import family_limits
from exo_pin.load_case.pose_stacks import pose_matrices
from exo_pin.workspace import BodyShape, Criteria, free_joints, lifting_poses, limb_places, recheck
from exo_pin.workspace.evaluation import evaluate_poses
from exo_pin.workspace.optimisation.contact_objective import ContactObjective
from exo_pin.workspace.optimisation.descent import Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Merit
from exo_pin.workspace.optimisation.optimise import _least_contact
from exo_pin.workspace.optimisation.optimised import Candidate, Optimised
from exo_pin.workspace.optimisation.stored_study import Run, StoredStudy
from exo_pin.workspace.optimisation.stroke_fitting import FitOptions


def workspace_examples():
    exo = ep.load("four-cables")
    criteria = Criteria(largest_shoulder_force=120.0, body=BodyShape.from_height(1.75))
    space = DesignVariables(exo.mechanism, free_joints(4))
    merit = Merit(space, lifting_poses(counts=(2, 2, 2)), criteria)
    check = recheck(exo.mechanism, exo.reaction, criteria, finer_step=20.0)
    run = Run(0, [0.5] * 24, 0.3, {"index": 0.8}, 24)
    candidate = Candidate(exo, run, check)
    poses = ep.shoulder_rotation([30, 40], [20, 20], [0, 10], degrees=True)
    return [
        family_limits("cable"),
        criteria,
        exo.workspace(poses, criteria),
        evaluate_poses(exo.mechanism, pose_matrices(poses)[1], (2,), criteria, ("forces",)),
        space,
        merit,
        merit.evaluate(np.full(24, 0.4), {}),
        FitOptions.of_family(exo.mechanism),
        limb_places(exo.limbs[0].actuator, exo.arm, criteria, count=64, step=60.0),
        *([_contact_objective(exo, criteria)] if find_spec("myo_sim") else []),
        candidate,
        Optimised((candidate,), (run,), ("index",)),
        Descent.__new__(Descent),
        StoredStudy.__new__(StoredStudy),
    ]


def _contact_objective(exo, criteria):
    """One of two poses, of a person whose muscles are known."""
    person = ep.Person(1.75, 75.0, "male")
    contact = functools.partial(_least_contact, type(exo))
    return ContactObjective(person, lifting_poses(counts=(1, 1, 1), highest_deg=30.0), contact, criteria)
