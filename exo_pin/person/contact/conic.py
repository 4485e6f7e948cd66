"""Small convex cone programs, solved by Clarabel and checked here.

    min ½ xᵀP x + qᵀx   subject to   A x + s = b,   s in a product of cones.

Clarabel is an interior-point solver. Whatever it reports, an answer counts by its own residuals: of the constraints, of
stationarity, and the duality gap, which together prove it optimal.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.optional_packages import optional
from ...core.records import OneProcess
from ...core.validation import FloatArray

#: Residual and duality gap of an accepted answer, in a program scaled to numbers of order 1.
ACCEPTED = 1e-7
#: What Clarabel aims at, first and second time: residuals, gap and regularisation. Its default regularisation of 1e-8
#: limits the gap to about 1e-7 where the socket's rim is touched.
_AIMS = ((1e-9, 1e-11, 1e-12), (1e-8, 1e-9, 1e-8))


class Block(NamedTuple):
    """Rows A x + s = b with s in one cone.

    Attributes
    ----------
    cone : {"zero", "positive", "second_order", "cube"}
        s = 0; s >= 0; s_0 >= |(s_1, ...)|; or s = (t, 1, a) with a³ <= t, a >= 0, for three rows.
    A, b : ndarray
        Shape (k, n) and (k,).
    """

    cone: str
    A: FloatArray
    b: FloatArray


class ConicAnswer(NamedTuple):
    """Answer of a program.

    Attributes
    ----------
    x : ndarray
        Shape (n,).
    active : list of ndarray of bool
        For each block of rows: whether its constraint holds with equality; one number for a cone of several rows.
    kkt : float
        Largest violation of constraints and stationarity.
    gap : float
        Duality gap.
    is_optimal : bool
        Whether both are small enough.
    is_infeasible : bool
        Whether the solver has found a proof that no x meets the constraints.
    """

    x: FloatArray
    active: list[NDArray[np.bool_]]
    kkt: float
    gap: float
    is_optimal: bool
    is_infeasible: bool


class ConicProgram(OneProcess):
    """A program that is built block by block.

    Parameters
    ----------
    P : ndarray
        Shape (n, n), symmetric positive semi-definite.
    q : ndarray
        Shape (n,).

    Raises
    ------
    MissingExtra
        If Clarabel is not installed.
    """

    def __init__(self, P: FloatArray, q: FloatArray) -> None:
        self._clarabel, self._P, self._q = optional("person", "clarabel"), P, q
        self._blocks: list[Block] = []

    def add(self, cone: str, A: FloatArray, b: FloatArray) -> None:
        """Add rows."""
        self._blocks.append(Block(cone, A, b))

    def solve(self) -> ConicAnswer:
        """Solve it. An infeasible program gives an answer whose ``is_optimal`` is False."""
        answer = self._solve(_AIMS[0])
        return answer if answer.is_optimal or answer.is_infeasible else self._solve(_AIMS[1])

    def _solve(self, aim: tuple[float, float, float]) -> ConicAnswer:
        A = np.vstack([block.A for block in self._blocks])
        b = np.concatenate([block.b for block in self._blocks])
        solver = self._clarabel.DefaultSolver(
            scipy.sparse.csc_matrix(np.triu(self._P)),
            self._q,
            scipy.sparse.csc_matrix(A),
            b,
            [_cone(self._clarabel, block) for block in self._blocks],
            _settings(self._clarabel, aim),
        )
        found = solver.solve()
        x, z, s = (np.array(part) for part in (found.x, found.z, found.s))
        # Where the solver has diverged its numbers are as large as they can be, and the answer is not optimal.
        with np.errstate(over="ignore", invalid="ignore"):
            pull = self._P @ x
            gap = abs(float(x @ pull + self._q @ x + b @ z))
            kkt = max(float(np.abs(A @ x + s - b).max()), float(np.abs(pull + self._q + A.T @ z).max()))
            size = max(1.0, abs(float(0.5 * x @ pull + self._q @ x)))
        solved = str(found.status) in ("Solved", "AlmostSolved", "InsufficientProgress")
        finite = bool(np.isfinite(kkt + gap))
        optimal = solved and finite and max(kkt, gap / size) <= ACCEPTED
        return ConicAnswer(x, self._active(s, z), kkt, gap, optimal, str(found.status) == "PrimalInfeasible")

    def _active(self, s: FloatArray, z: FloatArray) -> list[NDArray[np.bool_]]:
        """By strict complementarity: the multiplier is larger than the room."""
        found, start = [], 0
        for block in self._blocks:
            rows = slice(start, start + len(block.b))
            start = rows.stop
            room, push = s[rows], z[rows]
            if block.cone == "second_order":
                room, push = np.array([room[0] - np.linalg.norm(room[1:])]), push[:1]
            found.append(np.asarray(push > room))
        return found


def _cone(clarabel: Any, block: Block) -> Any:
    if block.cone == "cube":
        return clarabel.PowerConeT(1.0 / 3.0)
    kinds = {"zero": "ZeroConeT", "positive": "NonnegativeConeT", "second_order": "SecondOrderConeT"}
    return getattr(clarabel, kinds[block.cone])(len(block.b))


def _settings(clarabel: Any, aim: tuple[float, float, float]) -> Any:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_feas, settings.tol_gap_abs, settings.static_regularization_constant = aim
    settings.tol_gap_rel = settings.tol_gap_abs
    return settings


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
    multipliers = np.zeros(len(rows) + cone)
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
