"""Least force of a linear map within bounds, for one program, with its optimality conditions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.errors import InfeasibleBounds, SolverFailed
from ...core.validation import FloatArray
from ..small_linear import RANK_TOLERANCE
from .active_set import GAP_TOLERANCE, duality_gap, least_forces

__all__ = ["KKT_TOLERANCE", "LeastForce", "least_force"]

#: Largest KKT residual of an accepted answer, relative to the force at the start.
KKT_TOLERANCE = GAP_TOLERANCE


class LeastForce(NamedTuple):
    """Answer of :func:`least_force`.

    Attributes
    ----------
    variables : ndarray
        z, shape (m,), N.
    force : ndarray
        c + G z, shape (3,), N.
    multipliers : ndarray
        Shape (m,), N: gradient of ½|force|² with respect to z; zero inside the bounds, positive on a lower one
        and negative on an upper one (to within the residual).
    residual : float
        Largest violation of the optimality conditions, relative to the force at the start.
    unique : bool
        Whether z is the only minimiser. The force always is.
    gap : float
        Duality gap, N: upper bound of the excess of |force| over the least.
    """

    variables: FloatArray
    force: FloatArray
    multipliers: FloatArray
    residual: float
    unique: bool
    gap: float


def least_force(constant: FloatArray, effect: FloatArray, lower: FloatArray, upper: FloatArray) -> LeastForce:
    """Minimise |c + G z| over lower <= z <= upper.

    The minimal force is unique, because the program is strictly convex in it; z is unique where no direction
    within the bounds leaves the force unchanged, and is otherwise the minimiser of least norm.

    Without active bounds this is a linear least-squares problem and is solved as one; else by the exact active-set
    method of :mod:`exo_pin.numerics.bounded.active_set`. Either answer is certified by its optimality conditions.

    Parameters
    ----------
    constant : ndarray
        c, shape (3,), N.
    effect : ndarray
        G, shape (3, m), dimensionless.
    lower, upper : ndarray
        Shape (m,), N, infinite where there is no bound.

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
    crossed = np.flatnonzero(lower > upper)
    if crossed.size:
        raise InfeasibleBounds(crossed)
    count = effect.shape[1]
    start = np.clip(np.zeros(count), lower, upper)
    scale = float(np.linalg.norm(constant + effect @ start))
    if scale == 0.0 or count == 0:
        force = constant + effect @ start
        return LeastForce(start, force, effect.T @ force, 0.0, count == 0, 0.0)
    c, low, high = constant / scale, lower / scale, upper / scale
    z = _unbounded(c, effect)
    if not ((low <= z) & (z <= high)).all():
        z = least_forces(c[None], effect[None], low[None], high[None]).variables[0]
    # Scaling back may round a variable on its bound to just beyond it.
    variables = np.clip(z * scale, lower, upper)
    force = c + effect @ z
    gradient = effect.T @ force
    # The projected gradient step vanishes at a minimiser, and only there.
    residual = float(np.abs(np.clip(z - gradient, low, high) - z).max())
    if not residual <= KKT_TOLERANCE:
        raise SolverFailed("the active-set method", residual, "least shoulder force within bounds")
    # Scaled to a largest force of one.
    gap = scale * float(duality_gap(*(np.array(part, order="C") for part in (c, effect, low, high, z)), 1.0))
    return LeastForce(
        variables, force * scale, gradient * scale, residual, _is_unique(effect, low, high, z, gradient), gap
    )


def _unbounded(c: FloatArray, G: FloatArray) -> FloatArray:
    """The z of least norm with the least |c + G z|."""
    U, values, Vt = np.linalg.svd(G, full_matrices=False)
    rank = int((values > RANK_TOLERANCE * values[0]).sum())
    inverse = (Vt[:rank].T / values[:rank]) @ U[:, :rank].T
    z = -inverse @ c
    # One refinement: near the singular surface z is large, and its rounding would be left over as force.
    return np.asarray(z - inverse @ (c + G @ z))


def _is_unique(G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray, gradient: FloatArray) -> bool:
    """Whether no direction within the bounds leaves the force as it is.

    Variables on a bound with a multiplier stay there; the others must have independent effects. Variables on a bound
    without a multiplier count as free, so a False may be cautious there, a True never is.
    """
    on_bound = (z <= low) | (z >= high)
    movable = ~(on_bound & (np.abs(gradient) > KKT_TOLERANCE)) & (low < high)
    if not movable.any():
        return True
    values = np.linalg.svd(G[:, movable], compute_uv=False)
    return bool(movable.sum() <= 3 and values[-1] > RANK_TOLERANCE * values[0])
