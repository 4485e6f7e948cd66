"""Bounds on the side forces g_i, in the forms a caller may give them."""

from __future__ import annotations

from collections.abc import Mapping, Set
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InfeasibleBounds, InvalidInput, NonConvexBound, UnknownName
from ...core.errors.base import echo
from ...core.validation import LARGEST, FloatArray, as_pair, as_real
from ...load_case.pose_stacks import Rows

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

    def of_rows(self, rows: NDArray[np.intp]) -> SideForceBounds:
        """The same for some poses of the stack, a flat stack of their own."""
        part = copy(self)
        if self._pair is not None:
            lower, upper = (ends.rows(rows) for ends in self._pair)
            shape = (len(rows),)
            part._pair = Rows("lower", lower, shape, self._limb_count), Rows("upper", upper, shape, self._limb_count)
        return part


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
