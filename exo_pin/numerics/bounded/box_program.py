"""The least shoulder force within bounds by an exact active-set method, compiled, for millions of poses.

    minimise |c + G z|  over  low <= z <= high,     c in space, G of shape (3, m), m small

The force c + G z is unique. Where z is not, that of least norm is taken.

1. The unbounded answer of least norm is the answer if it lies within the bounds.
2. Else bounded-variable least squares (Lawson and Hanson; Stark and Parker, Computational Statistics 10 (1995) 129):
   a set of free variables with independent columns, three at most, is extended by the variable with the largest
   gain, along the part of its column outside the span of the free ones, so that a weak direction is not judged by its
   small gradient. Every round lowers the force, so no set occurs twice and the method ends; a round without gain, by
   rounding, is undone and its variable set aside.
3. If G has not full column rank: the shortest z with this force, by a primal active-set method that moves inside
   {G z unchanged, low <= z <= high}. Variables leave and enter the working set by least index, which excludes a cycle:
   let t be the largest index that enters and leaves in it. When t leaves, its multiplier alone has the wrong sign among
   the indices up to t; when it enters, it alone of them blocks the step p. So the step's slope Σ multiplier_i p_i would
   not be negative, though the step goes downhill.

The duality gap is an upper bound of the distance from the least force; it is computed from the answer alone.

One program of :mod:`exo_pin.numerics.bounded.box_program`, with its optimality conditions.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import kernel
from ...core.errors import InfeasibleBounds, InvalidInput, SolverFailed
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_real
from ..small_linear import RANK_TOLERANCE, least_norm
from ..vectors import along_normals, dot, root, triple
from .box_descent import NO_STEP, Scratch, column, descend, force_of, scratch, shorten, size_of

#: Largest duality gap of an accepted answer, relative to the largest force of the problem.
GAP_TOLERANCE = 1e-8
#: Determinant, relative to the product of the columns' lengths, above which three columns are independent.
_CLEARLY_INDEPENDENT = 1e-6
#: Variables over the force above which their rounding is worth a second pass.
_LARGE = 1e2


# inline=True: handing arrays to a function counts references to each, which takes longer than what it does with them.
@kernel(inline=True)
def _scale(c: Any, low: Any, high: Any) -> float:
    """The largest force of the problem."""
    scale = 0.0
    for j in range(3):
        scale = max(scale, abs(c[j]))
    for i in range(low.shape[0]):
        for bound in (low[i], high[i]):
            if abs(bound) < np.inf:
                scale = max(scale, abs(bound))
    return scale


@kernel(inline=True)
def _unbounded(c: Any, G: Any, z: Any, work: Scratch) -> int:
    """Fill z with the answer of least norm without bounds; return the rank of G."""
    m = G.shape[1]
    if m == 3:
        # Three side forces of a pose away from the singular surface.
        X1, X2, X3 = column(G, 0), column(G, 1), column(G, 2)
        size = root(dot(X1, X1) * dot(X2, X2) * dot(X3, X3))
        if abs(triple(X1, X2, X3)) > _CLEARLY_INDEPENDENT * size:
            z[0], z[1], z[2] = along_normals((c[0], c[1], c[2]), X1, X2, X3)
            return 3
    most = 0.0
    for i in range(m):
        z[i] = 0.0
    for _ in range(2):
        r = force_of(c, G, z)
        work.c[0], work.c[1], work.c[2] = r
        for j in range(3):
            for i in range(m):
                work.A[j, i] = G[j, i]
        rank = least_norm(work.A, work.c, work.goal, RANK_TOLERANCE)
        for i in range(m):
            z[i] += work.goal[i]
            most = max(most, abs(z[i]))
        # Again near the singular surface, where z is large and its rounding would be left over as force.
        if most <= _LARGE * size_of((c[0], c[1], c[2])):
            break
    return rank


@kernel(inline=True)
def _within(z: Any, low: Any, high: Any) -> bool:
    for i in range(z.shape[0]):  # noqa: SIM110 - numba compiles no generators
        if not (low[i] <= z[i] <= high[i]):
            return False
    return True


@kernel(inline=True)
def duality_gap(c: Any, G: Any, low: Any, high: Any, z: Any, scale: float) -> float:
    """Upper bound of the excess of |c + G z| over the least force.

    For every z' within the bounds, force · (c + G z') >= force · c + Σ min(gradient_i low_i, gradient_i high_i), so
    that sum over |force| bounds the least force from below; so does 0. A gradient along an unbounded variable counts
    as zero when it is below 1e-8 of ``scale``, the largest force of the problem.
    """
    r = force_of(c, G, z)
    size = size_of(r)
    if size == 0.0:
        return 0.0
    least = dot(r, (c[0], c[1], c[2]))
    for i in range(G.shape[1]):
        slope = dot(column(G, i), r)
        bound = low[i] if slope > 0.0 else high[i]
        if abs(bound) < np.inf:
            least += slope * bound
        elif abs(slope) > GAP_TOLERANCE * scale:
            return size
    gap = size - least / size
    if not abs(gap) < np.inf:
        return np.inf  # NaN is no answer
    return min(size, max(0.0, gap))


@kernel
def least_bounded(c: Any, G: Any, low: Any, high: Any, z: Any, work: Scratch) -> float:
    """Fill z with the answer and return its duality gap relative to the largest force of the problem.

    Parameters
    ----------
    c, G : ndarray
        Shapes (3,) in N and (3, m), dimensionless.
    low, high : ndarray
        Shape (m,), N, low <= high, infinite where there is no bound.
    z : ndarray
        Shape (m,), N, written.
    work : Scratch
        Scratch for m variables.
    """
    rank = _unbounded(c, G, z, work)
    scale = _scale(c, low, high)
    m = G.shape[1]
    if not _within(z, low, high):
        for i in range(m):
            z[i] = min(max(0.0 if rank < m else z[i], low[i]), high[i])
        descend(c, G, low, high, z, scale, work.mark, work.saved)
        if rank < m:
            size = size_of(force_of(c, G, z))
            for i in range(m):
                work.saved[i] = z[i]
            shorten(c, G, low, high, z, scale, work)
            if not size_of(force_of(c, G, z)) <= size + NO_STEP * scale:
                for i in range(m):
                    z[i] = work.saved[i]
    if scale == 0.0:
        return 0.0
    return duality_gap(c, G, low, high, z, scale) / scale


@kernel(stack=True)
def _solve_stack(c: Any, G: Any, low: Any, high: Any, z: Any, gap: Any) -> None:
    work = scratch(G.shape[2])
    for k in range(c.shape[0]):
        gap[k] = least_bounded(c[k], G[k], low[k], high[k], z[k], work)


class LeastForces(NamedTuple):
    """Answers of :func:`least_forces`, programs along the first axis.

    Attributes
    ----------
    variables : ndarray
        z, shape (N, m), N.
    forces : ndarray
        c + G z, shape (N, 3), N.
    gaps : ndarray
        Shape (N,): :func:`duality_gap` over the largest force of the program.
    """

    variables: FloatArray
    forces: FloatArray
    gaps: FloatArray


@checked
def least_forces(constants: FloatArray, effects: FloatArray, lower: FloatArray, upper: FloatArray) -> LeastForces:
    """Minimise |c + G z| over lower <= z <= upper for many programs at once, without a solver.

    Parameters
    ----------
    constants : ndarray
        c, shape (N, 3), N.
    effects : ndarray
        G, shape (N, 3, m), dimensionless.
    lower, upper : ndarray
        Shape (N, m), N, infinite where there is no bound.

    Returns
    -------
    LeastForces

    Raises
    ------
    InvalidInput
        If shapes do not fit, or something is NaN.
    InfeasibleBounds
        If a lower bound is above its upper bound.
    """
    given = {"constants": constants, "effects": effects, "lower": lower, "upper": upper}
    c, G, low, high = (np.ascontiguousarray(as_real(name, part)) for name, part in given.items())
    if c.ndim != 2 or c.shape[1] != 3 or G.shape[:2] != c.shape or G.ndim != 3:
        raise InvalidInput(f"expected constants (N, 3) and effects (N, 3, m), got {c.shape} and {G.shape}")
    if low.shape != (G.shape[0], G.shape[2]) or high.shape != low.shape:
        raise InvalidInput(f"expected bounds of shape {(G.shape[0], G.shape[2])}, got {low.shape} and {high.shape}")
    if not (np.isfinite(c).all() and np.isfinite(G).all()) or np.isnan(low).any() or np.isnan(high).any():
        raise InvalidInput("expected finite constants and effects, and bounds without NaN")
    crossed = np.flatnonzero((low > high).any(axis=0))
    if crossed.size:
        raise InfeasibleBounds(crossed)
    z, gap = np.empty(low.shape), np.empty(len(c))
    _solve_stack(c, G, low, high, z, gap)
    return LeastForces(z, c + np.einsum("kji,ki->kj", G, z), gap)


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
    InvalidInput
        If shapes do not fit.
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
    size = effect.shape[1:]
    if effect.shape != (*constant.shape, *size) or constant.shape != (3,) or not lower.shape == upper.shape == size:
        got = ", ".join(f"{name} {np.shape(part)}" for name, part in given.items())
        raise InvalidInput(f"expected constant (3,), effect (3, m) and bounds (m,), got {got}")
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
