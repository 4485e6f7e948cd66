"""Whether the actuators can take the lengths and forces of a pose.

The forces are those of the answer: they were chosen within the limits where that is possible
(:func:`exo_pin.reaction.answer.chosen_forces`). What is computed here is by how much limits are missed, for the texts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.results import Result
from ...core.validation import FloatArray, ReadOnly
from ...design import Mechanism
from ..constraints.actuator_limits import LimbLimits


@dataclass(frozen=True, eq=False)
class HoldCheck(Result, ReadOnly):
    """Lengths and tensions of a pose, or a stack of shape (...), compared with the limits of the actuators.

    Attributes
    ----------
    can_hold : ndarray of bool
        Shape (...): true only where every limit is known, none is estimated, and all are met.
    violated : ndarray of bool
        Shape (...): whether a limit, known or estimated, cannot be met.
    unknown : ndarray of bool
        Shape (...): whether the outcome depends on a limit that is missing or estimated, or was not found.
    length_error : ndarray
        Shape (..., n), m: negative where the limb would be shorter than its stroke allows, positive where longer,
        zero within, NaN where the stroke is not known.
    force_error : ndarray
        Shape (..., n), N: positive where the tension is above the greatest pull, negative where the limb would have to
        push harder than it can, zero within, NaN where the limit is not known.
    excess_speed : ndarray
        Shape (..., n), m/s: by how much the limb would have to be faster than its actuator can; zero within.
    tensions : ndarray
        f_i of the answer, shape (..., n), N.
    missing, estimated : tuple of str
        Limits of the design that are not known, and limits that are estimates.
    asked : bool
        Whether the query asked for limits; where it did not, nothing is known.
    drives : tuple of (str, str)
        Name and unit of the effort of each drive that has a name; empty for limbs, which have numbers
        and tensions in N.
    pulls : tuple of bool
        Of these drives: whether the effort is a tension, along a route or in a limb that is counted so; of a slide
        else it pushes where it is positive. All are tensions if left out.
    passive : ndarray of bool or None
        Shape (...): whether a joint without drive would be beyond its limits; None where none has any.
    """

    can_hold: NDArray[np.bool_]
    violated: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    length_error: FloatArray
    force_error: FloatArray
    excess_speed: FloatArray
    tensions: FloatArray
    missing: tuple[str, ...]
    estimated: tuple[str, ...]
    asked: bool = True
    drives: tuple[tuple[str, str], ...] = ()
    pulls: tuple[bool, ...] = ()
    passive: NDArray[np.bool_] | None = None

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
    limits: LimbLimits,
    tensions: FloatArray,
    answered: NDArray[np.bool_],
    unmet: NDArray[np.bool_] | None = None,
    unsolved: NDArray[np.bool_] | bool = False,
) -> HoldCheck:
    """Compare the forces of N poses with their limits; nothing is chosen here.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    limits : LimbLimits
        Of these poses.
    tensions : ndarray
        f_i, shape (N, n), N.
    answered : ndarray of bool
        Shape (N,): poses with an answer; the others cannot be held.
    unmet : ndarray of bool, optional
        Shape (N,): poses that a query found cannot be held; those whose tensions or lengths are beyond a limit if left
        out.
    unsolved : ndarray of bool, optional
        Shape (N,): poses whose equilibrium was not found, although there may be one: nothing is known of them.
    """
    force_error = limits.force_error(tensions)
    estimated = estimated_limbs(mechanism) if limits.asked else np.zeros(mechanism.limb_count, dtype=bool)
    long = np.nan_to_num(limits.length_error) != 0.0
    fast = np.zeros_like(force_error) if limits.excess_speed is None else limits.excess_speed
    strong = (np.nan_to_num(force_error) != 0.0) | (fast != 0.0)
    if unmet is None:
        unmet = (long | strong).any(axis=1) & answered
    known = ~np.isnan(limits.length_error) & ~np.isnan(force_error)
    passive = None
    if limits.passive_error is not None:
        passive = answered & (limits.passive_error > 0.0)
        unmet = unmet | passive
    # Where estimated lengths alone are beyond their limits, the outcome depends on the estimate.
    sure = (unmet & ~(long.any(axis=1) & ~(long & ~estimated).any(axis=1) & ~strong.any(axis=1))) | ~answered
    open_ = ~sure & ((~known | estimated).any(axis=1) | (not limits.asked))
    return HoldCheck(
        can_hold=answered & ~unmet & ~open_,
        violated=unmet,
        unknown=open_ | unsolved,
        length_error=np.where(answered[:, None], limits.length_error, np.nan),
        force_error=np.where(answered[:, None], force_error, np.nan),
        excess_speed=np.where(answered[:, None], fast, np.nan),
        tensions=np.where(answered[:, None], tensions, np.nan),
        missing=missing_limits(mechanism, not (limits.open_below | limits.open_above).any()) if limits.asked else (),
        estimated=_estimates(mechanism) if limits.asked else (),
        asked=limits.asked,
        drives=mechanism.drive_units,
        pulls=_are_tensions(mechanism),
        passive=passive,
    )


def _are_tensions(device: Any) -> tuple[bool, ...]:
    """Whether efforts that have names are tensions; empty for limbs."""
    return tuple(drive.joint is None or drive.pulls for drive in device.limbs) if device.drive_units else ()


def _estimates(mechanism: Mechanism) -> tuple[str, ...]:
    return tuple(key for key in mechanism.estimated if ".stroke" in key or ".actuator" in key)


def estimated_limbs(mechanism: Mechanism) -> NDArray[np.bool_]:
    """Shape (n,): limbs of which a limit is an estimate."""
    keys = _estimates(mechanism)
    names = [(f"limbs[{i}].stroke", f"limbs[{i}].actuator") for i in range(mechanism.limb_count)]
    return np.array([any(key.startswith(own) for key in keys) for own in names])


def missing_limits(mechanism: Mechanism, known_forces: bool = False) -> tuple[str, ...]:
    """Data that are missing for a verdict on every pose, one entry for each quantity, with the limbs that lack it.

    Limits of the forces are left out if all of them are known (``known_forces``), by the design or from a query.
    """
    lacking: dict[str, list[int]] = {}
    for number, limb in enumerate(mechanism.limbs, start=1):
        for quantity in limb.missing_limits(known_forces):
            lacking.setdefault(quantity, []).append(number)
    return tuple(f"{name} of {mechanism.limb_words(numbers)}" for name, numbers in lacking.items())
