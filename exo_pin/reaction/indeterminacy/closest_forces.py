"""Forces within the limits that come closest to equilibrium."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...core.validation import FloatArray

if TYPE_CHECKING:
    from ..result import Reaction


class ClosestForces(NamedTuple):
    """Forces within all limits, for a pose or a stack of shape (...).

    Attributes
    ----------
    actuator_forces, constraint_forces : ndarray
        f and g, shape (..., n), N.
    cuff_wrench : ndarray
        Shape (..., 6): force, N, and moment about O, N m, of the cuff on the person's arm, base frame.
    """

    actuator_forces: FloatArray
    constraint_forces: FloatArray
    cuff_wrench: FloatArray


def closest_forces(answer: Reaction) -> ClosestForces:
    """See :attr:`exo_pin.Reaction.closest`."""
    f, g, cuff = (np.array(a) for a in (answer.actuator_forces, answer.constraint_forces, answer.cuff_wrench))
    if answer.infeasibility is not None:
        rows = answer.infeasibility.infeasible
        near = answer.infeasibility
        change_f = np.where(rows[..., None], near.closest_actuator_forces - f, 0.0)
        change_g = np.where(rows[..., None], near.closest_constraint_forces - g, 0.0)
        f, g = f + change_f, g + change_g
        flat = (a.reshape(-1, a.shape[-1]) for a in (change_f, change_g))
        cuff = cuff + answer.source.poses.state.on_arm_of(*flat).sum(axis=-2).reshape(cuff.shape)
    # Where nothing was found within the limits there is nothing to give.
    evidence = False if answer.infeasibility is None else answer.infeasibility.infeasible
    lost = ~answer.held & (np.nan_to_num(answer.limits.force_error) != 0.0).any(axis=-1) & ~np.asarray(evidence)
    for force in (f, g, cuff):
        force[lost] = np.nan
    return ClosestForces(f, g, cuff)
