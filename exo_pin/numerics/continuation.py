"""Continuation of the solution of nonlinear equations from a known start: a stack of paths at once.

    r(x, λ) = 0,   x = 0 at λ = 0,   to be solved at λ = 1

A step goes along the tangent dx/dλ = -J⁻¹ ∂r/∂λ and is corrected by Newton's method. It is accepted if the corrections
contract and det J has the sign that it had at the start, so that the path stays on its branch (Deuflhard, Newton
Methods for Nonlinear Problems, 2004, chapter 5); else it is halved. Where steps become tiny the path ends: J is
singular there, two solutions meet (a fold), or r has a pole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.validation import FloatArray
from .analytic_vectors import solved

#: First trial step: the whole path.
_FIRST = 1.0
#: Step below which a path has ended.
_SHORTEST = 2.0**-10
#: Newton's corrections in one step, and the largest ratio of each to the one before.
_CORRECTIONS, _CONTRACTION = 7, 0.35
#: First correction of a step, relative to the scale of x, beyond which the step is too long. Longer ones may pass two
#: folds at once, after which det J has its old sign again.
_FARTHEST = 0.03
#: Correction, relative to the scale of x, after which Newton's next one is below rounding.
_NEAR = 1e-9
#: Correction that counts as rounding, relative to the scale of x.
_ROUNDING = 1e-12


#: Equations of rows of a stack. Called with the rows, shape (k,), their x, shape (k, m), and λ, shape (k,), they return
#: r, shape (k, m), J = ∂r/∂x, shape (k, m, m), and ∂r/∂λ, shape (k, m). A row that cannot be evaluated is NaN.
Equations = Callable[[NDArray[np.intp], FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]


class Path(NamedTuple):
    """Ends of N paths.

    Attributes
    ----------
    x : ndarray
        Shape (N, m): the solution at λ = 1, or the last one of the path.
    reached : ndarray
        λ, shape (N,): 1 where the path is complete.
    """

    x: FloatArray
    reached: FloatArray


def follow(equations: Equations, rows: NDArray[np.intp], scale: FloatArray, start: float = 0.0) -> Path:
    """Follow the paths of some rows.

    Parameters
    ----------
    equations : callable
        r, J and ∂r/∂λ; see :data:`Equations`.
    rows : ndarray of int
        Shape (N,), passed to ``equations``.
    scale : ndarray
        Size of a large change of x, shape (m,); an infinite one leaves a component out of the tests of
        the step, for unknowns in which the equations are linear.
    start : float
        λ at which x = 0 solves the equations.

    Returns
    -------
    Path
    """
    count, m = len(rows), len(scale)
    x, at, step = np.zeros((count, m)), np.full(count, start), np.full(count, _FIRST)
    tangent, sign = _state(equations, rows, x, at)
    # Where a path cannot begin the equations are not asked again: they remember what was lacking.
    left = np.flatnonzero(sign != 0.0)
    while left.size:
        goal = np.minimum(at[left] + step[left], 1.0)
        trial = x[left] + tangent[left] * (goal - at[left])[:, None]
        good = np.flatnonzero(_corrected(equations, rows[left], trial, goal, scale))
        slope, side = _state(equations, rows[left[good]], trial[good], goal[good])
        same = side == sign[left[good]]
        good = good[same]
        accepted = left[good]
        x[accepted], at[accepted], tangent[accepted] = trial[good], goal[good], slope[same]
        step[left] *= 0.5
        step[accepted] *= 4.0
        left = left[(at[left] < 1.0) & (step[left] >= _SHORTEST)]
    return Path(x, at)


def _state(
    equations: Equations, rows: NDArray[np.intp], x: FloatArray, at: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Tangent dx/dλ and sign of det J; NaN and zero where J is singular or not finite."""
    if not len(rows):
        return x, at
    _, jacobian, rate = equations(rows, x, at)
    tangent = solved(jacobian, -rate)
    finite = np.asarray(np.isfinite(tangent).all(axis=1))
    return tangent, np.where(
        finite, np.linalg.slogdet(np.where(finite[:, None, None], jacobian, np.eye(len(x[0]))))[0], 0.0
    )


def _corrected(
    equations: Equations, rows: NDArray[np.intp], x: FloatArray, at: FloatArray, scale: FloatArray
) -> NDArray[np.bool_]:
    """Newton's method from x, changed in place; which rows converge by contraction."""
    good, last = np.zeros(len(rows), dtype=bool), np.full(len(rows), np.inf)
    left = np.arange(len(rows))
    for count in range(_CORRECTIONS):
        residual, jacobian, _ = equations(rows[left], x[left], at[left])
        change = solved(jacobian, -residual)
        with np.errstate(invalid="ignore"):
            size = np.asarray(np.abs(change / scale).max(axis=1))
            # Of what is not finite neither holds.
            fits = (size <= _CONTRACTION * last[left]) | (size <= _ROUNDING)
            if count == 0:
                fits = size <= _FARTHEST
        x[left[fits]] += change[fits]
        good[left[fits & (size <= _NEAR)]] = True
        last[left] = size
        left = left[fits & (size > _ROUNDING)]
        if not left.size:
            break
    return good
