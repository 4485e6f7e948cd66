"""Distribution of the forces that equilibrium does not determine: least norm, an objective, bounds.

Every solution of the equations of motion is λ = λ_0 + N z for exactly one z. The variables of the programs below are
y, in which the metric is ½|y|² plus a constant. So the solution of least norm is the shortest y, and the programs are
well scaled in any units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...core.errors import InfeasibleForces, InvalidInput, SolverFailed, UnknownName
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_mapping, as_real
from ...numerics import KKT_TOLERANCE, LeastSquares, solve
from ..structure.chain_state import ActuatedCoordinates, ChainState
from .equations.equations_of_motion import EquationsOfMotion
from .nonsmooth.joint_friction import Rubbing
from .wrenches import own_frame, turned

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


def checked_range(limits: tuple[ArrayLike, ArrayLike], count: int, what: str) -> tuple[FloatArray, FloatArray]:
    """Lower and upper limits of a force's components, shape (count,), each a number or one for every component.

    Raises
    ------
    InvalidInput
        If they have a wrong shape, are NaN, or a lower one exceeds the upper one.
    """
    try:
        pair = [as_real(what, side) for side in limits]
    except TypeError:
        pair = []
    if len(pair) != 2 or any(side.shape not in ((), (count,)) or np.isnan(side).any() for side in pair):
        raise InvalidInput(
            f"expected {what} as (lower, upper), numbers or {count} of them each, infinite where there is none, "
            f"got {limits!r}"
        )
    lower, upper = (np.broadcast_to(side, (count,)) for side in pair)
    if not (lower <= upper).all() or (lower == np.inf).any() or (upper == -np.inf).any():
        raise InvalidInput(f"expected lower bounds at most the upper ones for {what}, got {limits!r}")
    return lower, upper


def bounds_of(
    names: Sequence[str], constant: FloatArray, effect: FloatArray, lower: FloatArray, upper: FloatArray
) -> list[Bound]:
    """Bounds on the components of forces that have some; effects have shape (count, k), the others (count,)."""
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
        # HiGHS's presolve takes bounds that meet but for rounding for a contradiction.
        options = {"presolve": False}
        found = scipy.optimize.linprog(
            sign * slope, A_ub=C, b_ub=c, bounds=(None, None), method="highs", options=options
        )
        if found.status == 3:
            ends.append(-sign * np.inf)
        elif found.status == 0:
            ends.append(here + sign * float(found.fun) * distribution.scale)
        else:
            raise SolverFailed("HiGHS", KKT_TOLERANCE, f"interval of a force: {found.message}")
    return ends[0], ends[1]


#: Lower and upper bound, numbers or one for each component.
Range = tuple[ArrayLike, ArrayLike]
#: What to minimise: all efforts, or wrenches of joints and closures by name with their weights.
Objective = Literal["efforts"] | Mapping[str, ArrayLike]


def objective_of(
    equations: EquationsOfMotion,
    driven: np.ndarray,
    efforts: tuple[FloatArray, FloatArray],
    multipliers: tuple[FloatArray, FloatArray, float],
    objective: Objective | None,
) -> tuple[FloatArray, FloatArray] | None:
    """The forces whose sum of squares is the objective, N: constant and effect of z.

    ``efforts`` are those at z = 0 and their change; ``multipliers`` are λ at z = 0, the self-stresses and their
    sharpness. Effects on determined components are rounding and set to zero.
    """
    if objective is None:
        return None
    state = equations.state
    if isinstance(objective, str):
        if objective != "efforts":
            raise UnknownName("objective", objective, ("efforts", "a mapping of joints and closures to weights"))
        unit = state.topology.per_newton[driven]
        return unit * efforts[0][driven], without_rounding(unit[:, None] * efforts[1][driven], multipliers[2])
    start, stresses, sharpness = multipliers
    parts = []
    for name, weight in as_mapping("objective", objective, "joints and closures to weights").items():
        array = as_real(f"objective[{name!r}]", weight)
        weights = as_finite(f"objective[{name!r}]", array, array.shape if array.shape == () else (6,))
        local = local_wrench(equations, name, start, stresses)
        unit = np.array([1.0] * 3 + [1.0 / state.characteristic_length] * 3)
        both = unit * local[:, 0], unit[:, None] * local[:, 1:]
        parts.append((np.broadcast_to(weights, (6,)), *both))
    if not parts:
        return None
    weights, constant, effect = (np.concatenate(items) for items in zip(*parts, strict=True))
    weighed = weights != 0.0
    # Rounding is removed before weights are applied.
    effect = without_rounding(effect[weighed], sharpness)
    return weights[weighed] * constant[weighed], weights[weighed, None] * effect


def local_wrench(equations: EquationsOfMotion, name: str, start: FloatArray, stresses: FloatArray) -> FloatArray:
    """A joint's or closure's wrench about its own origin in its own axes, λ = start + stresses z, shape (6, 1 + k).

    The first column is that at z = 0, the others its change per unit of z.
    """
    index = equations.state.part(name).place
    wrenches = equations.wrenches(np.column_stack([start, stresses]))
    return turned(wrenches[6 * index : 6 * index + 6], own_frame(equations, index)[1])


def effort_ranges(
    state: ChainState, driven: np.ndarray, given: Mapping[str, Range] | Literal["model"] | None
) -> tuple[FloatArray, FloatArray]:
    """Bounds on the actuators' efforts, shape (nv,) each, infinite where there is none."""
    low, high = np.full(state.nv, -np.inf), np.full(state.nv, np.inf)
    if isinstance(given, str):
        if given != "model":
            raise UnknownName("effort bounds", given, ("model", "a mapping of joints to (lower, upper)"))
        limits = state.model.lowerEffortLimit, state.model.upperEffortLimit
        joints = [(name, state.velocity_slice(name)) for name in list(state.model.names)[1:]]
        given = {name: (limits[0][own], limits[1][own]) for name, own in joints if own.start in driven}
    for joint, limits in as_mapping("effort_bounds", given, "joints to (lower, upper)").items():
        own = state.velocity_slice(joint)
        if own.start not in driven:
            raise InvalidInput(f"effort_bounds: joint {joint!r} is not actuated, expected one of the actuated joints")
        low[own], high[own] = checked_range(limits, own.stop - own.start, f"effort_bounds[{joint!r}]")
    return low, high


