"""The quadratic program behind the least shoulder force."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import InfeasibleBounds, SolverFailed
from ...core.validation import FloatArray
from ...numerics import active_set
from ...numerics.active_set import GAP_TOLERANCE
from ...numerics.small_linear import RANK_TOLERANCE

__all__ = ["LeastForce", "least_force"]

#: Largest KKT residual, relative to the force before the variables lower it, with which an answer is given.
KKT_TOLERANCE = GAP_TOLERANCE
#: How far from a bound, relative to the largest force, ProxQP's answer may be and still count as on it.
_ACTIVE = 1e-6
#: Gap, relative to the largest force, above which the answer is sought once more by another method.
_GAP = 1e-10
#: ProxQP reads bounds beyond this as absent.
_INFINITE = 1e20


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
        Largest violation of the optimality conditions, relative to the force before the variables lower it.
    unique : bool
        Whether z is the only minimiser. The force always is.
    """

    variables: FloatArray
    force: FloatArray
    multipliers: FloatArray
    residual: float
    unique: bool


def least_force(constant: FloatArray, effect: FloatArray, lower: FloatArray, upper: FloatArray) -> LeastForce:
    """Minimise |c + G z| over lower <= z <= upper.

    The minimal force is unique, because the program is strictly convex in it; z is unique where no direction
    within the bounds leaves the force unchanged, and is otherwise the minimiser of least norm.

    Without bounds this is a linear least-squares problem and is solved as one. With bounds ProxSuite solves

        min ½|y|²  subject to  y - G z = c,  lower <= z <= upper,

    with the force y as a variable of its own, which spares the condition number its square; then the equations
    of the active set that it found are solved once more directly, which brings the answer to rounding.

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
        If a lower bound stands above its upper bound.
    SolverFailed
        If the optimality conditions hold to no better than 1e-8.
    """
    crossed = np.flatnonzero(lower > upper)
    if crossed.size:
        raise InfeasibleBounds(crossed)
    count = effect.shape[1]
    start = np.clip(np.zeros(count), lower, upper)
    scale = float(np.linalg.norm(constant + effect @ start))
    if scale == 0.0 or count == 0:
        force = constant + effect @ start
        return LeastForce(start, force, effect.T @ force, 0.0, count == 0)
    values = np.asarray(np.linalg.svd(effect, compute_uv=False), dtype=np.float64)
    full_rank = bool(count <= 3 and values[-1] > RANK_TOLERANCE * values[0])
    low, high = _relevant(constant, effect, lower, upper, values, scale)
    c = constant / scale
    z = _unbounded(c, effect)
    if not ((low <= z) & (z <= high)).all():
        z = _bounded(c, effect, low, high, full_rank)
    force, gradient, residual = _optimality(c, effect, low, high, z)
    if not residual <= KKT_TOLERANCE:
        raise SolverFailed("ProxQP", residual, "least shoulder force within bounds")
    unique = full_rank or _is_unique(effect, low, high, z, gradient)
    # Scaling back may round a variable on its bound to just beyond it.
    return LeastForce(np.clip(z * scale, lower, upper), force * scale, gradient * scale, residual, unique)


def _relevant(
    c: FloatArray, G: FloatArray, lower: FloatArray, upper: FloatArray, values: FloatArray, scale: float
) -> tuple[FloatArray, FloatArray]:
    """Bounds over ``scale``, with those that no answer can reach taken away.

    People write 1e6 or 1e12 N for "no bound"; kept, such a number would swallow the digits of the others. With G of
    full column rank an answer z has |c + G z| <= |c + G z_0| for any z_0 within the bounds, so
    |z| <= (|c| + |c + G z_0|) / σ_min, and bounds beyond that do not matter. Otherwise the answers of least norm lie
    within the same reach with the smallest singular value that counts, enlarged by the bounds that are near.
    """
    counting = values[values > RANK_TOLERANCE * values[0]]
    reach = (float(np.linalg.norm(c)) + scale) / float(counting[-1]) * 2.0
    if counting.size < G.shape[1]:
        near = np.concatenate([bound[np.abs(bound) < 10 * reach] for bound in (lower, upper)])
        reach = 10.0 * (reach + float(np.linalg.norm(near)))
    low = np.where(lower < -reach, -np.inf, lower) / scale
    high = np.where(upper > reach, np.inf, upper) / scale
    return low, high


def _unbounded(c: FloatArray, G: FloatArray) -> FloatArray:
    z = np.linalg.lstsq(G, -c, rcond=RANK_TOLERANCE)[0]
    # One refinement: near the singular surface z is large, and its rounding would be left over as force.
    return np.asarray(z - np.linalg.lstsq(G, c + G @ z, rcond=RANK_TOLERANCE)[0], dtype=np.float64)


