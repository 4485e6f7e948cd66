"""Coulomb friction of joints: known where a joint moves, a range where it is at rest.

    f = lower where v > 0, or v = 0 and it starts to move with v > 0
    f = upper where v < 0, or v = 0 and it starts to move with v < 0
    lower <= f <= upper at rest

with ``model.lowerDryFrictionLimit`` and ``model.upperDryFrictionLimit``, N or N m: usually -μ and μ. Assumptions:

* The limits do not depend on the load in the joint, and friction at rest is no larger than in motion.
* Joints with several coordinates have friction in each of them by itself, in the axes of their v.

Friction of joints at rest in inverse dynamics: an unknown force in a known range.

In a joint without actuator it is the whole force of the joint. In an actuated joint only the sum of effort and friction
is in the equations of motion, so that the effort is known up to the range of the friction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....core.errors import UnsupportedDynamics
from ....core.records import keeps_read_only
from ....core.validation import FloatArray, frozen
from ...structure.chain_state import ActuatedCoordinates, ChainState

#: A coordinate moves or accelerates if it does so by more than this, characteristic lengths and rad a second (and
#: squared).
REST = 1e-9


@keeps_read_only
class Rubbing(NamedTuple):
    """Dry friction at one state of motion.

    Attributes
    ----------
    force : ndarray
        Shape (nv,), friction of the coordinates that slide, N and N m, zero elsewhere.
    rest : ndarray of int
        Indices in v of the coordinates with friction that are at rest.
    low, high : ndarray
        Shape (nv,), range of the friction at rest.
    """

    force: FloatArray
    rest: NDArray[np.int64]
    low: FloatArray
    high: FloatArray


def friction_of(state: ChainState, v: FloatArray, a: FloatArray | None = None) -> Rubbing:
    """Friction at a velocity, shape (nv,).

    An acceleration, shape (nv,), gives the direction of motion where v is zero.
    """
    low, high = state.passive.dry_friction
    column = state.topology.column
    sign = _signs(v / column)
    if a is not None:
        sign = np.where(sign == 0, _signs(a / column), sign)
    rubs = (low != 0.0) | (high != 0.0)
    force = np.where(sign > 0, low, np.where(sign < 0, high, 0.0))
    return Rubbing(force, np.flatnonzero(rubs & (sign == 0)), low, high)


def _signs(values: FloatArray) -> NDArray[np.int64]:
    return np.where(np.abs(values) > REST, np.sign(values), 0.0).astype(np.int64)


def joint_names(state: ChainState, indices: NDArray[np.int64]) -> list[str]:
    """Joints of some coordinates of v, in the tree's order."""
    chosen = set(indices.tolist())
    names = [str(name) for name in list(state.model.names)[1:]]
    return [name for name in names if chosen & set(range(*state.velocity_slice(name).indices(state.nv)))]


def refuse_rest(state: ChainState, rubbing: Rubbing, advice: str) -> None:
    """Raise UnsupportedDynamics if a joint with friction is at rest, so that its friction is a range."""
    if len(rubbing.rest):
        raise UnsupportedDynamics("dry friction at rest", joint_names(state, rubbing.rest), advice)


@keeps_read_only
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
    """Coordinates that an actuator or friction at rest holds, and the others; the drive itself where nothing rests."""
    if not len(rubbing.rest):
        return drive
    return ActuatedCoordinates(
        frozen(np.union1d(drive.driven, rubbing.rest)), frozen(np.setdiff1d(drive.passive, rubbing.rest))
    )


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
