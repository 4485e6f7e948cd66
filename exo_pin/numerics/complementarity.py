"""Bounded linear complementarity problems with a symmetric positive semidefinite matrix, exact on their active set.

    w = A f + c,   low <= f <= high,   w_i >= 0 where f_i = low_i,   w_i <= 0 where f_i = high_i,   w_i = 0 in between

These are the optimality conditions of ½ fᵀA f + cᵀf within the bounds. They are solved by a primal active-set method:
every step minimises over the free variables, or runs along a direction without curvature to the next bound. A may be
singular: then w is unique, and f may not be.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.errors import SolverFailed
from ..core.records import keeps_read_only
from ..core.validation import FloatArray

#: Error of the conditions, A's diagonal scaled to about one, as a share of the largest term, that counts as
#: rounding; that of an accepted answer; singular values of A below this share of the largest count as zero.
_ROUNDING, _ACCEPTED, _RANK = 1e-12, 1e-9, 1e-12
#: A pivot is the variable with the largest error in the first steps, then the first one (Bland), which cannot cycle;
#: the number of all steps guards against an error in the proof.
_STEPS, _MOST = 20, 10_000


@keeps_read_only
class Complementarity(NamedTuple):
    """Answer of :func:`bounded_complementarity`.

    Attributes
    ----------
    force : ndarray
        f, shape (n,), exactly on a bound where it is active.
    rate : ndarray
        w = A f + c, shape (n,), exactly zero where f is between its bounds.
    unique : ndarray of bool
        Shape (n,), which components of f are the same in every answer. False may be cautious, True never is.
    residual : float
        Largest error of the conditions, A's diagonal scaled to about one, as a share of the largest term.
    bounded : bool
        False if no f meets the conditions: w stays negative however large f becomes.
    """

    force: FloatArray
    rate: FloatArray
    unique: NDArray[np.bool_]
    residual: float
    bounded: bool


def bounded_complementarity(A: FloatArray, c: FloatArray, low: FloatArray, high: FloatArray) -> Complementarity:
    """Solve a problem.

    Parameters
    ----------
    A, c : ndarray
        Shapes (n, n), symmetric and positive semidefinite, and (n,).
    low, high : ndarray
        Shape (n,), infinite where there is no bound; no ``low`` above its ``high``.

    Raises
    ------
    SolverFailed
        If the conditions hold to no better than 1e-9, A or c is not finite, or a bound is NaN.
    """
    if not (np.isfinite(A).all() and np.isfinite(c).all()):
        raise SolverFailed("the complementarity problem", np.inf, "A or c is not finite")
    if np.isnan(low).any() or np.isnan(high).any():
        raise SolverFailed("the complementarity problem", np.inf, "a bound is NaN")
    # Forces in units that make the diagonal about one; immovable rows keep theirs.
    diagonal = np.diag(A)
    immovable = diagonal <= _RANK**2 * diagonal.max(initial=0.0)
    # Powers of two, so that bounds are exact.
    unit = np.exp2(np.round(0.5 * np.log2(np.where(immovable, 1.0, diagonal))))
    A, c = A / unit / unit[:, None], c / unit
    A[immovable] = 0.0
    A[:, immovable] = 0.0
    low, high = low * unit, high * unit
    f, bounded, inner = _walk(A, c, low, high)
    w = A @ f + c
    size = _size(A, c, f)
    at_low, at_high = f == low, f == high
    wrong = np.where(at_low & at_high, 0.0, np.where(at_low, -w, np.where(at_high, w, np.abs(w))))
    residual = max(0.0, float(wrong.max())) / size if size > 0.0 else 0.0
    if bounded and not residual <= _ACCEPTED:
        raise SolverFailed("the complementarity problem", residual, "the optimality conditions do not hold")
    open_to_change = (np.abs(w) <= _ROUNDING * size) & (low < high)
    unique = np.ones(len(c), dtype=np.bool_)
    if open_to_change.any():
        values, ways = np.linalg.eigh(A[np.ix_(open_to_change, open_to_change)])
        idle = ways[:, values <= _RANK * values[-1]]
        unique[open_to_change] = np.abs(idle).max(axis=1, initial=0.0) <= 1e-6
    return Complementarity(f / unit, np.where(inner, 0.0, w * unit), unique, residual, bounded)


def _walk(
    A: FloatArray, c: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, bool, NDArray[np.bool_]]:
    """f, whether the conditions can be met, and the variables between their bounds."""
    f = np.clip(np.zeros(len(c)), low, high)
    free = (low < f) & (f < high)
    for step in range(_MOST):
        # Minimise over the free variables; each pass fixes one more of them.
        while free.any():
            way, whole = _descent(A[np.ix_(free, free)], (A @ f + c)[free], _size(A, c, f))
            room = np.where(way > 0.0, high[free], low[free]) - f[free]
            share = np.divide(room, way, out=np.full(len(way), np.inf), where=way != 0.0)
            first = int(share.argmin())
            if share[first] >= 1.0 and whole:
                f[free] += way
                break
            if not np.isfinite(share[first]):
                return f, False, free
            f[free] = np.clip(f[free] + max(share[first], 0.0) * way, low[free], high[free])
            index = np.flatnonzero(free)[first]
            f[index] = high[index] if way[first] > 0.0 else low[index]
            free[index] = False
        w = A @ f + c
        wrong = np.where(free | (low == high), 0.0, np.where(f == low, -w, w))
        tolerance = _ROUNDING * _size(A, c, f)
        candidates = np.flatnonzero(wrong > tolerance)
        if not len(candidates):
            return f, True, free
        free[candidates[0] if step >= _STEPS else candidates[wrong[candidates].argmax()]] = True
    raise SolverFailed("the complementarity problem", float(wrong.max()), "too many steps")


def _size(A: FloatArray, c: FloatArray, f: FloatArray) -> float:
    """Largest term of w."""
    return max(float(np.abs(c).max(initial=0.0)), float((np.abs(A) @ np.abs(f)).max(initial=0.0)))


def _descent(A: FloatArray, w: FloatArray, size: float) -> tuple[FloatArray, bool]:
    """Step to the minimum over all variables (True), or a direction without curvature that descends (False)."""
    values, ways = np.linalg.eigh(A)
    curved = values > _RANK * values[-1]
    parts = ways.T @ w
    idle = ways[:, ~curved] @ parts[~curved]
    if np.abs(idle).max() > 10.0 * _ROUNDING * size:
        return -idle, False
    return -ways[:, curved] @ (parts[curved] / values[curved]), True