def reaction_bounds_of(
    equations: EquationsOfMotion,
    start: FloatArray,
    self_stress: tuple[FloatArray, float],
    given: Mapping[str, Range] | None,
) -> list[Bound]:
    """Bounds on joints' and closures' wrenches, given λ at z = 0 and the self-stresses with their sharpness."""
    stresses, sharpness = self_stress
    unit = np.array([1.0] * 3 + [1.0 / equations.state.characteristic_length] * 3)[:, None]
    found: list[Bound] = []
    for name, limits in as_mapping("reaction_bounds", given, "joints and closures to (lower, upper)").items():
        local = local_wrench(equations, name, start, stresses)
        effect = local[:, 1:]
        effect[np.abs(effect * unit).max(axis=1, initial=0.0) <= sharpness] = 0.0
        names = [f"{part} of {name}" for part in ("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")]
        found += bounds_of(names, local[:, 0], effect, *checked_range(limits, 6, f"reaction_bounds[{name!r}]"))
    return found


def bounds_and_multipliers(
    equations: EquationsOfMotion,
    drives: tuple[ActuatedCoordinates, ActuatedCoordinates],
    self_stress: tuple[FloatArray, FloatArray, float],
    given: tuple[Mapping[str, Range] | Literal["model"] | None, Mapping[str, Range] | None],
    objective: Objective | None,
    metric: str,
    rubbing: Rubbing | None,
) -> tuple[tuple[Bound, ...], FloatArray]:
    """Bounds, and the λ within them that is least in the objective, and then in the metric.

    ``drives`` are that of actuators and friction at rest, and that of actuators alone.
    """
    state, (drive, actuators) = equations.state, drives
    start, stresses, sharpness = self_stress
    # Efforts are tau - Jᵀ λ. Rounding of a self-stress must not change determined efforts, however large z becomes.
    effort, slope = equations.tau - equations.jacobian.T @ start, -equations.jacobian.T @ stresses
    slope[np.abs(slope * state.topology.per_newton[:, None]).max(axis=1, initial=0.0) <= sharpness] = 0.0
    slope[drive.passive] = 0.0
    low, high = effort_ranges(state, actuators.driven, given[0])
    alone = np.array([], dtype=np.int64)
    if rubbing is not None:
        # Effort and friction at rest together; in joints without actuator the friction alone.
        rests, alone = rubbing.rest, np.intersect1d(rubbing.rest, actuators.passive)
        low[alone], high[alone] = 0.0, 0.0
        low[rests] += rubbing.low[rests]
        high[rests] += rubbing.high[rests]
    owners, names = state.topology.owners, list[str]()
    bounded = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    for k in bounded:
        own = np.flatnonzero(owners == owners[k])
        part = f" ({k - own[0]})" if len(own) > 1 and k not in alone else ""
        names.append(f"{'friction' if k in alone else 'effort'} of {state.model.names[int(owners[k])]}{part}")
    bounds = bounds_of(names, effort[bounded], slope[bounded], low[bounded], high[bounded])
    bounds += reaction_bounds_of(equations, start, (stresses, sharpness), given[1])
    least_first = objective_of(equations, actuators.driven, (effort, slope), self_stress, objective)
    distribution = ForceDistribution(equations.metric(start, stresses, metric), bounds, sharpness)
    return tuple(bounds), start + stresses @ self_stress_within(distribution, least_first)
