"""Weight, inertia and applied loads of the arm, over stacks of poses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.compiled import kernel
from ..core.validation import FloatArray
from ..design import Arm, Mechanism
from ..numerics.vectors import applied_load, inertia_load, matrix, vector, weight_load

if TYPE_CHECKING:
    from .pose_stacks import Query

__all__ = ["applied_stack", "arm_load", "arm_loads", "carried"]


@kernel(stack=True)
def arm_load(
    R: Any,
    mass: float,
    centre: Any,
    inertia: Any,
    gravity: Any,
    velocity: Any,
    acceleration: Any,
    force: Any,
    moment: Any,
    F: Any,
    M: Any,
) -> None:
    """Add weight and inertia to the load on the arm: what limbs and shoulder together must carry.

    F = force + m (g - a_C) and M = moment + C × m g - (I η + ω × I ω), base frame, moments about O; see
    :func:`exo_pin.numerics.vectors.inertia_load`.

    Parameters
    ----------
    R, velocity, acceleration, force, moment, F, M : ndarray
        Stacks, shapes (N, 3, 3) and (N, 3); F and M are written.
    mass, centre, inertia, gravity : float or ndarray
        Of the arm: kg, m in {O_B}, kg m² about O in {O_B}; m/s² in the base frame.
    """
    c, I, g = vector(centre.reshape(1, 3), 0), matrix(inertia), vector(gravity.reshape(1, 3), 0)  # noqa: E741
    for k in range(R.shape[0]):
        pose = matrix(R[k])
        C, W, MW = weight_load(pose, mass, c, g)
        FI, MI = inertia_load(pose, mass, C, I, vector(velocity, k), vector(acceleration, k))
        for j in range(3):
            F[k, j] = force[k, j] + W[j] + FI[j]
            M[k, j] = moment[k, j] + MW[j] + MI[j]


@kernel(stack=True)
def applied_stack(R: Any, force: Any, couple: Any, at: Any, in_arm: bool, F: Any, M: Any) -> None:
    """:func:`exo_pin.numerics.vectors.applied_load` over a stack: F and M, shape (N, 3), are written."""
    for k in range(R.shape[0]):
        F_k, M_k = applied_load(matrix(R[k]), vector(force, k), vector(couple, k), vector(at, k), in_arm)
        for j in range(3):
            F[k, j], M[k, j] = F_k[j], M_k[j]


def carried(
    body: Arm, gravity: FloatArray, query: Query, force: FloatArray, moment: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force and moment about O, shape (N, 3) each: weight and inertia of a body that turns with the arm, and a load.

    At rest the inertia does not enter, so it may be unknown; a motion needs it.
    """
    total_force, total_moment = np.empty_like(force), np.empty_like(moment)
    arm_load(
        query.matrices,
        body.mass,
        body.centre_of_mass,
        np.zeros((3, 3)) if body.inertia is None else body.inertia_about_origin,
        gravity,
        query.velocity,
        query.acceleration,
        force,
        moment,
        total_force,
        total_moment,
    )
    return total_force, total_moment


def arm_loads(mechanism: Mechanism, query: Query) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What arm and device add to the balance, by Newton and Euler in closed form and not through Pinocchio.

    Returns force (N, 3) and moment (N, 3) about O on the whole arm, load included, and the wrench (N, 6) of the
    device's own parts, without the load.
    """
    arm = mechanism.require_arm("weight")
    nothing = np.zeros_like(query.force)
    force, moment = carried(arm, mechanism.gravity, query, query.force, query.moment)
    device = np.zeros((len(force), 6))
    for part in arm.parts:
        if part.device:
            device += np.concatenate(carried(part, mechanism.gravity, query, nothing, nothing), axis=1)
    return force, moment, device
