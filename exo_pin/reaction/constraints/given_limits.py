"""Limits of the limb forces f_i and bounds on the side forces g_i, in the forms a caller may give them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import ExoPinError, InfeasibleBounds, InvalidInput, MissingData, NonConvexBound, UnknownName
from ...core.errors.base import echo
from ...core.validation import LARGEST, FloatArray, as_choice, as_pair, as_real
from ...design import Mechanism
from ...load_case.pose_stacks import Rows
from ...wrist.forces.wrench_feasibility import force_bounds
from .actuator_limits import LimbLimits

#: None, the word "actuator", a number N for (-N, N), or a pair (lower, upper) of numbers or arrays in N.
ConstraintBounds = str | float | tuple[ArrayLike, ArrayLike] | None


class SideForceBounds:
    """Bounds on g for every pose of a stack.

    Parameters
    ----------
    bounds : None, "actuator", number or (lower, upper)
        None: no bound. "actuator": |g_i| <= |f_i|. A number: |g_i| at most that, N. A pair in N: numbers, or arrays
        that broadcast to (..., n); infinities are allowed and mean no bound.
    shape : tuple of int
        Stack shape (...).
    limb_count : int
        n.
    one_signed : bool
        Whether limits of f fix the sign of every f_i.
    displaced : bool
        Whether the device's centre is off the shoulder's, so that side forces change the tensions.

    Attributes
    ----------
    by_actuator : bool
        Whether the bounds of a pose are its own |f_i| at g = 0. Without a centre offset equilibrium determines
        them; with one they are those of limbs without side force.
    by_tension : bool
        Whether |g_i| <= |f_i| binds g to an f that is chosen together with it.

    Raises
    ------
    InvalidInput
        If a pair does not fit or holds NaN.
    InfeasibleBounds
        If a lower bound is above its upper bound.
    NonConvexBound
        For "actuator" with more than three limbs whose forces may take either sign: there f is chosen together
        with g, and |g| <= |f| is then not convex.
    """

    def __init__(
        self,
        bounds: ConstraintBounds,
        shape: tuple[int, ...],
        limb_count: int,
        one_signed: bool = False,
        displaced: bool = False,
    ) -> None:
        self.by_actuator = self.by_tension = False
        self._limb_count = limb_count
        self.is_free = bounds is None
        self._pair: tuple[Rows, Rows] | None = None
        if bounds is None:
            return
        if isinstance(bounds, str):
            if bounds != "actuator":
                raise UnknownName("constraint bound", bounds, ("actuator",))
            if limb_count > 3 and not one_signed:
                raise NonConvexBound(
                    f"|g_i| <= |f_i| needs limb forces that equilibrium determines; with {limb_count} limbs they are "
                    "chosen together with g and may take either sign, so give the bounds as (lower, upper), or "
                    'limbs that only pull (limits="pull")'
                )
            self.by_tension = limb_count > 3 or (displaced and one_signed)
            self.by_actuator = not self.by_tension
            return
        lower, upper = _pair(as_pair("constraint_bounds", bounds))
        self._pair = (
            Rows("constraint_bounds", lower, shape, limb_count),
            Rows("constraint_bounds", upper, shape, limb_count),
        )
        wrong = lower > upper
        wrong = np.broadcast_to(wrong, np.broadcast_shapes(wrong.shape, (limb_count,))).reshape(-1, limb_count)
        crossed = np.flatnonzero(wrong.any(axis=0))
        if crossed.size:
            raise InfeasibleBounds(crossed)
        self.is_free = bool(np.isinf(lower).all() and np.isinf(upper).all())

    def at(self, row: int, actuator_forces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of one pose, shape (n,) each, N."""
        if self.by_actuator:
            size = np.abs(actuator_forces)
            return -size, size
        if self._pair is not None:
            lower, upper = self.block(row, row + 1)
            return lower[0], upper[0]
        infinite = np.full(len(actuator_forces), np.inf)
        return -infinite, infinite

    def block(self, start: int, stop: int) -> tuple[FloatArray, FloatArray]:
        """Bounds of the poses from ``start`` to ``stop``, shape (stop - start, n) each, or (1, n) if all are alike, N.

        Infinite for "actuator", whose bounds are known only together with f.
        """
        if self._pair is not None:
            return self._pair[0].block(start, stop), self._pair[1].block(start, stop)
        infinite = np.full((1, self._limb_count), np.inf)
        return -infinite, infinite


#: No bounds, for single poses.
UNBOUNDED = SideForceBounds(None, (), 0)


def two_ends(bounds: Any, expected: str) -> tuple[Any, Any]:
    """The two ends of a pair of bounds; raises InvalidInput with what was ``expected`` for anything else."""
    try:
        # Two letters, two keys and the members of a set are no lower and upper bound, though each gives two values.
        if isinstance(bounds, str | bytes | Mapping | Set):
            raise TypeError
        lower, upper = bounds
    except (TypeError, ValueError):
        raise InvalidInput(f"expected {expected}, got {echo(bounds)}") from None
    return lower, upper


def _pair(bounds: tuple[ArrayLike, ArrayLike]) -> tuple[FloatArray, FloatArray]:
    lower, upper = two_ends(bounds, 'constraint_bounds to be None, "actuator" or (lower, upper) in N')
    sides = as_real("lower constraint bound", lower), as_real("upper constraint bound", upper)
    if np.isnan(sides[0]).any() or np.isnan(sides[1]).any():
        raise InvalidInput("expected constraint_bounds without NaN")
    if np.isposinf(sides[0]).any() or np.isneginf(sides[1]).any():
        raise InvalidInput("expected a lower bound below +inf and an upper bound above -inf")
    if any((np.isfinite(side) & (np.abs(side) > LARGEST)).any() for side in sides):
        raise InvalidInput(f"expected constraint_bounds in N, infinite or at most {LARGEST:g} in size")
    return sides


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
#: What limits may be.
FORMS = 'limits to be "design", "none", "pull", N, (lower, upper) in N, or objects with force_limits(length)'


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
        raise InvalidInput(f"expected {FORMS}, got None")
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
    lower, upper = force_bounds("limits", *two_ends(given, FORMS), shape, limb_count)
    return LimbLimits.of_design(mechanism, lengths()).narrowed(lower, upper)


def are_actuators(bounds: Any) -> bool:
    """Whether limits are given by actuators, which take the place of the design's."""
    if isinstance(bounds, ForceLimited):
        return True
    return isinstance(bounds, (list, tuple)) and len(bounds) > 0 and any(hasattr(b, "force_limits") for b in bounds)


class _GivenForce(NamedTuple):
    """An actuator whose force is known in each of N poses, least and greatest, shape (N,), N."""

    lower: FloatArray
    upper: FloatArray

    def force_limits(self, length: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The force itself, as both limits."""
        return self.lower, self.upper


def given_forces(tensions: FloatArray, more: int = 0) -> list[ForceLimited]:
    """Limits that leave no choice but these tensions, shape (N, n), N, such as those of a simulation.

    So many ``more`` efforts of an answer, moments of a wearer who helps, are free.
    """
    free = np.full(len(tensions), np.inf)
    return [*(_GivenForce(column, column) for column in tensions.T), *[_GivenForce(-free, free)] * more]


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
