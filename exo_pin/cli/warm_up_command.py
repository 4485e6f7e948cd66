"""``exo-pin warm-up``: compile ahead of time."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ..control.plant import Plant
from ..core.compiled import compilations, kernels, mode
from ..core.conventions import shoulder_rotation
from ..design import Wearer
from ..exo.loading import load
from ..exo.shoulder_exo import ShoulderExo
from ..load_case import Load
from ..reaction import SPLITS
from ..workspace import Criteria


def run_warm_up(options: argparse.Namespace) -> int:
    """Answer ``exo-pin warm-up`` and return its exit status."""
    with mode("compiled"):
        exo = load("prototype")
        _kinematics(exo)
        _forces(exo)
        _chain(exo)
        _workspaces()
        _plant(exo)
    ready = sum(each.is_ready for each in kernels())
    print(f"{ready} kernels are ready; {compilations()} functions were compiled now")
    return 0


def _poses(count: int) -> Any:
    return shoulder_rotation(np.linspace(20.0, 60.0, count), 10.0, 5.0, degrees=True)


def _kinematics(exo: ShoulderExo) -> None:
    for pose in (_poses(1)[0], _poses(2)):
        state = exo.inverse_kinematics(pose)
        exo.forward_kinematics(state.lengths)
        exo.forward_kinematics_from_base_angles(theta_x=state.base_theta_x)
        exo.forward_kinematics_from_base_angles(theta_y=state.base_theta_y)
        exo.forward_kinematics_from_base_angles(theta_x=state.base_theta_x, theta_y=state.base_theta_y)
        exo.jacobian(pose)
        exo.singularity(pose)


def _forces(exo: ShoulderExo) -> None:
    rigid = [name for name, law in SPLITS.items() if not law.determines_sides]
    for pose in (_poses(1)[0], _poses(2)):
        for split in rigid:
            exo.reaction(pose, split=split)
            exo.reaction(pose, split=split, limits="pull")
        exo.reaction(pose, constraint_bounds="actuator", split="minimal")
    for split in rigid:
        exo.reaction_map(_poses(3), split=split)


def _workspaces() -> None:
    for name in ("prototype", "four-cables"):
        exo = load(name)
        criteria = Criteria(largest_shoulder_force=100.0, wearers=(Wearer(1.75, 75, "male"),))
        exo.workspace(40.0, criteria)
        exo.workspace(_poses(2), criteria, Load(np.array([0.0, 0.0, -5.0])))


def _plant(exo: ShoulderExo) -> None:
    plant = Plant(exo)
    start = plant.rest()
    plant.simulate(lambda t, measured: np.zeros(plant.count), 0.01, start)
    exo.track("abduction", "model", duration=0.02)
    load("four-cables").track("abduction", "model", duration=0.02)


def _chain(exo: ShoulderExo) -> None:
    chain = exo.chain
    q = chain.close(chain.neutral())
    v = np.zeros(chain.model.nv)
    chain.mobility(q)
    chain.inverse_dynamics(q, v, v)
