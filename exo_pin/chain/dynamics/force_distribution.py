"""What equilibrium leaves open of the multipliers, and how it is shared: least norm, an objective, bounds.

With λ = λ_0 + N z every solution of the equations of motion is met once. The variables of the programs below are not z
but y, in which the stated metric is ½|y|² and a constant: so "the least norm among the best" is the shortest y, and
the programs are well scaled whatever the units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...core.errors import InfeasibleForces, InvalidInput, SolverFailed
from ...core.records import Record
from ...core.validation import FloatArray, as_real
from ...numerics import KKT_TOLERANCE, LeastSquares, solve

__all__ = ["METRICS", "Bound", "Space", "bounds_of", "interval", "settled", "share"]

#: What may be least where nothing else decides: the wrenches of all joints and closures, or the closures' alone.
METRICS = ("reactions", "closures")
#: Bounds may be missed by so much of the largest force.
_MISS = 1e-8


@dataclass(frozen=True, eq=False)
class Bound(Record):
    """lower <= constant + effect z <= upper for one component.

    Attributes
    ----------
    name : str
        Of the component, for messages.
    constant : float
        Its value at z = 0, N or N m.
    effect : ndarray
        Shape (k,), its change per unit of z, zero where that is rounding.
    lower, upper : float
        Infinite where there is none.
    """

    name: str
    constant: float
    effect: FloatArray
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Space(Record):
    """The variables y of a problem: z = centre + basis y, forces in units of ``scale``.

    Attributes
    ----------
    metric : ndarray
        Shape (p, 1 + k): what is to be least, at z = 0 in the first column and its change per unit of z in the
        others, N. The others have full column rank.
    bounds : sequence of Bound
        To be kept.
    sharpness : float
        Change per unit of z, N or N m, that is rounding.
    """

    metric: FloatArray
    bounds: Sequence[Bound]
    sharpness: float

    @cached_property
    def centre(self) -> FloatArray:
        """The z of least norm in the metric, shape (k,)."""
        if self.metric.shape[1] == 1:
            return np.zeros(0)
        return np.asarray(np.linalg.lstsq(self.metric[:, 1:], -self.metric[:, 0], rcond=None)[0])

    @cached_property
    def scale(self) -> float:
        """A force of the problem, N."""
        bounded = max((abs(bound.constant) for bound in self.bounds), default=0.0)
        return max(float(np.abs(self.metric[:, 0]).max(initial=0.0)), bounded) or 1.0

    @cached_property
    def basis(self) -> FloatArray:
        """Shape (k, k): the metric's norm of ``basis @ y`` is ``scale`` times |y|."""
        triangle = np.asarray(np.linalg.qr(self.metric[:, 1:], mode="r"), dtype=np.float64)
        return np.asarray(np.linalg.inv(triangle) * self.scale, dtype=np.float64)

    @cached_property
    def felt(self) -> FloatArray:
        """Shape (k, r): an orthonormal basis of the ways in z that the bounds feel; the others change them by rounding.

        Programs must not see that rounding: along a way that nothing else holds, it would be worth any force.
        """
        effects = np.reshape([bound.effect for bound in self.bounds], (len(self.bounds), len(self.centre)))
        _, sizes, ways = np.linalg.svd(effects, full_matrices=False)
        return np.asarray(ways[sizes > self.sharpness].T, dtype=np.float64)

    @cached_property
    def limits(self) -> tuple[FloatArray, FloatArray, tuple[str, ...]]:
        """The bounds as C u <= c with z = centre + scale felt u, in units of ``scale``, and what each row says."""
        rows, sides, names = [], [], []
        for bound in self.bounds:
            here, slope = bound.constant + bound.effect @ self.centre, bound.effect @ self.felt
            for side, sign, word in ((bound.upper, 1.0, "at most"), (-bound.lower, -1.0, "at least")):
                if np.isfinite(side):
                    rows.append(sign * slope)
                    sides.append((side - sign * here) / self.scale)
                    names.append(f"{bound.name} {word} {sign * side:.6g}")
        return np.reshape(rows, (len(rows), self.felt.shape[1])), np.array(sides, dtype=np.float64), tuple(names)

    @cached_property
    def limits_of_y(self) -> tuple[FloatArray, FloatArray]:
        """The bounds as C y <= c, in units of ``scale``."""
        C, c, _ = self.limits
        return C @ (self.felt.T @ self.basis) / self.scale, c


def settled(effect: FloatArray, sharpness: float) -> FloatArray:
    """Effects of z, shape (p, k), without what is rounding of each and of all together."""
    each = np.where(np.abs(effect).max(axis=1, keepdims=True, initial=0.0) > sharpness, effect, 0.0)
    U, sizes, ways = np.linalg.svd(each, full_matrices=False)
    kept = sizes > sharpness
    return np.asarray((U[:, kept] * sizes[kept]) @ ways[kept], dtype=np.float64)


