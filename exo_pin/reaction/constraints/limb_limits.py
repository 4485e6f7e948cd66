"""Limits of the limb forces f_i, in the forms a caller may give them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import ExoPinError, InvalidInput, MissingData
from ...core.validation import LARGEST, FloatArray, as_choice, as_pair
from ...design import Mechanism
from ...wrist.forces.wrench_feasibility import force_bounds
from .actuator_limits import LimbLimits
from .side_force_bounds import two_ends


@runtime_checkable
class ForceLimited(Protocol):
    """Anything that gives the force limits of a limb at a length.

    Examples
    --------
    >>> class Winch:
    ...     def force_limits(self, length):  # stronger where its cable is short
    ...         return 0.0 * length, 60.0 / length
    >>> exo = ep.load("four-cables")
    >>> exo.reaction(exo.pose(60), limits=Winch()).can_hold.item()
    True
    """

    def force_limits(self, length: FloatArray) -> tuple[ArrayLike, ArrayLike]:
        """Least and greatest f_i, shape (...), N, at limb lengths l_i = |A_i B_i|, shape (...), m.

        A length that the actuator cannot take is reported by NaN, by a masked entry, or by raising a child of
        ExoPinError.
        """
        ...


#: "design" (what the design's actuators can do), "none", "pull", a number N for (-N, N), a pair (lower, upper) in N, an
#: object with ``force_limits``, or one such object a limb.
Limits = str | float | tuple[ArrayLike, ArrayLike] | ForceLimited | Sequence[ForceLimited]

_WORDS = ("design", "none", "pull")
_FORMS = 'limits to be "design", "none", "pull", N, (lower, upper) in N, or objects with force_limits(length)'


def as_limb_limits(
    limits: Limits, mechanism: Mechanism, shape: tuple[int, ...], lengths: Callable[[], FloatArray]
) -> LimbLimits:
    """Limits of lengths and forces for every pose of a stack.

    Parameters
    ----------
    limits : Limits
        "design": what the mechanism's own actuators can do; a limb whose actuator is not known has no limits. "none":
        no limits. "pull": f_i >= 0 besides. A number N: |f_i| <= N besides. A pair in N: numbers or arrays that
        broadcast to (..., n), infinite where there is no further limit. These narrow the design's limits and never
        widen them. An object with ``force_limits(length)``, or a sequence of n of them, takes the place of the
        design's actuators, strokes included.
    mechanism : Mechanism
        The design.
    shape : tuple of int
        Stack shape (...), N poses in all.
    lengths : callable
        Returns l_i, shape (N, n), m.

    Returns
    -------
    LimbLimits

    Raises
    ------
    InvalidInput
        If the limits do not fit; InfeasibleBounds if a lower one is above its upper one.
    MissingData
        If a given actuator lacks what it needs, such as the length of its end fitting.
    """
    limb_count = mechanism.limb_count
    if limits is None:
        raise InvalidInput(f"expected {_FORMS}, got None")
    given = as_pair("limits", limits)
    if isinstance(given, str):
        word = as_choice("limits", given, _WORDS)
        if word == "none":
            return LimbLimits.none((math.prod(shape), limb_count))
        own = LimbLimits.of_design(mechanism, lengths())
        return own if word == "design" else own.narrowed(np.zeros_like(own.lower), np.full_like(own.upper, np.inf))
    if are_actuators(given):
        actuators, own_lengths = _each_limb(given, limb_count), lengths()
        ends = np.array([_limits(actuator, i, own_lengths[:, i]) for i, actuator in enumerate(actuators)])
        lower, upper = ends[:, 0].T.copy(), ends[:, 1].T.copy()
        lost = np.isnan(lower) | np.isnan(upper)
        lower[lost], upper[lost] = -np.inf, np.inf
        return LimbLimits(lower, upper, lost, lost, np.where(lost, np.inf, 0.0))
    lower, upper = force_bounds("limits", *two_ends(given, _FORMS), shape, limb_count)
    return LimbLimits.of_design(mechanism, lengths()).narrowed(lower, upper)


def are_actuators(bounds: Any) -> bool:
    """Whether limits are given by actuators, which take the place of the design's."""
    if isinstance(bounds, ForceLimited):
        return True
    return isinstance(bounds, (list, tuple)) and len(bounds) > 0 and any(hasattr(b, "force_limits") for b in bounds)


class _GivenForce(NamedTuple):
    """An actuator whose force is known in each of N poses, shape (N,), N."""

    force: FloatArray

    def force_limits(self, length: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The force itself, as both limits."""
        return self.force, self.force


def given_forces(tensions: FloatArray) -> list[ForceLimited]:
    """Limits that leave no choice but these tensions, shape (N, n), N, such as those of a simulation."""
    return [_GivenForce(column) for column in tensions.T]


def _each_limb(given: Any, limb_count: int) -> list[ForceLimited]:
    """One actuator a limb, from one for all or a sequence of them."""
    actuators = list(given) if isinstance(given, (list, tuple)) else [given] * limb_count
    if len(actuators) != limb_count:
        raise InvalidInput(f"expected {limb_count} actuators, one a limb, got {len(actuators)}")
    for i, actuator in enumerate(actuators):
        if not isinstance(actuator, ForceLimited):
            raise InvalidInput(f"expected actuator {i} to have force_limits(length), got {type(actuator).__name__}")
    return actuators


def _limits(actuator: ForceLimited, limb: int, lengths: FloatArray) -> FloatArray:
    """Limits of one limb over all poses, shape (2, N); NaN where its actuator cannot take the length."""
    lower, upper = ends = _in_reach(actuator.force_limits, lengths)
    if (np.isfinite(ends) & (np.abs(ends) > LARGEST)).any():
        raise InvalidInput(f"expected force_limits of actuator {limb} in N, got more than {LARGEST:g}")
    if (np.isposinf(lower) | np.isneginf(upper)).any():
        raise InvalidInput(f"force_limits of actuator {limb} gave limits that no force can meet")
    if (lower > upper).any():
        raise InvalidInput(f"force_limits of actuator {limb} gave a lower limit above its upper limit")
    return ends


def _in_reach(limits: Callable[[FloatArray], Any], lengths: FloatArray) -> FloatArray:
    """Limits of an actuator for a stack, shape (2, N), pose by pose where it refuses the stack; NaN where it refuses.

    Raises
    ------
    MissingData
        If the actuator lacks what it needs.
    InvalidInput
        If its results are not numbers of the expected shape.
    """
    whole = _evaluated(limits, lengths)
    if whole is not None:
        return whole
    out = np.full((2, len(lengths)), np.nan)
    for row in range(len(lengths)):
        single = _evaluated(limits, lengths[row : row + 1])
        if single is not None:
            out[:, row] = single[:, 0]
    return out


def _evaluated(limits: Callable[[FloatArray], Any], lengths: FloatArray) -> FloatArray | None:
    """Answer of an actuator, shape (2, N); None if it refuses, by raising a child of ExoPinError."""
    try:
        raw = limits(lengths)
    except MissingData:
        raise
    except ExoPinError:
        return None
    try:
        filled = [np.ma.filled(np.ma.asarray(part, dtype=np.float64), np.nan) for part in tuple(raw)]
        spread = [np.broadcast_to(part, lengths.shape) for part in filled]
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"expected numbers of shape {lengths.shape} from an actuator: {error}") from error
    if len(spread) != 2:
        raise InvalidInput(f"expected 2 arrays from an actuator, got {len(spread)}")
    return np.stack(spread)
