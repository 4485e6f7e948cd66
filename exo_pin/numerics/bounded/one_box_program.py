"""One program of :mod:`exo_pin.numerics.bounded.box_program`, with its optimality conditions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.errors import SolverFailed
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_real
from ..small_linear import RANK_TOLERANCE
from .box_program import GAP_TOLERANCE, duality_gap, least_forces


class LeastForce(NamedTuple):
    """Answer of :func:`least_force`.

    Attributes
    ----------
    variables : ndarray
        z, shape (m,), N.
    force : ndarray
        c + G z, shape (3,), N.
    residual : float
        Largest violation of the optimality conditions, relative to the force at the start.
    unique : bool
        Whether z is the only minimiser. The force always is.
    gap : float
        Duality gap, N: upper bound of the excess of |force| over the least.
    """

    variables: FloatArray
    force: FloatArray
    residual: float
    unique: bool
    gap: float


@checked
def least_force(constant: FloatArray, effect: FloatArray, lower: FloatArray, upper: FloatArray) -> LeastForce:
    """Minimise |c + G z| over lower <= z <= upper for one program, with its optimality conditions.

    The minimal force is unique, because the program is strictly convex in it; z is unique where no direction
    within the bounds leaves the force unchanged, and is otherwise the minimiser of least norm.

    Parameters
    ----------
    constant, effect, lower, upper : ndarray
        As for :func:`least_forces`, without the first dimension.

    Returns
    -------
    LeastForce

    Raises
    ------
    InfeasibleBounds
        If a lower bound is above its upper bound.
    SolverFailed
        If the optimality conditions hold to no better than 1e-8.

    Notes
    -----
    Source: thesis (D-35), (D-36).
    """
    given = {"constant": constant, "effect": effect, "lower": lower, "upper": upper}
    constant, effect, lower, upper = (as_real(name, part) for name, part in given.items())
    start = constant + effect @ np.clip(np.zeros(effect.shape[1]), lower, upper)
    scale = float(np.linalg.norm(start)) or 1.0
    low, high = lower / scale, upper / scale
    c = constant / scale
    (z,), (force,), _ = least_forces(c[None], effect[None], low[None], high[None])
    gradient = effect.T @ force
    # The projected gradient step vanishes at a minimiser, and only there.
    residual = float(np.abs(np.clip(z - gradient, low, high) - z).max(initial=0.0))
    if not residual <= GAP_TOLERANCE:
        raise SolverFailed("the active-set method", residual, "least shoulder force within bounds")
    # Scaled to a largest force of one.
    gap = scale * float(duality_gap(*(np.array(part, order="C") for part in (c, effect, low, high, z)), 1.0))
    # Scaling back may round a variable on its bound to just beyond it.
    variables = np.clip(z * scale, lower, upper)
    return LeastForce(variables, force * scale, residual, _is_unique(effect, low, high, z, gradient), gap)


def _is_unique(G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray, gradient: FloatArray) -> bool:
    """Whether no direction within the bounds leaves the force as it is.

    Variables on a bound with a multiplier stay there; the others must have independent effects. Variables on a bound
    without a multiplier count as free, so a False may be cautious there, a True never is.
    """
    on_bound = (z <= low) | (z >= high)
    movable = ~(on_bound & (np.abs(gradient) > GAP_TOLERANCE)) & (low < high)
    if not movable.any():
        return True
    values = np.linalg.svd(G[:, movable], compute_uv=False)
    return bool(movable.sum() <= 3 and values[-1] > RANK_TOLERANCE * values[0])
