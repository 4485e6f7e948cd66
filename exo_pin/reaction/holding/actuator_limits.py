"""Lengths and forces that the actuators of a design can take, as arrays over poses.

Assumption: the static law of a muscle is scaled to another nominal length by equal strain
(:func:`exo_pin.muscle.muscle_model`).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.errors import MissingData
from ...core.validation import FloatArray
from ...design import Actuator, Mechanism, Stroke
from ...muscle import Muscle, muscle_model

__all__ = [
    "DesignActuators",
    "DesignLimits",
    "ForceLimits",
    "design_limits",
    "enumerated",
    "length_limits",
    "limb_list",
    "missing_limits",
]


class DesignLimits(NamedTuple):
    """Force limits of the actuators of a design in N poses; tension is positive.

    Attributes
    ----------
    lower, upper : ndarray
        Least and greatest f_i, shape (N, n), N; NaN where not known.
    ceiling : ndarray
        A force above which f_i is impossible also where ``upper`` is not known, shape (N, n), N; infinite without one.
    """

    lower: FloatArray
    upper: FloatArray
    ceiling: FloatArray


def length_limits(mechanism: Mechanism) -> tuple[FloatArray, FloatArray]:
    """Shortest and longest l_i, shapes (n,), m; NaN where the stroke or the end fitting is not known."""
    low, high = np.full((2, mechanism.limb_count), np.nan)
    for i, limb in enumerate(mechanism.limbs):
        stroke = limb.stroke
        if stroke is not None and stroke.end_fitting is not None:
            low[i] = stroke.end_fitting + stroke.shortest * stroke.nominal_length
            high[i] = stroke.end_fitting + stroke.longest * stroke.nominal_length
    return low, high


def design_limits(mechanism: Mechanism, lengths: FloatArray) -> DesignLimits:
    """Limits of the forces at limb lengths, shape (N, n), m."""
    shape = lengths.shape
    lower, upper, ceiling = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.inf)
    for i, limb in enumerate(mechanism.limbs):
        actuator = limb.actuator
        if actuator is None:
            continue
        if actuator.push_limit is not None:
            lower[:, i] = -actuator.push_limit
        if actuator.pull_limit is not None:
            upper[:, i] = ceiling[:, i] = actuator.pull_limit
        if actuator.force_law is None or limb.stroke is None:
            continue
        muscle = _muscle(actuator, limb.stroke)
        ceiling[:, i] = np.minimum(ceiling[:, i], muscle.model.validity.capability_line(np.array(muscle.supply)))
        if muscle.end_fitting is not None:
            pull = _greatest_pull(muscle, lengths[:, i])
            upper[:, i] = pull if actuator.pull_limit is None else np.minimum(pull, actuator.pull_limit)
    return DesignLimits(lower, upper, ceiling)


def missing_limits(mechanism: Mechanism, known_forces: bool = False) -> tuple[str, ...]:
    """Data that are missing for a verdict on every pose, one entry for each quantity, with the limbs that lack it.

    Limits of the forces are left out if all of them are known (``known_forces``), by the design or from a query.
    """
    lacking: dict[str, list[int]] = {}
    for number, limb in enumerate(mechanism.limbs, start=1):
        actuator, stroke = limb.actuator, limb.stroke
        if stroke is None:
            lacking.setdefault("stroke", []).append(number)
        elif stroke.end_fitting is None:
            lacking.setdefault("end fitting", []).append(number)
        if known_forces:
            continue
        if actuator is None:
            lacking.setdefault("actuator", []).append(number)
            continue
        if actuator.pull_limit is None and actuator.force_law is None:
            lacking.setdefault("greatest pull", []).append(number)
        if actuator.push_limit is None:
            lacking.setdefault("greatest push", []).append(number)
    return tuple(f"{name} of {limb_list(numbers)}" for name, numbers in lacking.items())


def limb_list(numbers: list[int]) -> str:
    """The limbs of these numbers, counted from 1, in words: "limbs 1 and 3"."""
    return f"limb{'s' * (len(numbers) > 1)} {enumerated(map(str, numbers))}"


def enumerated(words: Iterable[str]) -> str:
    """Words with commas, and "and" before the last."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


class ForceLimits(NamedTuple):
    """Limits of f for the N poses of a query.

    Attributes
    ----------
    lower, upper : ndarray
        Shape (N, n), N; infinite where there is no limit, NaN in the rows where ``reachable`` is False.
    """

    lower: FloatArray
    upper: FloatArray

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Whether every actuator can take its length, shape (N,)."""
        return np.asarray(~np.isnan(self.lower).any(axis=1))

    @property
    def one_signed(self) -> bool:
        """Whether the limits fix the sign of every f_i, so that |g_i| <= |f_i| is convex."""
        rows = self.reachable
        return bool((self.lower[rows] >= 0.0).all() or (self.upper[rows] <= 0.0).all())

    @classmethod
    def of_design(cls, mechanism: Mechanism, lengths: FloatArray) -> ForceLimits:
        """Limits of the design's actuators at limb lengths, shape (N, n), m; one that is not known is left out."""
        own = design_limits(mechanism, lengths)
        lower = np.where(np.isnan(own.lower), -np.inf, own.lower)
        return cls(lower, np.where(np.isnan(own.upper), own.ceiling, own.upper))

    def row(self, k: int) -> ForceLimits:
        """Limits of pose k, a stack of one."""
        return ForceLimits(self.lower[k : k + 1], self.upper[k : k + 1])


class DesignActuators:
    """The actuators of a design as limits of a query, ``actuator_bounds="design"``.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    stroke : bool
        Whether a length outside the stroke is refused; otherwise only the forces are limited.

    Raises
    ------
    MissingData
        If a limb has no actuator. A limit that is not known is left out: the forces are then bounded on the known
        side alone.
    """

    def __init__(self, mechanism: Mechanism, stroke: bool = True) -> None:
        lacking = [i for i, limb in enumerate(mechanism.limbs, start=1) if limb.actuator is None]
        if lacking:
            needed_for = "the limits of the design's actuators"
            raise MissingData([f"actuator of {limb_list(lacking)}"], needed_for, mechanism.name)
        self._mechanism, self._stroke = mechanism, stroke

    def limits(self, lengths: FloatArray) -> ForceLimits:
        """Limits of f at limb lengths, shape (N, n), m."""
        own = ForceLimits.of_design(self._mechanism, lengths)
        if self._stroke:
            low, high = length_limits(self._mechanism)
            outside = ((lengths < low) | (lengths > high)).any(axis=1)
            own.lower[outside], own.upper[outside] = np.nan, np.nan
        return own


@lru_cache(maxsize=64)
def _muscle(actuator: Actuator, stroke: Stroke) -> Muscle:
    assert actuator.force_law is not None
    model = muscle_model(actuator.force_law, stroke.nominal_length)
    return Muscle(model=model, end_fitting=stroke.end_fitting, supply_pressure=actuator.supply_pressure)


def _greatest_pull(muscle: Muscle, length: FloatArray) -> FloatArray:
    """Greatest tension, shape (N,), N; NaN where the law was not identified or the limb is shorter than its fitting."""
    assert muscle.end_fitting is not None
    pull = np.full(length.shape, np.nan)
    rows = np.flatnonzero(length > muscle.end_fitting)
    if rows.size:
        pull[rows] = np.ma.filled(muscle.force_limits(length[rows], outside="mark")[1], np.nan)
    return pull
