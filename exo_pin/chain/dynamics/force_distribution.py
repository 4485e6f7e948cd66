"""Distribution of the forces that equilibrium does not determine: least norm, an objective, bounds.

Every solution of the equations of motion is λ = λ_0 + N z for exactly one z. The variables of the programs below are
y, in which the metric is ½|y|² plus a constant. So the solution of least norm is the shortest y, and the programs are
well scaled in any units.
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

#: Metrics: the wrenches of all joints and closures, or those of the closures alone.
METRICS = ("reactions", "closures")
#: Largest violation of a bound, as a share of the largest force.
_VIOLATION = 1e-8


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
        Shape (k,), its change per unit of z, zero where that is only rounding.
    lower, upper : float
        Infinite where there is none.
    """

    name: str
    constant: float
    effect: FloatArray
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class ForceDistribution(Record):
    """A program for the self-stresses z: its metric, bounds and variables y, with z = centre + basis y.

    Attributes
    ----------
    metric : ndarray
        Shape (p, 1 + k), N: the forces whose sum of squares is minimised, at z = 0 in the first column and their
        change per unit of z in the others, which have full column rank.
    bounds : sequence of Bound
        Bounds on components of forces.
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
            return np.array([])
        return np.asarray(np.linalg.lstsq(self.metric[:, 1:], -self.metric[:, 0], rcond=None)[0])

    @cached_property
    def scale(self) -> float:
        """A force of the problem, N, the unit of its variables."""
        bounded = max((abs(bound.constant) for bound in self.bounds), default=0.0)
        return max(float(np.abs(self.metric[:, 0]).max(initial=0.0)), bounded) or 1.0

    @cached_property
    def basis(self) -> FloatArray:
        """Shape (k, k): the metric's norm of ``basis @ y`` is ``scale`` times |y|."""
        triangle = np.asarray(np.linalg.qr(self.metric[:, 1:], mode="r"), dtype=np.float64)
        return np.asarray(np.linalg.inv(triangle) * self.scale, dtype=np.float64)

    @cached_property
    def bounded_directions(self) -> FloatArray:
        """Shape (k, r): an orthonormal basis of the directions in z that change bounded components.

        The other directions change them by rounding only. Programs must not contain that rounding: along a direction
        that is free otherwise, it would allow any force.
        """
        effects = np.reshape([bound.effect for bound in self.bounds], (len(self.bounds), len(self.centre)))
        _, sizes, ways = np.linalg.svd(effects, full_matrices=False)
        return np.asarray(ways[sizes > self.sharpness].T, dtype=np.float64)

    @cached_property
    def limits(self) -> tuple[FloatArray, FloatArray, tuple[str, ...]]:
        """The bounds as C u <= c, in units of ``scale``, and a name of each row; z = centre + scale directions u."""
        rows, sides, names = [], [], []
        for bound in self.bounds:
            here, slope = bound.constant + bound.effect @ self.centre, bound.effect @ self.bounded_directions
            for side, sign, word in ((bound.upper, 1.0, "at most"), (-bound.lower, -1.0, "at least")):
                if np.isfinite(side):
                    rows.append(sign * slope)
                    sides.append((side - sign * here) / self.scale)
                    names.append(f"{bound.name} {word} {sign * side:.6g}")
        return (
            np.reshape(rows, (len(rows), self.bounded_directions.shape[1])),
            np.array(sides, dtype=np.float64),
            tuple(names),
        )

    @cached_property
    def limits_of_y(self) -> tuple[FloatArray, FloatArray]:
        """The bounds as C y <= c, in units of ``scale``."""
        C, c, _ = self.limits
        return C @ (self.bounded_directions.T @ self.basis) / self.scale, c


def without_rounding(effect: FloatArray, sharpness: float) -> FloatArray:
    """Effects of z, shape (p, k), with rounding set to zero, row by row and in the singular values."""
    each = np.where(np.abs(effect).max(axis=1, keepdims=True, initial=0.0) > sharpness, effect, 0.0)
    U, sizes, ways = np.linalg.svd(each, full_matrices=False)
    significant = sizes > sharpness
    return np.asarray((U[:, significant] * sizes[significant]) @ ways[significant], dtype=np.float64)


