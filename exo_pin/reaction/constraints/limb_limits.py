"""Limits of the limb forces f_i, in the forms a caller may give them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import ExoPinError, InvalidInput, MissingData
from ...core.validation import LARGEST, FloatArray, as_choice, as_pair
from ...design import Mechanism
from ...wrist.forces.wrench_feasibility import force_bounds
from ..holding.actuator_limits import DesignActuators, ForceLimits
from .side_force_bounds import two_ends

__all__ = ["ActuatorBounds", "ForceLimited", "PressureActuator", "as_force_limits", "each_limb"]


@runtime_checkable
class ForceLimited(Protocol):
    """Anything that gives the force limits of a limb at a length."""

    def force_limits(self, length: FloatArray) -> tuple[ArrayLike, ArrayLike]:
        """Least and greatest f_i, shape (...), N, at limb lengths l_i = |A_i B_i|, shape (...), m.

        A length that the actuator cannot take is reported by NaN, by a masked entry, or by raising a child of
        ExoPinError.
        """
        ...


@runtime_checkable
class PressureActuator(ForceLimited, Protocol):
    """A pneumatic muscle in a limb. Lengths are those of the whole limb, |A_i B_i|; pressures are gauge, Pa."""

    def pressure_for(self, force: FloatArray, length: FloatArray) -> ArrayLike:
        """Pressure at which the limb pulls ``force``, shape (...), Pa."""
        ...

    def stiffness(self, length: FloatArray, pressure: FloatArray) -> ArrayLike:
        """df/dl at constant pressure, shape (...), N/m; positive where a longer muscle pulls harder."""
        ...


#: None, "pull", "design" (what the design's actuators can do), a number N for (-N, N), a pair
#: (lower, upper) in N, an object with ``force_limits``, or one such object a limb.
ActuatorBounds = (
    str | float | tuple[ArrayLike, ArrayLike] | ForceLimited | Sequence[ForceLimited] | DesignActuators | None
)


def as_force_limits(
    bounds: ActuatorBounds, mechanism: Mechanism, shape: tuple[int, ...], lengths: Callable[[], FloatArray]
) -> ForceLimits:
    """Limits of f for every pose of a stack.

    Parameters
    ----------
    bounds : ActuatorBounds
        None: none. "pull": f_i >= 0. "design": what the mechanism's own actuators can do. A number N: |f_i| <= N. A
        pair in N: numbers or arrays that broadcast to (..., n), infinite where there is no limit. An object with
        ``force_limits(length)``, or a sequence of n of them: what the actuators can do at their lengths.
    mechanism : Mechanism
        The design.
    shape : tuple of int
        Stack shape (...), N poses in all.
    lengths : callable
        Returns l_i, shape (N, n), m; called only where actuators are given.

    Returns
    -------
    ForceLimits

    Raises
    ------
    InvalidInput
        If the limits do not fit; InfeasibleBounds if a lower one is above its upper one.
    MissingData
        If an actuator lacks what it needs, such as the length of its end fitting.
    """
    limb_count = mechanism.limb_count
    bounds = (-np.inf, np.inf) if bounds is None else as_pair("actuator_bounds", bounds)
    if isinstance(bounds, str):
        pull = as_choice("actuator bound", bounds, ("pull", "design")) == "pull"
        bounds = (0.0, np.inf) if pull else DesignActuators(mechanism)
    if isinstance(bounds, DesignActuators):
        return bounds.limits(lengths())
    if _is_actuators(bounds):
        actuators, own = each_limb(bounds, limb_count, ForceLimited, "force_limits(length)"), lengths()
        limits = np.array([_limits(actuator, i, own[:, i]) for i, actuator in enumerate(actuators)])
        limits[:, :, np.isnan(limits).any(axis=(0, 1))] = np.nan
        return ForceLimits(limits[:, 0].T.copy(), limits[:, 1].T.copy())
    forms = 'actuator_bounds to be None, "pull", "design", N, (lower, upper) in N, or objects with force_limits(length)'
    return ForceLimits(*force_bounds("actuator_bounds", *two_ends(bounds, forms), shape, limb_count))


def _is_actuators(bounds: Any) -> bool:
    if isinstance(bounds, ForceLimited):
        return True
    return isinstance(bounds, (list, tuple)) and len(bounds) > 0 and any(hasattr(b, "force_limits") for b in bounds)


def each_limb(given: Any, limb_count: int, protocol: type, needs: str) -> list[Any]:
    """One actuator a limb, from one for all or a sequence of them.

    Raises
    ------
    InvalidInput
        If there are not as many as limbs, or one does not follow ``protocol``.
    """
    actuators = list(given) if isinstance(given, (list, tuple)) else [given] * limb_count
    if len(actuators) != limb_count:
        raise InvalidInput(f"expected {limb_count} actuators, one a limb, got {len(actuators)}")
    for i, actuator in enumerate(actuators):
        if not isinstance(actuator, protocol):
            raise InvalidInput(f"expected actuator {i} to have {needs}, got {type(actuator).__name__}")
    return actuators


def _limits(actuator: ForceLimited, limb: int, lengths: FloatArray) -> FloatArray:
    """Limits of one limb over all poses, shape (2, N); NaN where its actuator cannot take the length."""
    lower, upper = ends = in_reach(actuator.force_limits, 2, lengths)
    if (np.isfinite(ends) & (np.abs(ends) > LARGEST)).any():
        raise InvalidInput(f"expected force_limits of actuator {limb} in N, got more than {LARGEST:g}")
    if (np.isposinf(lower) | np.isneginf(upper)).any():
        raise InvalidInput(f"force_limits of actuator {limb} gave limits that no force can meet")
    if (lower > upper).any():
        raise InvalidInput(f"force_limits of actuator {limb} gave a lower limit above its upper limit")
    return ends


def in_reach(call: Any, outputs: int, *arguments: FloatArray) -> FloatArray:
    """Evaluate an actuator for a stack, and pose by pose where it refuses the stack as a whole.

    Parameters
    ----------
    call : callable
        Takes the arguments, returns ``outputs`` arrays (or one array, for 1).
    outputs : int
        Number of arrays.
    *arguments : ndarray
        Shape (N,) each.

    Returns
    -------
    ndarray
        Shape (outputs, N); NaN where the actuator refused, by raising a child of ExoPinError.

    Raises
    ------
    MissingData
        If the actuator lacks what it needs.
    InvalidInput
        If its results are not numbers of the expected shape.
    """
    count = len(arguments[0])
    whole = _evaluated(call, outputs, arguments)
    if whole is not None:
        return whole
    out = np.full((outputs, count), np.nan)
    for row in range(count):
        single = _evaluated(call, outputs, tuple(values[row : row + 1] for values in arguments))
        if single is not None:
            out[:, row] = single[:, 0]
    return out


def _evaluated(call: Any, outputs: int, arguments: tuple[FloatArray, ...]) -> FloatArray | None:
    """Answer of an actuator, shape (outputs, N); None if it refuses.

    Raises
    ------
    MissingData
        If it lacks what it needs.
    InvalidInput
        If its results are not numbers of the expected shape.
    """
    try:
        raw = call(*arguments)
    except MissingData:
        raise
    except ExoPinError:
        return None
    try:
        parts = (raw,) if outputs == 1 else tuple(raw)
        filled = [np.ma.filled(np.ma.asarray(part, dtype=np.float64), np.nan) for part in parts]
        spread = [np.broadcast_to(part, arguments[0].shape) for part in filled]
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"expected numbers of shape {arguments[0].shape} from an actuator: {error}") from error
    if len(spread) != outputs:
        raise InvalidInput(f"expected {outputs} arrays from an actuator, got {len(spread)}")
    return np.stack(spread)
