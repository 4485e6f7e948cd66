"""Small convex quadratic programs, solved by ProxSuite and then brought to rounding on their active set.

    min ½|E z - d|²   subject to   A z = b,   low <= z <= high,   C z <= c

The least-squares form keeps the residual E z - d as variables of its own, which avoids squaring the condition
number. ProxQP finds the answer to a tolerance; a primal active-set method that starts there refines it, with one or two
small linear solves, to optimality conditions at rounding.

Least-squares programs and their optimality conditions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput, SolverFailed
from ..core.errors.checked import checked
from ..core.validation import FloatArray
from .small_linear import RANK_TOLERANCE

__all__ = ["KKT_TOLERANCE", "RANK_TOLERANCE", "LeastSquares", "Solution", "judged", "solve"]

#: Largest violation of the optimality conditions, in a program scaled to forces of order 1, of an accepted answer.
KKT_TOLERANCE = 1e-8


#: Largest distance from a bound, and least multiplier, with which a variable starts on that bound.
_NEAR, _HELD = 1e-6, 1e-9
#: A step, or the wrong sign of a multiplier, below this is rounding.
_ROUNDING = 1e-13
#: A step below this share of z changes no more than its last digit.
_LAST_DIGIT = 1e-16
#: ProxQP takes bounds beyond this as absent.
_INFINITE = 1e20
_STEPS = 60
#: A power of two, so that rounding to its multiples is exact.
_GRID = 2.0**-33
#: Answers that meet the optimality conditions to this are as good as each other.
_SAME = 1e-12


@checked
@dataclass(frozen=True, eq=False)
class LeastSquares:
    """A program, scaled so that its forces are of order 1.

    Attributes
    ----------
    E, d : ndarray
        Shapes (p, m) and (p,): the objective, |E z - d|.
    A, b : ndarray
        Shapes (q, m) and (q,): equalities.
    low, high : ndarray
        Shape (m,), infinite where there is no bound; no ``low`` above its ``high``.
    C, c : ndarray
        Shapes (k, m) and (k,): inequalities C z <= c, infinite where there is no limit.
    """

    E: FloatArray
    d: FloatArray
    A: FloatArray
    b: FloatArray
    low: FloatArray
    high: FloatArray
    C: FloatArray
    c: FloatArray

    @property
    def size(self) -> int:
        """Number of variables m."""
        return self.E.shape[1]

    def violation(self, z: FloatArray) -> float:
        """Largest violation of the constraints by ``z``."""
        _require_length("z", z, self.size)
        misses = (np.abs(self.A @ z - self.b), self.low - z, z - self.high, self.C @ z - self.c)
        return max(0.0, *(float(part.max(initial=0.0)) for part in misses))


class Solution(NamedTuple):
    """Answer of :func:`solve`.

    Attributes
    ----------
    z : ndarray
        Shape (m,).
    residual : ndarray
        E z - d, shape (p,); unique, unlike z.
    equality : ndarray
        Multipliers of A z = b, of orthonormal rows that span those of A, shape (at most q,).
    inequality : ndarray
        Multipliers of C z <= c, shape (k,), zero or positive to within ``kkt``.
    bound : ndarray
        Multipliers of the bounds, shape (m,): positive on an upper one, negative on a lower one.
    kkt : float
        Largest violation of the optimality conditions: stationarity holds by the choice of ``bound``, which
        leaves the constraints, the signs of the multipliers and complementarity.
    gap : float
        Duality gap of ½|E z - d|²: upper bound of its excess over the least value.
    unique : bool
        Whether z is the only minimiser. False may be cautious at a degenerate vertex, True never is.
    """

    z: FloatArray
    residual: FloatArray
    equality: FloatArray
    inequality: FloatArray
    bound: FloatArray
    kkt: float
    gap: float
    unique: bool

    @property
    def is_optimal(self) -> bool:
        """Whether the optimality conditions hold to :data:`KKT_TOLERANCE`."""
        return self.kkt <= KKT_TOLERANCE

    @property
    def residual_gap(self) -> float:
        """Upper bound of |r| - |r*| with r* the least residual: 2 gap / |r|, and no more than |r| itself."""
        size = float(np.linalg.norm(self.residual))
        return min(size, 2.0 * self.gap / size) if size > 0.0 else 0.0


def _require_length(name: str, value: FloatArray, length: int) -> None:
    if np.shape(value) != (length,):
        raise InvalidInput(f"expected {name} to have shape ({length},), got {np.shape(value)}")


@checked
def judged(program: LeastSquares, z: FloatArray, equality: FloatArray, inequality: FloatArray) -> Solution:
    """A candidate with its violation of the optimality conditions."""
    _require_length("equality", equality, len(program.b))
    _require_length("inequality", inequality, len(program.c))
    _require_length("z", z, program.size)
    residual = program.E @ z - program.d
    bound = -(program.E.T @ residual + program.A.T @ equality + program.C.T @ inequality)
    # Complementarity in the form min(multiplier, room) = 0, so that both are lengths of order 1.
    above, below = np.maximum(bound, 0.0), np.maximum(-bound, 0.0)
    room_above, room_below = np.maximum(program.high - z, 0.0), np.maximum(z - program.low, 0.0)
    slack = np.maximum(program.c - program.C @ z, 0.0)
    parts = (
        np.minimum(above, room_above),
        np.minimum(below, room_below),
        np.minimum(np.maximum(inequality, 0.0), slack),
        np.maximum(-inequality, 0.0),
    )
    kkt = max(program.violation(z), *(float(part.max(initial=0.0)) for part in parts))
    if not np.isfinite(z).all():
        kkt = np.inf
    gap = _gap(program, residual, equality, np.maximum(inequality, 0.0))
    return Solution(z, residual, equality, inequality, bound, kkt, gap, _is_unique(program, inequality, bound))


def _gap(program: LeastSquares, residual: FloatArray, equality: FloatArray, inequality: FloatArray) -> float:
    """½|r|² less the dual value -½|r|² - r·d - λ·b - ν·c + inf over the bounds of (Eᵀr + Aᵀλ + Cᵀν)·z.

    A multiplier on a missing bound counts as zero when it is below the tolerance; above it the gap is infinite.
    """
    pull = program.E.T @ residual + program.A.T @ equality + program.C.T @ inequality
    open_end = np.where(pull > 0, np.isinf(program.low), np.isinf(program.high))
    if (open_end & (np.abs(pull) > KKT_TOLERANCE)).any():
        return np.inf
    reach = np.where(pull > 0, program.low, program.high)
    reach = np.where(open_end, 0.0, reach)
    held = inequality > 0.0  # a side that is no limit, infinite, has no part in it
    dual = -0.5 * residual @ residual - residual @ program.d - equality @ program.b
    dual -= inequality[held] @ program.c[held]
    return max(0.0, float(0.5 * residual @ residual - dual - pull @ reach))


def _is_unique(program: LeastSquares, inequality: FloatArray, bound: FloatArray) -> bool:
    """Whether no direction keeps residual, equalities and all constraints that carry a multiplier."""
    held = np.abs(bound) > KKT_TOLERANCE
    movable = ~held & (program.low < program.high)
    if not movable.any():
        return True
    rows = np.vstack([program.E, program.A, program.C[inequality > KKT_TOLERANCE]])[:, movable]
    count = int(movable.sum())
    if len(rows) < count:
        return False
    values = np.linalg.svd(rows, compute_uv=False)
    return bool(values[-1] > RANK_TOLERANCE * values[0])


@checked
def solve(program: LeastSquares, shortest: bool = True) -> Solution:
    """Solve a program; where several z are best, take the one of least norm if ``shortest``.

    An infeasible program gives a solution whose ``is_optimal`` is False; that is no proof of infeasibility.

    Raises
    ------
    SolverFailed
        If a number of the program is NaN, or infinite where it is not a limit.
    """
    terms = (program.E, program.d, program.A, program.b, program.C)
    limits = (program.low, program.high, program.c)
    if not all(np.isfinite(part).all() for part in terms) or any(np.isnan(part).any() for part in limits):
        raise SolverFailed("the quadratic program", np.inf, "its numbers are not finite")
    program = _orthonormal(program)
    first = _solve(program)
    if first.unique or not shortest or not first.is_optimal:
        return first
    # The least residual is known now; among all z that reach it, the shortest one is unique.
    size = program.size
    A, b = np.vstack([program.A, program.E]), np.concatenate([program.b, program.E @ first.z])
    again = replace(program, E=np.eye(size), d=np.zeros(size), A=A, b=b)
    second = judged(program, _solve(_orthonormal(again)).z, first.equality, first.inequality)
    return second if second.is_optimal else first


def _orthonormal(program: LeastSquares) -> LeastSquares:
    """The same program with orthonormal equality rows.

    Near a singular pose the rows of A are almost dependent, and their multipliers would be so large that rounding alone
    spoils the optimality conditions.
    """
    if not len(program.b):
        return program
    U, values, Vt = np.linalg.svd(program.A, full_matrices=False)
    significant = values > RANK_TOLERANCE * values[0]
    return replace(program, A=Vt[significant], b=(U[:, significant].T @ program.b) / values[significant])


def _solve(program: LeastSquares) -> Solution:
    start = _proxqp(program)
    rounded = [_without_noise(part) for part in start]
    rounded[0] = np.clip(rounded[0], program.low, program.high)
    answer = _from(program, *rounded)
    if answer.kkt <= _SAME:
        return answer
    return min((answer, _from(program, *start)), key=_quality)


def _without_noise(values: FloatArray) -> FloatArray:
    """Numbers to about 1e-10, ProxQP's own accuracy: its last digits differ from call to call on the same program."""
    return np.asarray(np.round(values / _GRID) * _GRID)


