"""Friction of joints at rest in inverse dynamics: an unknown force in a known range.

In a joint without actuator it is the whole force of the joint. In an actuated joint only the sum of effort and friction
is in the equations of motion, so that the effort is known up to the range of the friction.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....core.records import reduced_tuple
from ....core.validation import FloatArray, frozen
from ...structure.chain_state import ActuatedCoordinates, ChainState
from ..force_distribution import Bound
from .joint_friction import Rubbing, joint_names


class RestingFriction(NamedTuple):
    """Efforts and friction at rest, whose sum is ``total``; arrays have shape (nv,), N and N m.

    Attributes
    ----------
    actuated, alone : ndarray of bool
        Coordinates at rest with friction: those that carry an actuator, and the others.
    low, high : ndarray
        Range of the friction.
    least, largest : ndarray
        Bounds of the efforts, infinite where there is none.
    total : ndarray
        Effort plus friction at rest.
    total_is_unique : ndarray of bool
        Whether it is the same in every solution.
    """

    actuated: NDArray[np.bool_]
    alone: NDArray[np.bool_]
    low: FloatArray
    high: FloatArray
    least: FloatArray
    largest: FloatArray
    total: FloatArray
    total_is_unique: NDArray[np.bool_]

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    def split(self) -> tuple[FloatArray, FloatArray]:
        """Efforts and friction: the least friction for which efforts are within their bounds."""
        room = np.clip(0.0, self.total - self.largest, self.total - self.least)
        friction = np.where(self.alone, self.total, np.where(self.actuated, np.clip(room, self.low, self.high), 0.0))
        return np.where(self.alone, 0.0, self.total - friction), friction

    def efforts(self, own: slice, totals: FloatArray) -> FloatArray:
        """Ranges of the efforts, shape (k, 2), from those of the totals."""
        low = np.maximum(totals[:, 0] - self.high[own], self.least[own])
        high = np.minimum(totals[:, 1] - self.low[own], self.largest[own])
        ranges = np.where(self.actuated[own, None], np.column_stack([low, high]), totals)
        return np.where(self.alone[own, None], 0.0, ranges)

    def frictions(self, own: slice, friction: FloatArray, totals: FloatArray) -> FloatArray:
        """Ranges of the friction, shape (k, 2), from those of the totals; ``friction`` is that of all coordinates."""
        low = np.maximum(self.low[own], totals[:, 0] - self.largest[own])
        high = np.minimum(self.high[own], totals[:, 1] - self.least[own])
        known = np.column_stack([friction[own], friction[own]])
        ranges = np.where(self.actuated[own, None], np.column_stack([low, high]), known)
        return np.where(self.alone[own, None], totals, ranges)


def bearing_drive(drive: ActuatedCoordinates, rubbing: Rubbing) -> ActuatedCoordinates:
    """Coordinates that an actuator or friction at rest holds, and the others."""
    return ActuatedCoordinates(
        frozen(np.union1d(drive.driven, rubbing.rest)), frozen(np.setdiff1d(drive.passive, rubbing.rest))
    )


def friction_bounds(
    state: ChainState, drive: ActuatedCoordinates, rubbing: Rubbing, force: FloatArray, slope: FloatArray
) -> list[Bound]:
    """Bounds on the friction of joints at rest without actuator, given joint forces and their change per unit of z."""
    found = []
    for k in np.intersect1d(rubbing.rest, drive.passive):
        (joint,) = joint_names(state, np.array([k]))
        low, high = float(rubbing.low[k]), float(rubbing.high[k])
        found.append(Bound(f"friction of {joint}", float(force[k]), slope[k], low, high))
    return found


def resting_friction(
    drive: ActuatedCoordinates,
    rubbing: Rubbing,
    efforts: tuple[FloatArray, FloatArray],
    total: FloatArray,
    unique: NDArray[np.bool_],
) -> RestingFriction:
    """The record, given the bounds of the efforts and the forces of all joints."""
    rests, driven = np.zeros((2, len(total)), dtype=np.bool_)
    rests[rubbing.rest] = True
    driven[drive.driven] = True
    return RestingFriction(
        rests & driven, rests & ~driven, rubbing.low.copy(), rubbing.high.copy(), *efforts, total, unique
    )
