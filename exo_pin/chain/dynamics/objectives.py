"""Bounds and objective of inverse dynamics as functions of the self-stresses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, UnknownName
from ...core.validation import FloatArray, as_finite, as_mapping, as_real
from ..structure.chain_state import ActuatedCoordinates, ChainState
from .equations.equations_of_motion import EquationsOfMotion
from .force_distribution import Bound, ForceDistribution, bounds_of, self_stress_within, without_rounding
from .nonsmooth.joint_friction import Rubbing, friction_bounds
from .wrenches import own_frame, turned

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


def effort_bounds_of(
    state: ChainState,
    driven: np.ndarray,
    effort: FloatArray,
    slope: FloatArray,
    given: Mapping[str, Range] | Literal["model"] | None,
    friction: tuple[FloatArray, FloatArray] | None = None,
) -> list[Bound]:
    """Bounds on the actuators' efforts, given these and their change per unit of z, shapes (nv,) and (nv, k).

    With ranges of ``friction`` at rest, shape (nv,) each, the forces are efforts and friction together.
    """
    if given is None:
        return []
    if isinstance(given, str):
        if given != "model":
            raise UnknownName("effort bounds", given, ("model", "a mapping of joints to (lower, upper)"))
        given = _effort_limits(state, driven)
    found: list[Bound] = []
    for joint, limits in as_mapping("effort_bounds", given, "joints to (lower, upper)").items():
        own = state.velocity_slice(joint)
        if own.start not in driven:
            raise InvalidInput(f"effort_bounds: joint {joint!r} is not actuated, expected one of the actuated joints")
        names = _components(f"effort of {joint}", own.stop - own.start)
        rubbed = (0.0, 0.0) if friction is None else (friction[0][own], friction[1][own])
        found += bounds_of(names, effort[own], slope[own], limits, f"effort_bounds[{joint!r}]", rubbed)
    return found


def effort_ranges(
    state: ChainState, driven: np.ndarray, given: Mapping[str, Range] | Literal["model"] | None
) -> tuple[FloatArray, FloatArray]:
    """Bounds on efforts that :func:`effort_bounds_of` has checked, shape (nv,) each, infinite where there is none."""
    low, high = np.full(state.nv, -np.inf), np.full(state.nv, np.inf)
    ranges = {} if given is None else _effort_limits(state, driven) if isinstance(given, str) else given
    for joint, limits in ranges.items():
        own = state.velocity_slice(joint)
        low[own], high[own] = limits
    return low, high


def _effort_limits(state: ChainState, driven: np.ndarray) -> dict[str, Range]:
    """Effort limits of the model, of the joints that are actuated."""
    limits: dict[str, Range] = {}
    for name in list(state.model.names)[1:]:
        own = state.velocity_slice(name)
        if own.start in driven:
            limits[name] = (state.model.lowerEffortLimit[own].copy(), state.model.upperEffortLimit[own].copy())
    return limits


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
        found += bounds_of(names, local[:, 0], effect, limits, f"reaction_bounds[{name!r}]")
    return found


def _components(name: str, count: int) -> Sequence[str]:
    return [name] if count == 1 else [f"{name} ({k})" for k in range(count)]


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
    friction = None
    if rubbing is not None:
        rests = np.isin(np.arange(state.nv), rubbing.rest)
        friction = np.where(rests, rubbing.low, 0.0), np.where(rests, rubbing.high, 0.0)
    bounds = effort_bounds_of(state, actuators.driven, effort, slope, given[0], friction)
    if rubbing is not None:
        bounds += friction_bounds(state, actuators, rubbing, effort, slope)
    bounds += reaction_bounds_of(equations, start, (stresses, sharpness), given[1])
    least_first = objective_of(equations, actuators.driven, (effort, slope), self_stress, objective)
    distribution = ForceDistribution(equations.metric(start, stresses, metric), bounds, sharpness)
    return tuple(bounds), start + stresses @ self_stress_within(distribution, least_first)
