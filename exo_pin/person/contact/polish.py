"""What is made of an interior-point answer: an exact one, and one choice of those that are equally good.

An interior-point answer of a least-effort program is accurate to the square root of its duality gap. On the right
active set, Newton's method reaches rounding in a few steps, so that mirrored and repeated queries agree. Its answer is
taken only if all optimality conditions of the whole program hold.

The effort is a function of the activations alone, the contact force one of three sums. Where they leave limb forces or
activations open, an interior-point solver returns some point of the optimal set, with limb forces as large as their
bounds allow. Here the shortest one is chosen, with the activations (least effort) or the contact force (least contact)
held:

    min Σ_j w_j a_j² + Σ_i (f_i / unit)²    subject to all constraints of the program.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.validation import FloatArray
from .conic import ConicProgram

_STEPS = 12
#: Residual at which Newton's method stops, and by which signs and bounds may be missed.
_CONVERGED, _ROUNDING = 1e-13, 1e-9
#: Singular values below this, of rows scaled to length 1, count as zero.
_OPEN = 1e-9


class EffortProgram(NamedTuple):
    """min Σ w x^p  subject to  A x = b,  C x <= c,  low <= x <= high  and  |(B x + d)_1,2| <= (B x + d)_0, scaled.

    Attributes
    ----------
    weights : ndarray
        Shape (m,); variables beyond m cost nothing.
    power : int
        p.
    A, b, C, c, low, high : ndarray
        Constraints.
    B, d : ndarray
        Shapes (3, k) and (3,): the cone; (0, k) and (0,) if there is none.
    """

    weights: FloatArray
    power: int
    A: FloatArray
    b: FloatArray
    C: FloatArray
    c: FloatArray
    low: FloatArray
    high: FloatArray
    B: FloatArray
    d: FloatArray


class ActiveSet(NamedTuple):
    """Which constraints hold with equality.

    Attributes
    ----------
    lower, upper : ndarray of bool
        Shape (k,): which variables are on their lower bound, and on their upper one.
    rows : ndarray of bool
        Of C x <= c.
    cone : bool
        Whether x is on the surface of the cone.
    """

    lower: NDArray[np.bool_]
    upper: NDArray[np.bool_]
    rows: NDArray[np.bool_]
    cone: bool

    @property
    def is_fixed(self) -> NDArray[np.bool_]:
        """Shape (k,): which variables are on a bound."""
        return self.lower | self.upper


def polished(program: EffortProgram, x: FloatArray, active: ActiveSet) -> tuple[FloatArray, float] | None:
    """The minimiser on the active set and the violation of its optimality conditions; None if it is not optimal."""
    free = ~active.is_fixed
    x = np.where(active.lower, program.low, np.where(active.upper, program.high, x))
    rows = np.vstack([program.A, program.C[active.rows]])
    target = np.concatenate([program.b, program.c[active.rows]])
    cone = active.cone
    multipliers = _first_multipliers(program, x, free, rows, cone)
    miss = np.inf
    for _ in range(_STEPS):
        gradient, curvature = _cost(program, x)
        gap, slope, bend = _surface(program, x) if cone else (0.0, np.zeros_like(x), np.zeros((len(x), len(x))))
        held = np.vstack([rows, slope[None]]) if cone else rows
        residual = np.concatenate(
            [(gradient + held.T @ multipliers)[free], rows @ x - target, np.array([gap] if cone else [])]
        )
        miss = float(np.abs(residual).max(initial=0.0))
        if miss <= _CONVERGED:
            break
        hessian = np.diag(curvature) + (multipliers[-1] * bend if cone else 0.0)
        count, k = int(free.sum()), len(held)
        system = np.zeros((count + k, count + k))
        system[:count, :count] = hessian[np.ix_(free, free)]
        system[:count, count:] = held[:, free].T
        system[count:, :count] = held[:, free]
        step = np.linalg.lstsq(system, -residual)[0]
        if not np.isfinite(step).all():
            return None
        x[free] += step[:count]
        multipliers = multipliers + step[count:]
    kkt = max(miss, _violation(program, x, active, rows, multipliers, cone))
    return (np.clip(x, program.low, program.high), kkt) if kkt <= _ROUNDING else None


def _first_multipliers(
    program: EffortProgram, x: FloatArray, free: NDArray[np.bool_], rows: FloatArray, cone: bool
) -> FloatArray:
    held = np.vstack([rows, _surface(program, x)[1][None]]) if cone else rows
    return np.asarray(np.linalg.lstsq(held[:, free].T, -_cost(program, x)[0][free])[0])


def _cost(program: EffortProgram, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gradient and diagonal of the second derivative."""
    gradient, curvature = np.zeros_like(x), np.zeros_like(x)
    m, p = len(program.weights), program.power
    effort = np.maximum(x[:m], 0.0)
    gradient[:m] = p * program.weights * effort ** (p - 1)
    curvature[:m] = p * (p - 1) * program.weights * (effort if p == 3 else 1.0)
    return gradient, curvature