def _quality(answer: Solution) -> tuple[float, float]:
    return answer.kkt, answer.gap


def _from(
    program: LeastSquares, z: FloatArray, equality: FloatArray, inequality: FloatArray, bound: FloatArray
) -> Solution:
    """The best that is found from an approximate answer."""
    best, side, rows = _walk(program, z, equality, inequality, bound)
    best = min((best, judged(program, z, equality, inequality)), key=_quality)
    again = _on_working_set(program, side, rows)
    as_good = again.kkt <= max(10.0 * best.kkt, _SAME) and again.gap <= max(10.0 * best.gap, _SAME)
    return again if as_good else best


def _on_working_set(program: LeastSquares, side: NDArray[np.int64], rows: NDArray[np.bool_]) -> Solution:
    """The shortest minimiser on a working set, computed from that alone.

    It does not depend on the last digits of ProxQP's answer.
    """
    z = np.where(side < 0, program.low, np.where(side > 0, program.high, 0.0))
    for _ in range(3):  # the second and third time for the rounding of an ill-conditioned step
        step = _step(program, z, side == 0, rows)
        z = z + step
        if np.abs(step).max(initial=0.0) <= _LAST_DIGIT * np.abs(z).max(initial=1.0):
            break
    none = np.zeros(len(program.b)), np.zeros(len(program.c))
    return judged(program, z, *_multipliers(program, z, side == 0, rows, *none))


