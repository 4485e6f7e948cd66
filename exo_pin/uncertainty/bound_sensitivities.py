"""How the least shoulder force changes with the bounds on the side forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import SolverFailed
from ..core.validation import FloatArray
from ..design import Mechanism
from ..load_case import CentreOffset, Load, Motion
from ..numerics.least_force_in_bounds import least_force
from ..numerics.small_linear import RANK_TOLERANCE
from ..reaction.constraints.side_force_bounds import ConstraintBounds, SideForceBounds
from ..wrist.forces.closed_form import STATUS
from ..wrist.forces.displaced import as_offset
from .worst_case import loaded, status_names

__all__ = ["BoundSensitivity", "bound_sensitivity"]

#: Multiplier, relative to |F_s|, below which a bound does not hold the optimum.
_IDLE = 1e-9


@dataclass(frozen=True, eq=False)
class BoundSensitivity:
    """Derivatives of the least shoulder force by the bounds on g, in poses of shape (...).

    At a pose where a bound is just reached, or two of them change places, they are those of one side. Bounds that do
    not hold the optimum have zero.

    Attributes
    ----------
    magnitude : ndarray
        Least |F_s|, shape (...), N.
    by_lower, by_upper : ndarray
        d|F_s| by each bound, shape (..., n), dimensionless: the multiplier of the program over |F_s|; positive for a
        lower bound and negative for an upper one.
    shoulder_force_by_lower, shoulder_force_by_upper : ndarray
        dF_s, shape (..., 3, n), dimensionless.
    status : ndarray of str
        As :attr:`Reaction.status`.
    """

    magnitude: FloatArray
    by_lower: FloatArray
    by_upper: FloatArray
    shoulder_force_by_lower: FloatArray
    shoulder_force_by_upper: FloatArray
    status: NDArray[np.str_]


def bound_sensitivity(
    mechanism: Mechanism,
    orientation: Rotation,
    constraint_bounds: ConstraintBounds,
    motion: Motion | None = None,
    load: Load | None = None,
    centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
) -> BoundSensitivity:
    """Derivatives of the split "minimal" by its bounds, from the multipliers of the quadratic program.

    Parameters
    ----------
    mechanism : Mechanism
        With massless limbs.
    orientation, motion, load, centre_offset
        As :meth:`exo_pin.ShoulderExo.reaction`.
    constraint_bounds : "actuator" or (lower, upper)
        As there; the derivatives are by the bound in N, whatever it was made from.

    Returns
    -------
    BoundSensitivity

    Raises
    ------
    InvalidInput
        If an argument does not fit, or a limb has mass.
    """
    given = loaded(mechanism, orientation, motion, load)
    shape, n = given.query.shape, mechanism.limb_count
    bounds = SideForceBounds(constraint_bounds, shape, n)
    state = given.displaced(mechanism, *as_offset(centre_offset, shape))
    count, upu = len(state.f0), np.flatnonzero(mechanism.is_upu)
    magnitude = np.full(count, np.nan)
    slopes, forces = np.full((2, count, n), np.nan), np.full((2, count, 3, n), np.nan)
    codes = state.status.copy()
    for row in np.flatnonzero(codes < STATUS.index("singular")).tolist():
        stress = state.self_stress[row]
        own = np.full(stress.shape[1], np.inf)
        effect = np.hstack([state.side.directions[row].T @ stress, state.shoulder_of_g[row][:, upu]])
        lower, upper = (side[upu] for side in bounds.at(row, state.f0[row]))
        box = np.concatenate([-own, lower]), np.concatenate([own, upper])
        try:
            solved = least_force(state.shoulder[row], effect, *box)
        except SolverFailed:
            codes[row] = STATUS.index("not_solved")
            continue
        size = float(np.linalg.norm(solved.force))
        magnitude[row], slopes[:, row], forces[:, row] = size, 0.0, 0.0
        largest = float(max(np.abs(state.shoulder[row]).max(), size))
        held = np.abs(solved.multipliers) > _IDLE * largest
        held[: len(own)] = False
        # What is free gives way to a bound that moves, so as to keep |F_s| least.
        free = effect[:, ~held]
        follow = np.eye(3) - free @ np.linalg.pinv(free, rcond=RANK_TOLERANCE)
        for z in np.flatnonzero(held):
            limb, side = upu[z - len(own)], 0 if solved.multipliers[z] > 0.0 else 1
            slopes[side, row, limb] = solved.multipliers[z] / size
            forces[side, row, :, limb] = follow @ effect[:, z]
    return BoundSensitivity(
        magnitude=magnitude.reshape(shape),
        by_lower=slopes[0].reshape(*shape, n),
        by_upper=slopes[1].reshape(*shape, n),
        shoulder_force_by_lower=forces[0].reshape(*shape, 3, n),
        shoulder_force_by_upper=forces[1].reshape(*shape, 3, n),
        status=status_names(codes, np.zeros(count, dtype=bool), shape),
    )
