"""Least-squares programs and their optimality conditions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.errors.checked import checked
from ..core.validation import FloatArray
from .small_linear import RANK_TOLERANCE

__all__ = ["KKT_TOLERANCE", "RANK_TOLERANCE", "LeastSquares", "Solution", "judged"]

#: Largest violation of the optimality conditions, in a program scaled to forces of order 1, of an accepted answer.
KKT_TOLERANCE = 1e-8


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


@checked
def judged(program: LeastSquares, z: FloatArray, equality: FloatArray, inequality: FloatArray) -> Solution:
    """A candidate with its violation of the optimality conditions."""
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
