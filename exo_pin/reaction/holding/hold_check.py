"""Whether the actuators can take the lengths and forces of a pose.

The forces are those of the answer. Where a mechanism of more than three limbs can balance a pose with other tensions
under the same side forces, f = f_answer + N y, the pose can be held if some y meets all limits. For an elastic device
this neglects that the side forces depend on y, and in any query that a glenoid cone may exclude F_s; a query with
``actuator_bounds="design"`` includes both. For a wrist without a shoulder only those y count that leave F_s at zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ...core.validation import FloatArray, ReadOnly
from ...design import Mechanism
from ...numerics.least_force_of_sums import SUMMED, shortest_within
from ...numerics.quadratic import LeastSquares, solve
from .actuator_limits import DesignLimits, ForceLimits, design_limits, length_limits, missing_limits

__all__ = ["HoldCheck", "hold_check"]

#: Share of the largest tension by which a limit may be passed: rounding, and forces that are zero in theory.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class HoldCheck(ReadOnly):
    """Lengths and tensions of a pose, or a stack of shape (...), compared with the limits of the actuators.

    Attributes
    ----------
    can_hold : ndarray of bool
        Shape (...): true only where every limit is known, none is estimated, and all are met.
    violated : ndarray of bool
        Shape (...): whether a limit, known or estimated, is not met.
    unknown : ndarray of bool
        Shape (...): whether the outcome depends on a limit that is missing or estimated.
    length_error : ndarray
        Shape (..., n), m: negative where the limb would be shorter than its stroke allows, positive where longer,
        zero within, NaN where the stroke is not known.
    force_error : ndarray
        Shape (..., n), N: positive where the tension is above the greatest pull, negative where the limb would have to
        push harder than it can, zero within, NaN where the limit is not known.
    tensions : ndarray
        f_i that were checked, shape (..., n), N: those of the answer, or others that balance the pose as well.
    missing, estimated : tuple of str
        Limits of the design that are not known, and limits that are estimates.
    """

    can_hold: NDArray[np.bool_]
    violated: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    length_error: FloatArray
    force_error: FloatArray
    tensions: FloatArray
    missing: tuple[str, ...]
    estimated: tuple[str, ...]

    def reshaped(self, shape: tuple[int, ...]) -> HoldCheck:
        """The same with the stack's shape."""
        arrays: dict[str, Any] = {
            name: value.reshape((*shape, *value.shape[1:]))
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray)
        }
        return replace(self, **arrays)


def hold_check(
    mechanism: Mechanism,
    lengths: FloatArray,
    tensions: FloatArray,
    self_stress: FloatArray,
    answered: NDArray[np.bool_],
    limits: ForceLimits | None = None,
) -> HoldCheck:
    """Compare N poses with the limits of the design.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    lengths, tensions : ndarray
        l_i, m, and f_i, N, shapes (N, n).
    self_stress : ndarray
        Tensions that actuators can choose besides, shape (N, n, k); columns are orthonormal or zero.
    answered : ndarray of bool
        Shape (N,): poses with an answer; the others cannot be held.
    limits : ForceLimits, optional
        Force limits of the query. Where they are finite they replace those of the design. A limb that "only pulls" has
        no finite upper limit, so that of its actuator applies.
    """
    low, high = length_limits(mechanism)
    length_error = np.where(lengths < low, lengths - low, np.where(lengths > high, lengths - high, 0.0))
    length_error[:, np.isnan(low)] = np.nan
    of_force = _joined(design_limits(mechanism, lengths), limits)
    force_error = _force_error(tensions, of_force)
    other = np.flatnonzero(answered & (np.nan_to_num(force_error) != 0.0).any(axis=1))
    if self_stress.shape[2] and other.size:
        tensions = tensions.copy()
        tensions[other] = _redistributed(tensions, self_stress, of_force, other)
        force_error = _force_error(tensions, of_force)
    estimated = _estimated_limbs(mechanism)
    long = np.nan_to_num(length_error) != 0.0
    strong = np.nan_to_num(force_error) != 0.0
    known = ~np.isnan(length_error) & ~np.isnan(force_error)
    sure = ((long & ~estimated) | strong).any(axis=1) | ~answered
    violated = (long | strong).any(axis=1) & answered
    open_ = ~sure & (~known | estimated).any(axis=1)
    return HoldCheck(
        can_hold=answered & ~violated & ~open_,
        violated=violated,
        unknown=open_,
        length_error=np.where(answered[:, None], length_error, np.nan),
        force_error=np.where(answered[:, None], force_error, np.nan),
        tensions=np.where(answered[:, None], tensions, np.nan),
        missing=missing_limits(mechanism, known_forces=not np.isnan([of_force.lower, of_force.upper]).any()),
        estimated=tuple(key for key in mechanism.estimated if ".stroke" in key or ".actuator" in key),
    )


def _joined(own: DesignLimits, given: ForceLimits | None) -> DesignLimits:
    """The limits of a query where they are finite, else the design's."""
    if given is None:
        return own
    return DesignLimits(
        np.where(np.isfinite(given.lower), given.lower, own.lower),
        np.where(np.isfinite(given.upper), given.upper, own.upper),
        np.where(np.isfinite(given.upper), given.upper, own.ceiling),
    )


def _estimated_limbs(mechanism: Mechanism) -> NDArray[np.bool_]:
    """Shape (n,): limbs of which a limit is an estimate."""
    return np.array(
        [
            any(key.startswith((f"limbs[{i}].stroke", f"limbs[{i}].actuator")) for key in mechanism.estimated)
            for i in range(mechanism.limb_count)
        ]
    )


def _force_error(tensions: FloatArray, limits: DesignLimits) -> FloatArray:
    """Shape (N, n), N: as :attr:`HoldCheck.force_error`."""
    slack = _ROUNDING * np.abs(tensions).max(axis=1, initial=0.0)[:, None]
    # A limit that is not known cannot be exceeded, but the ceiling can.
    pushed = np.minimum(tensions - limits.lower + slack, 0.0)
    pulled = np.maximum(tensions - np.where(np.isnan(limits.upper), limits.ceiling, limits.upper) - slack, 0.0)
    error = np.where(np.nan_to_num(pushed) < 0.0, pushed, pulled)
    open_ = (np.isnan(limits.lower) & (tensions < 0.0)) | (np.isnan(limits.upper) & (tensions > 0.0))
    return np.where(open_ & (error == 0.0), np.nan, error)


def _redistributed(
    tensions: FloatArray, self_stress: FloatArray, limits: DesignLimits, rows: NDArray[np.intp]
) -> FloatArray:
    """Tensions of least norm within the limits that balance as well, else the given ones; shape (rows, n)."""
    lower = np.where(np.isnan(limits.lower), -np.inf, limits.lower)[rows]
    upper = np.where(np.isnan(limits.upper), limits.ceiling, limits.upper)[rows]
    f, N = tensions[rows], self_stress[rows]
    out = f.copy()
    if N.shape[2] <= SUMMED:
        shortest_within(f, np.ascontiguousarray(N), lower, upper, out)
        return out
    size = out.shape[1]
    for k in range(len(rows)):
        # Too many limbs for the exact method. The part of f that self-stress cannot change is an equality.
        fixed = scipy.linalg.null_space(N[k].T).T
        none = np.zeros((0, size)), np.zeros(0)
        program = LeastSquares(np.eye(size), np.zeros(size), fixed, fixed @ f[k], lower[k], upper[k], *none)
        answer = solve(program)
        if answer.is_optimal:
            out[k] = answer.z
    return out