def _proxqp(program: LeastSquares) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """z, multipliers of equalities and inequalities, and of the bounds, by ProxQP."""
    p, m = program.E.shape
    q, k = len(program.b), len(program.c)
    H, A = np.zeros((p + m, p + m)), np.zeros((p + q, p + m))
    H[:p, :p] = A[:p, :p] = np.eye(p)
    A[:p, p:], A[p:, p:] = -program.E, program.A
    low, high = np.full(p + m, -_INFINITE), np.full(p + m, _INFINITE)
    low[p:], high[p:] = np.maximum(program.low, -_INFINITE), np.minimum(program.high, _INFINITE)
    from proxsuite import proxqp  # here, because few queries need it

    solver = proxqp.dense.QP(p + m, p + q, k, True)
    solver.settings.eps_abs = 1e-10
    solver.settings.eps_rel = 0.0
    solver.settings.max_iter = 300
    # With its default of 1e-4 ProxQP declares nearly infeasible programs infeasible and stops.
    solver.settings.eps_primal_inf = solver.settings.eps_dual_inf = 0.0
    rows = (np.hstack([np.zeros((k, p)), program.C]), np.full(k, -_INFINITE), program.c) if k else (None, None, None)
    solver.init(H, np.zeros(p + m), A, np.concatenate([-program.d, program.b]), *rows, low, high)
    solver.solve()
    z = np.clip(np.nan_to_num(solver.results.x[p:]), program.low, program.high)
    dual = np.nan_to_num(solver.results.z)
    return z, np.nan_to_num(solver.results.y[p:]), np.maximum(dual[:k], 0.0), dual[k + p :]