def _bounded(c: FloatArray, G: FloatArray, low: FloatArray, high: FloatArray, full_rank: bool) -> FloatArray:
    count = G.shape[1]
    weights = np.zeros(3 + count)
    weights[:3] = 1.0
    z = _proxqp(np.diag(weights), np.hstack([np.eye(3), -G]), c, low, high)
    z = _polished(c, G, low, high, z)
    if duality_gap(c, G, low, high, z) > _GAP:
        z = _along_weak_direction(c, G, low, high, z)
    if not full_rank:
        # Several z give the least force: take the one of least norm, so that the answer is reproducible.
        force = c + G @ z
        shorter = _proxqp(np.diag(1.0 - weights), np.hstack([np.eye(3), -G]), c, low, high, force=force)
        shorter = _shortest(force - c, G, low, high, shorter)
        if _optimality(c, G, low, high, shorter)[2] <= 10.0 * _optimality(c, G, low, high, z)[2] + 1e-13:
            z = shorter
    return z


def _shortest(force: FloatArray, G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray) -> FloatArray:
    """The z of least norm with G z = force on the active set that ``z`` points to.

    Of ProxQP's answer only the active set is used: its last digits differ from call to call.
    """
    at_low, at_high = z <= low + _ACTIVE, z >= high - _ACTIVE
    inside = ~(at_low | at_high)
    shortest = np.where(at_low, low, np.where(at_high, high, 0.0))
    for _ in range(2 * bool(inside.any())):  # the second time for the rounding of the first
        shortest[inside] += np.linalg.lstsq(G[:, inside], force - G @ shortest, rcond=RANK_TOLERANCE)[0]
    return shortest


def duality_gap(c: FloatArray, G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray) -> float:
    """By how much |c + G z| can at most exceed the least force; see :func:`exo_pin.numerics.active_set.duality_gap`.

    The problem is scaled to a largest force of one.
    """
    return float(active_set.duality_gap(*(np.array(part, order="C") for part in (c, G, low, high, z)), 1.0))


def _along_weak_direction(c: FloatArray, G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray) -> FloatArray:
    """Follow a direction that hardly changes the force as far as it pays.

    There the gradient is too small for a tolerance to see it, though the bounds may leave a long way to go; SciPy's
    bounded-variable least squares works on active sets and not on tolerances.
    """
    movable = low < high
    if not movable.any():
        return z
    other = z.copy()
    target = -(c + G[:, ~movable] @ z[~movable])
    other[movable] = scipy.optimize.lsq_linear(
        G[:, movable], target, (low[movable], high[movable]), method="bvls", tol=1e-15
    ).x
    other = np.clip(other, low, high)
    return min((z, other), key=lambda point: float(np.linalg.norm(c + G @ point)))


def _proxqp(
    H: FloatArray, A: FloatArray, c: FloatArray, low: FloatArray, high: FloatArray, force: FloatArray | None = None
) -> FloatArray:
    """Solve over (y, z), with y fixed to ``force`` if that is given; return z within the bounds."""
    size = len(H)
    box_low, box_high = np.full(size, -_INFINITE), np.full(size, _INFINITE)
    box_low[3:], box_high[3:] = np.maximum(low, -_INFINITE), np.minimum(high, _INFINITE)
    if force is not None:
        box_low[:3] = box_high[:3] = force
    from proxsuite import proxqp  # here, because few queries need it

    program = proxqp.dense.QP(size, 3, 0, True)
    program.settings.eps_abs = 1e-10
    program.settings.eps_rel = 0.0
    program.settings.max_iter = 2000
    program.init(H, np.zeros(size), A, c, None, None, None, box_low, box_high)
    program.solve()
    return np.clip(program.results.x[3:], low, high)


def _optimality(
    c: FloatArray, G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Force, gradient, and the largest violation of the optimality conditions."""
    force = c + G @ z
    gradient = G.T @ force
    # The projected gradient step vanishes at a minimiser, and only there.
    step = np.clip(z - gradient, low, high) - z
    outside = np.maximum(np.maximum(low - z, z - high), 0.0)
    residual = float(max(np.abs(step).max(initial=0.0), outside.max(initial=0.0)))
    return force, gradient, residual if np.isfinite(z).all() else np.inf


def _polished(c: FloatArray, G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray) -> FloatArray:
    """Solve the equations of the active set that ``z`` points to; keep whichever is nearer to optimal."""
    at_low, at_high = z <= low + _ACTIVE, z >= high - _ACTIVE
    free = ~(at_low | at_high)
    candidate = np.where(at_low, low, np.where(at_high, high, z))
    if free.any():
        rest = c + G[:, ~free] @ candidate[~free]
        candidate[free] = np.linalg.lstsq(G[:, free], -rest, rcond=RANK_TOLERANCE)[0]
    candidate = np.clip(candidate, low, high)
    return min((candidate, z), key=lambda point: _optimality(c, G, low, high, point)[2])


def _is_unique(G: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray, gradient: FloatArray) -> bool:
    """Whether no direction within the bounds leaves the force as it is.

    Variables on a bound with a multiplier stay there; the others must have independent effects. Variables on a bound
    without a multiplier count as free, so a False may be cautious there, a True never is.
    """
    on_bound: NDArray[np.bool_] = (z <= low + _ACTIVE) | (z >= high - _ACTIVE)
    movable = ~(on_bound & (np.abs(gradient) > KKT_TOLERANCE)) & (low < high)
    if not movable.any():
        return True
    values = np.linalg.svd(G[:, movable], compute_uv=False)
    return bool(movable.sum() <= 3 and values[-1] > RANK_TOLERANCE * values[0])