def bounds_of(
    names: Sequence[str],
    constant: FloatArray,
    effect: FloatArray,
    limits: tuple[ArrayLike, ArrayLike],
    what: str,
    margins: tuple[FloatArray | float, FloatArray | float] = (0.0, 0.0),
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
    margins : tuple of float or ndarray
        What is added to the lower and the upper bounds, each a number or shape (count,).

    Raises
    ------
    InvalidInput
        If the limits have a wrong shape, are NaN, or a lower one exceeds the upper one.
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
        raise InvalidInput(f"expected lower bounds at most the upper ones for {what}, got {limits!r}")
    lower, upper = lower + margins[0], upper + margins[1]
    return [
        Bound(name, float(constant[i]), effect[i], float(lower[i]), float(upper[i]))
        for i, name in enumerate(names)
        if np.isfinite(lower[i]) or np.isfinite(upper[i])
    ]


def self_stress_within(distribution: ForceDistribution, objective: tuple[FloatArray, FloatArray] | None) -> FloatArray:
    """The z within the bounds that is least in the objective and, among equals, in the metric.

    Parameters
    ----------
    distribution : ForceDistribution
        Metric and bounds.
    objective : tuple of ndarray or None
        (constant, effect) of the forces whose sum of squares is minimised first, shapes (p,) and (p, k), N.

    Returns
    -------
    ndarray
        Shape (k,).

    Raises
    ------
    InfeasibleForces
        If no z is within the bounds.
    SolverFailed
        If the optimality conditions hold to no better than 1e-8.
    """
    size = distribution.metric.shape[1] - 1
    if not size:
        _refuse_infeasible(distribution, np.array([]))
        return distribution.centre
    if objective is None and not distribution.bounds:
        return distribution.centre
    E, d = np.eye(size), np.zeros(size)
    if objective is not None:
        constant, effect = objective
        E = effect @ distribution.basis / distribution.scale
        d = -(constant + effect @ distribution.centre) / distribution.scale
    unbounded = np.full(size, np.inf)
    C, c = distribution.limits_of_y
    answer = solve(LeastSquares(E, d, np.zeros((0, size)), np.array([]), -unbounded, unbounded, C, c))
    if not answer.is_optimal:
        _refuse_infeasible(distribution, answer.z)
        raise SolverFailed("ProxQP", answer.kkt, "distribution of the undetermined forces")
    return distribution.centre + distribution.basis @ answer.z


def _refuse_infeasible(distribution: ForceDistribution, y: FloatArray) -> None:
    """Raise InfeasibleForces, with the conflicting bounds, if no z is within all bounds."""
    if not distribution.bounds:
        return
    of_y, c = distribution.limits_of_y
    if (of_y @ y - c).max(initial=0.0) <= _VIOLATION:
        return
    C, _, names = distribution.limits
    # Least t with C y - t <= c; rows with a multiplier are the conflicting ones.
    cost = np.append(np.zeros(C.shape[1]), 1.0)
    rows = np.column_stack([C, -np.ones(len(c))])
    least = scipy.optimize.linprog(cost, A_ub=rows, b_ub=c, bounds=(None, None), method="highs")
    if least.status == 0 and least.fun > _VIOLATION:
        conflicting = [name for name, dual in zip(names, least.ineqlin.marginals, strict=True) if dual < -1e-9]
        raise InfeasibleForces(float(least.fun) * distribution.scale, conflicting)


def interval(distribution: ForceDistribution, constant: float, effect: FloatArray) -> tuple[float, float]:
    """Least and largest value of constant + effect z within the bounds, infinite where it is not bounded.

    Raises
    ------
    SolverFailed
        If the linear programs are not solved.
    """
    here, slope = constant + float(effect @ distribution.centre), effect @ distribution.bounded_directions
    if np.abs(effect - distribution.bounded_directions @ slope).max(initial=0.0) > distribution.sharpness:
        return -np.inf, np.inf
    if not slope.size:
        return here, here
    C, c, _ = distribution.limits
    ends = []
    for sign in (1.0, -1.0):
        found = scipy.optimize.linprog(sign * slope, A_ub=C, b_ub=c, bounds=(None, None), method="highs")
        if found.status == 3:
            ends.append(-sign * np.inf)
        elif found.status == 0:
            ends.append(here + sign * float(found.fun) * distribution.scale)
        else:
            raise SolverFailed("HiGHS", KKT_TOLERANCE, f"interval of a force: {found.message}")
    return ends[0], ends[1]