def _walk(
    program: LeastSquares, z: FloatArray, equality: FloatArray, inequality: FloatArray, bound: FloatArray
) -> tuple[Solution, NDArray[np.int64], NDArray[np.bool_]]:
    """Primal active-set method from ProxQP's answer, with its constraints as the first working set.

    Returns the last point and working set: sides (-1 on the lower bound, 1 on the upper one, 0 inside) and rows. The
    point depends on rounding, the working set does not.
    """
    z = z.copy()
    fixed = program.low == program.high
    on_low = fixed | ((bound < -_HELD) & (z <= program.low + _NEAR))
    on_high = ~fixed & (bound > _HELD) & (z >= program.high - _NEAR)
    side = on_high.astype(np.int64) - on_low
    rows = (inequality > _HELD) & (program.C @ z >= program.c - _NEAR)
    for _ in range(_STEPS):
        z = np.where(side < 0, program.low, np.where(side > 0, program.high, z))
        step = _step(program, z, side == 0, rows)
        reach, bound_hit, row_hit = _ratio_test(program, z, step, side, rows)
        z = z + reach * step
        if bound_hit >= 0:
            side[bound_hit] = np.sign(step[bound_hit])
            continue
        if row_hit >= 0:
            rows[row_hit] = True
            continue
        equality, inequality = _multipliers(program, z, side == 0, rows, equality, inequality)
        answer = judged(program, z, equality, inequality)
        helpful = _blocks_equalities(program, z, side, fixed)
        if helpful >= 0:
            side[helpful] = 0
            continue
        # Release the constraint with the most negative multiplier.
        wrong_bound = np.where(fixed, 0.0, -side * answer.bound)
        wrong_row = np.where(rows, -inequality, 0.0)
        worst = max(wrong_bound.max(), wrong_row.max(initial=0.0))
        if worst <= _ROUNDING:
            break
        if wrong_bound.max() == worst:
            side[int(wrong_bound.argmax())] = 0
        else:
            rows[int(wrong_row.argmax())] = False
    return judged(program, z, equality, inequality), side, rows


def _blocks_equalities(program: LeastSquares, z: FloatArray, side: NDArray[np.int64], fixed: NDArray[np.bool_]) -> int:
    """A variable that must leave its bound for the equalities to hold; -1 if they do, or if none would help.

    ProxQP may stop short on an ill-conditioned program, with active bounds for which the equalities have no solution.
    """
    miss = program.b - program.A @ z
    size = float(np.abs(miss).max(initial=0.0))
    if size <= _ROUNDING * float(np.abs(z).max(initial=1.0)):
        return -1
    gain = np.where(fixed, 0.0, -side * (program.A.T @ (miss / size)))
    best = int(gain.argmax())
    return best if gain[best] > 1e-10 else -1


def _step(program: LeastSquares, z: FloatArray, free: NDArray[np.bool_], rows: NDArray[np.bool_]) -> FloatArray:
    """Shortest step to the minimiser on the working set."""
    step = np.zeros(program.size)
    if not free.any():
        return step
    held = np.vstack([program.A, program.C[rows]])[:, free]
    miss = np.concatenate([program.b - program.A @ z, (program.c - program.C @ z)[rows]])
    E = program.E[:, free]
    basis = np.eye(E.shape[1])
    inside = np.zeros(E.shape[1])
    if len(held):
        U, values, Vt = np.linalg.svd(held)
        rank = int((values > RANK_TOLERANCE * values[0]).sum())
        inside = Vt[:rank].T @ ((U[:, :rank].T @ miss) / values[:rank])
        basis = Vt[rank:].T
    if basis.shape[1]:
        target = program.d - program.E @ z - E @ inside
        inside = inside + basis @ np.linalg.lstsq(E @ basis, target, rcond=RANK_TOLERANCE)[0]
    step[free] = inside
    return step


def _ratio_test(
    program: LeastSquares, z: FloatArray, step: FloatArray, side: NDArray[np.int64], rows: NDArray[np.bool_]
) -> tuple[float, int, int]:
    """Share of a step that stays feasible, and the bound or the row that stops it (-1 for none)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        room = np.where(step < 0, (program.low - z) / step, (program.high - z) / step)
        room[(side != 0) | (np.abs(step) <= _ROUNDING)] = np.inf
        climb = program.C @ step
        ahead = (program.c - program.C @ z) / climb
        ahead[rows | (climb <= _ROUNDING)] = np.inf
    first, second = room.min(initial=np.inf), ahead.min(initial=np.inf)
    if min(first, second) >= 1.0:
        return 1.0, -1, -1
    if first <= second:
        return max(0.0, float(first)), int(room.argmin()), -1
    return max(0.0, float(second)), -1, int(ahead.argmin())


def _multipliers(
    program: LeastSquares,
    z: FloatArray,
    free: NDArray[np.bool_],
    rows: NDArray[np.bool_],
    equality: FloatArray,
    inequality: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Multipliers of the working set that make the free variables stationary, nearest to the given ones."""
    start = np.concatenate([equality, inequality[rows]])
    held = np.vstack([program.A, program.C[rows]])
    gradient = program.E.T @ (program.E @ z - program.d)
    if len(start) and free.any():
        for _ in range(2):  # the second time for the rounding of the first
            miss = gradient[free] + held[:, free].T @ start
            start = start - np.linalg.lstsq(held[:, free].T, miss, rcond=RANK_TOLERANCE)[0]
    out = np.zeros_like(inequality)
    out[rows] = start[len(equality) :]
    return start[: len(equality)], out
