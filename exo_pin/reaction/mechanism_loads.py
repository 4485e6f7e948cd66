"""What arm and device add to the balance, apart from Pinocchio."""

from __future__ import annotations

import numpy as np

from ..core.validation import FloatArray
from ..design import Mechanism
from ..load_case.arm_loads import carried
from ..load_case.pose_stacks import Query

__all__ = ["arm_loads"]


def arm_loads(mechanism: Mechanism, query: Query) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What arm and device add to the balance, by Newton and Euler in closed form and not through Pinocchio.

    Returns force (N, 3) and moment (N, 3) about O on the whole arm, load included, and the wrench (N, 6) of the
    device's own parts, without the load.

    Source: thesis (D-1), (D-2).
    """
    arm = mechanism.require_arm("weight")
    nothing = np.zeros_like(query.force)
    force, moment = carried(arm, mechanism.gravity, query, query.force, query.moment)
    device = np.zeros((len(force), 6))
    for part in arm.parts:
        if part.device:
            device += np.concatenate(carried(part, mechanism.gravity, query, nothing, nothing), axis=1)
    return force, moment, device
