"""What inverse dynamics is asked to keep and to make small, told in the self-stresses that are open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, UnknownName
from ...core.validation import FloatArray, as_finite, as_mapping, as_real
from ..structure.chain_state import Structure
from .equations_of_motion import Balance
from .force_distribution import Bound, bounds_of, settled
from .reactions import wrench_of

__all__ = ["Objective", "Range", "effort_bounds_of", "objective_of", "reaction_bounds_of"]

#: Lower and upper bound, numbers or one for each component.
Range = tuple[ArrayLike, ArrayLike]
#: What is to be small: all efforts, or joints' and closures' wrenches by name with their weights.
Objective = Literal["efforts"] | Mapping[str, ArrayLike]


def objective_of(
    balance: Balance,
    driven: np.ndarray,
    efforts: tuple[FloatArray, FloatArray],
    multipliers: tuple[FloatArray, FloatArray, float],
    objective: Objective | None,
) -> tuple[FloatArray, FloatArray] | None:
    """Constant and effect of z on what the objective makes small, in N.

    ``efforts`` are those at z = 0 and their change; ``multipliers`` are λ at z = 0, the self-stresses and their
    sharpness. What is determined is no matter of choice: its rounding is taken out.
    """
    if objective is None:
        return None
    chain = balance.chain
    if isinstance(objective, str):
        if objective != "efforts":
            raise UnknownName("objective", objective, ("efforts", "a mapping of joints and closures to weights"))
        unit = chain._topology.per_newton[driven]
        return unit * efforts[0][driven], settled(unit[:, None] * efforts[1][driven], multipliers[2])
    start, stresses, sharpness = multipliers
    parts = []
    for name, weight in as_mapping("objective", objective, "joints and closures to weights").items():
        array = as_real(f"objective[{name!r}]", weight)
        weights = as_finite(f"objective[{name!r}]", array, array.shape if array.shape == () else (6,))
        wrench, own, _ = wrench_of(balance, name)
        told = wrench.told(*own)
        unit = np.array([1.0] * 3 + [1.0 / chain.characteristic_length] * 3)
        both = unit * (told.constant + told.effect @ start), unit[:, None] * (told.effect @ stresses)
        parts.append((np.broadcast_to(weights, (6,)), *both))
    if not parts:
        return None
    weights, constant, effect = (np.concatenate(items) for items in zip(*parts, strict=True))
    weighed = weights != 0.0
    # Rounding goes before the weights come.
    effect = settled(effect[weighed], sharpness)
    return weights[weighed] * constant[weighed], weights[weighed, None] * effect


def effort_bounds_of(
    chain: Structure,
    driven: np.ndarray,
    effort: FloatArray,
    slope: FloatArray,
    given: Mapping[str, Range] | Literal["model"] | None,
) -> list[Bound]:
    """Bounds on the actuators' efforts, given these and their change per unit of z, shapes (nv,) and (nv, k)."""
    if given is None:
        return []
    if isinstance(given, str):
        if given != "model":
            raise UnknownName("effort bounds", given, ("model", "a mapping of joints to (lower, upper)"))
        given = _effort_limits(chain, driven)
    found: list[Bound] = []
    for joint, limits in as_mapping("effort_bounds", given, "joints to (lower, upper)").items():
        own = chain.velocity_slice(joint)
        if not np.isin(np.arange(own.start, own.stop), driven).all():
            raise InvalidInput(f"effort_bounds: joint {joint!r} is not actuated")
        names = _components(f"effort of {joint}", own.stop - own.start)
        found += bounds_of(names, effort[own], slope[own], limits, f"effort_bounds[{joint!r}]")
    return found


def _effort_limits(chain: Structure, driven: np.ndarray) -> dict[str, Range]:
    """Effort limits of the model, of the joints that are actuated."""
    limits: dict[str, Range] = {}
    for name in list(chain.model.names)[1:]:
        own = chain.velocity_slice(name)
        if own.stop > own.start and np.isin(np.arange(own.start, own.stop), driven).all():
            limits[name] = (chain.model.lowerEffortLimit[own].copy(), chain.model.upperEffortLimit[own].copy())
    return limits


def reaction_bounds_of(
    balance: Balance,
    start: FloatArray,
    open_part: tuple[FloatArray, float],
    given: Mapping[str, Range] | None,
) -> list[Bound]:
    """Bounds on joints' and closures' wrenches, given λ at z = 0 and the self-stresses with their sharpness."""
    stresses, sharpness = open_part
    unit = np.array([1.0] * 3 + [1.0 / balance.chain.characteristic_length] * 3)[:, None]
    found: list[Bound] = []
    for name, limits in as_mapping("reaction_bounds", given, "joints and closures to (lower, upper)").items():
        wrench, own, _ = wrench_of(balance, name)
        told = wrench.told(*own)
        effect = told.effect @ stresses
        effect[np.abs(effect * unit).max(axis=1, initial=0.0) <= sharpness] = 0.0
        names = [f"{part} of {name}" for part in ("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")]
        found += bounds_of(names, told.constant + told.effect @ start, effect, limits, f"reaction_bounds[{name!r}]")
    return found


def _components(name: str, count: int) -> Sequence[str]:
    return [name] if count == 1 else [f"{name} ({k})" for k in range(count)]
