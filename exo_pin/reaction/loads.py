"""What arm and device add to the balance, apart from Pinocchio."""

from __future__ import annotations

import numpy as np

from ..design import Arm, Mechanism
from ..validation import FloatArray
from ..wrist.loads import arm_load
from ..wrist.stacks import Query

__all__ = ["arm_loads"]


def arm_loads(mechanism: Mechanism, query: Query) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What arm and device add to the balance, by Newton and Euler in closed form and not through Pinocchio.

    Returns force (N, 3) and moment (N, 3) about O on the whole arm, load included, and the wrench (N, 6) of the
    device's own parts, without the load.
    """
    arm = mechanism.require_arm("weight")
    nothing = np.zeros_like(query.force)
    force, moment = _carried(arm, mechanism.gravity, query, query.force, query.moment)
    device = np.zeros((len(force), 6))
    for part in arm.parts:
        if part.device:
            device += np.concatenate(_carried(part, mechanism.gravity, query, nothing, nothing), axis=1)
    return force, moment, device


def _carried(
    body: Arm, gravity: FloatArray, query: Query, force: FloatArray, moment: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Weight, inertia and load of a body that turns with the arm: force and moment about O, shape (N, 3) each."""
    total_force, total_moment = np.empty_like(force), np.empty_like(moment)
    inertia = np.zeros((3, 3)) if body.inertia is None else body.inertia_about_origin
    arm_load(
        query.matrices,
        body.mass,
        body.centre_of_mass,
        inertia,
        gravity,
        query.velocity,
        query.acceleration,
        force,
        moment,
        total_force,
        total_moment,
    )
    return total_force, total_moment