def bounds_of(
    names: Sequence[str], constant: FloatArray, effect: FloatArray, limits: tuple[ArrayLike, ArrayLike], what: str
) -> list[Bound]:
    """Bounds on the components of a force.

    Parameters
    ----------
    names : sequence of str
        Of the components.
    constant, effect : ndarray
        Shapes (count,) and (count, k).
    limits : tuple of array_like
        Lower and upper bounds, each a number or shape (count,), infinite where there is none.
    what : str
        For messages.

    Raises
    ------
    InvalidInput
        If the limits do not fit, are NaN, or cross.
    """
    try:
        pair = [as_real(what, side) for side in limits]
    except TypeError:
        pair = []
    if len(pair) != 2 or any(side.shape not in ((), constant.shape) or np.isnan(side).any() for side in pair):
        raise InvalidInput(
            f"expected {what} as (lower, upper), numbers or {constant.size} of them each, infinite where there is "
            f"none, got {limits!r}"
        )
    lower, upper = (np.broadcast_to(side, constant.shape) for side in pair)
    if not (lower <= upper).all() or (lower == np.inf).any() or (upper == -np.inf).any():
        raise InvalidInput(f"expected lower bounds below upper ones for {what}, got {limits!r}")
    return [
        Bound(name, float(constant[i]), effect[i], float(lower[i]), float(upper[i]))
        for i, name in enumerate(names)
        if np.isfinite(lower[i]) or np.isfinite(upper[i])
    ]


def share(space: Space, objective: tuple[FloatArray, FloatArray] | None) -> FloatArray:
    """The z that is best in the objective within the bounds and, among equals, least in the metric.

    Parameters
    ----------
    space : Space
        Metric and bounds.
    objective : tuple of ndarray or None
        (constant, effect) of what is to be small first, shapes (p,) and (p, k), N.

    Returns
    -------
    ndarray
        Shape (k,).

    Raises
    ------
    InfeasibleForces
        If no z keeps the bounds.
    SolverFailed
        If the optimality conditions hold to no better than 1e-8.
    """
    size = space.metric.shape[1] - 1
    if not size:
        _refuse_missed(space, np.zeros(0))
        return space.centre
    if objective is None and not space.bounds:
        return space.centre
    E, d = np.eye(size), np.zeros(size)
    if objective is not None:
        constant, effect = objective
        E = effect @ space.basis / space.scale
        d = -(constant + effect @ space.centre) / space.scale
    open_end = np.full(size, np.inf)
    C, c = space.limits_of_y
    answer = solve(LeastSquares(E, d, np.zeros((0, size)), np.zeros(0), -open_end, open_end, C, c))
    if not answer.is_optimal:
        _refuse_missed(space, answer.z)
        raise SolverFailed("ProxQP", answer.kkt, "sharing of the undetermined forces")
    return space.centre + space.basis @ answer.z


def _refuse_missed(space: Space, y: FloatArray) -> None:
    """Raise if the bounds cannot be kept, and say which stand in each other's way."""
    if not space.bounds:
        return
    of_y, c = space.limits_of_y
    if (of_y @ y - c).max(initial=0.0) <= _MISS:
        return
    C, _, names = space.limits
    # Least t with C y - t <= c; rows with a multiplier are the ones in the way.
    cost = np.append(np.zeros(C.shape[1]), 1.0)
    rows = np.column_stack([C, -np.ones(len(c))])
    least = scipy.optimize.linprog(cost, A_ub=rows, b_ub=c, bounds=(None, None), method="highs")
    if least.status == 0 and least.fun > _MISS:
        blocking = [name for name, dual in zip(names, least.ineqlin.marginals, strict=True) if dual < -1e-9]
        raise InfeasibleForces(float(least.fun) * space.scale, blocking)


def interval(space: Space, constant: float, effect: FloatArray) -> tuple[float, float]:
    """Least and largest value of constant + effect z within the bounds, infinite where they leave it free.

    Raises
    ------
    SolverFailed
        If the linear programs are not solved.
    """
    here, slope = constant + float(effect @ space.centre), effect @ space.felt
    if np.abs(effect - space.felt @ slope).max(initial=0.0) > space.sharpness:
        return -np.inf, np.inf
    if not slope.size:
        return here, here
    C, c, _ = space.limits
    ends = []
    for sign in (1.0, -1.0):
        found = scipy.optimize.linprog(sign * slope, A_ub=C, b_ub=c, bounds=(None, None), method="highs")
        if found.status == 3:
            ends.append(-sign * np.inf)
        elif found.status == 0:
            ends.append(here + sign * float(found.fun) * space.scale)
        else:
            raise SolverFailed("HiGHS", KKT_TOLERANCE, f"interval of a force: {found.message}")
    return ends[0], ends[1]
