"""One choice of many that are equally good.

The effort is a function of the activations alone, the contact force one of three sums. Where they leave limb forces or
activations open, an interior-point solver returns some point of the optimal set, with limb forces as large as their
bounds allow. Here the shortest one is chosen, with the activations (least effort) or the contact force (least contact)
held:

    min Σ_j w_j a_j² + Σ_i (f_i / unit)²    subject to all constraints of the program.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.validation import FloatArray
from .conic import ConicProgram
from .polish import EffortProgram

__all__ = ["shortest_choice"]

#: Singular values below this, of rows scaled to length 1, count as zero.
_OPEN = 1e-9


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
    # Twice the costs, so that ½ yᵀ P y + qᵀ y is what is made small but for a constant.
    P, q = 2.0 * N.T @ (cost[:, None] * N), 2.0 * N.T @ (cost * x)
    program = ConicProgram(P, q)
    below, above = np.isfinite(effort.low), np.isfinite(effort.high)
    room = np.concatenate([(x - effort.low)[below], (effort.high - x)[above], effort.c - effort.C @ x])
    # x may be outside by rounding.
    moved = np.vstack([-N[below], N[above], effort.C @ N])
    kept = np.abs(moved).max(axis=1) > _OPEN
    program.add("positive", moved[kept], np.maximum(room[kept], 0.0))
    if effort.B is not None and effort.d is not None:
        program.add("second_order", -effort.B @ N, effort.B @ x + effort.d)
    has_bounds = bool(kept.any()) or effort.B is not None
    found = x + N @ (program.solve().x if has_bounds else np.linalg.solve(P, -q))
    inside = np.clip(found, effort.low, effort.high)
    is_shorter = bool(cost @ inside**2 < cost @ x**2) and bool(np.abs(inside - found).max() <= _OPEN)
    return inside if is_shorter and _outside_of_cone(effort, inside) <= _outside_of_cone(effort, x) + _OPEN else x


def _outside_of_cone(effort: EffortProgram, x: FloatArray) -> float:
    """By how much C x <= c and the cone are missed, 0 if they are met."""
    missed = np.maximum(effort.C @ x - effort.c, 0.0).max(initial=0.0)
    if effort.B is not None and effort.d is not None:
        s = effort.B @ x + effort.d
        missed = max(missed, float(np.linalg.norm(s[1:]) - s[0]))
    return float(missed)