def _surface(program: EffortProgram, x: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """|v_1,2| - v_0 of the cone, its gradient and second derivative."""
    v = program.B @ x + program.d
    size = float(np.hypot(v[1], v[2]))
    along = v[1:] / max(size, 1e-300)
    slope = along @ program.B[1:] - program.B[0]
    across = np.array([-along[1], along[0]]) @ program.B[1:]
    return size - float(v[0]), slope, np.outer(across, across) / max(size, 1e-300)


def _violation(
    program: EffortProgram, x: FloatArray, active: ActiveSet, rows: FloatArray, multipliers: FloatArray, cone: bool
) -> float:
    """What bounds, inequalities and the signs of their multipliers miss."""
    pull = _cost(program, x)[0] + rows.T @ multipliers[: len(rows)]
    if cone:
        pull = pull + multipliers[-1] * _surface(program, x)[1]
    parts = [program.low - x, x - program.high, program.C @ x - program.c]
    parts += [-pull[active.lower], pull[active.upper]]
    parts += [-multipliers[len(program.A) :]]
    if len(program.d):
        parts.append(np.array([_surface(program, x)[0]]))
    return max(float(part.max(initial=0.0)) for part in parts)


def shortest_choice(effort: EffortProgram, x: FloatArray, held: FloatArray, fixed: NDArray[np.bool_]) -> FloatArray:
    """The shortest of the choices that agree with x in some sums, or x itself if it is the only one.

    Parameters
    ----------
    effort : EffortProgram
        Constraints, with k scaled variables.
    x : ndarray
        Shape (k,), a choice that meets them.
    held : ndarray
        Shape (r, k): sums that stay as they are.
    fixed : ndarray of bool
        Shape (k,): variables on a bound that they cannot leave at the same cost. Without them the choices have room to
        all sides, which an interior-point solver needs.

    Returns
    -------
    ndarray
        Shape (k,); x where the solver finds none that is shorter and meets the constraints as well.
    """
    rows = np.vstack([effort.A, held, np.eye(len(x))[fixed]])
    size = np.linalg.norm(rows, axis=1)
    N = scipy.linalg.null_space(rows[size > 0.0] / size[size > 0.0, None], rcond=_OPEN)
    if not N.shape[1]:
        return x
    # A variable that is held would else be bounded by rounding, and all others with it.
    N[np.linalg.norm(N, axis=1) <= _OPEN] = 0.0
    cost = np.ones(len(x))
    cost[: len(effort.weights)] = effort.weights
    # ½ yᵀ P y + qᵀ y is half of what is made small but for a constant.
    P, q = N.T @ (cost[:, None] * N), N.T @ (cost * x)
    program = ConicProgram(P, q)
    below, above = np.isfinite(effort.low), np.isfinite(effort.high)
    room = np.concatenate([(x - effort.low)[below], (effort.high - x)[above], effort.c - effort.C @ x])
    # x may be outside by rounding.
    moved = np.vstack([-N[below], N[above], effort.C @ N])
    kept = np.abs(moved).max(axis=1) > _OPEN
    program.add("positive", moved[kept], np.maximum(room[kept], 0.0))
    if len(effort.d):
        program.add("second_order", -effort.B @ N, effort.B @ x + effort.d)
    has_bounds = bool(kept.any()) or len(effort.d) > 0
    # A solver that has diverged leaves numbers beyond all size, or none: no comparison holds then.
    with np.errstate(over="ignore", invalid="ignore"):
        found = x + N @ (program.solve().x if has_bounds else np.linalg.solve(P, -q))
        inside = np.clip(found, effort.low, effort.high)
        is_shorter = bool(cost @ inside**2 < cost @ x**2) and bool(np.abs(inside - found).max() <= _OPEN)
    return inside if is_shorter and _outside_of_cone(effort, inside) <= _outside_of_cone(effort, x) + _OPEN else x


def _outside_of_cone(effort: EffortProgram, x: FloatArray) -> float:
    """By how much C x <= c and the cone are missed, 0 if they are met."""
    missed = np.maximum(effort.C @ x - effort.c, 0.0).max(initial=0.0)
    if len(effort.d):
        s = effort.B @ x + effort.d
        missed = max(missed, float(np.linalg.norm(s[1:]) - s[0]))
    return float(missed)
