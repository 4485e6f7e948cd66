"""Coulomb friction of joints: known where a joint moves, a range where it is at rest.

    f = lower where v > 0, or v = 0 and it starts to move with v > 0
    f = upper where v < 0, or v = 0 and it starts to move with v < 0
    lower <= f <= upper at rest

with ``model.lowerDryFrictionLimit`` and ``model.upperDryFrictionLimit``, N or N m: usually -μ and μ. Assumptions:

* The limits do not depend on the load in the joint, and friction at rest is no larger than in motion.
* Joints with several coordinates have friction in each of them by itself, in the axes of their v.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....core.errors import InvalidInput, UnsupportedDynamics
from ....core.records import reduced_tuple
from ....core.validation import FloatArray, as_mapping, as_real
from ...structure.chain_state import ChainState

#: A coordinate moves or accelerates if it does so by more than this, characteristic lengths and rad a second (and
#: squared).
REST = 1e-9


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

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


def friction_of(state: ChainState, v: FloatArray, *next_signs: FloatArray | None) -> Rubbing:
    """Friction at a velocity, shape (nv,).

    ``next_signs`` have shape (nv,), and give the direction of motion where v is zero, the first that is not zero
    counts: an acceleration, or directions of an impending slip.
    """
    low, high = state.passive.dry_friction
    column = state.topology.column
    sign = _signs(v / column)
    for way in next_signs:
        if way is not None:
            sign = np.where(sign == 0, _signs(way / column), sign)
    rubs = (low != 0.0) | (high != 0.0)
    force = np.where(sign > 0, low, np.where(sign < 0, high, 0.0))
    return Rubbing(force, np.flatnonzero(rubs & (sign == 0)), low, high)


def _signs(values: FloatArray) -> NDArray[np.int64]:
    return np.where(np.abs(values) > REST, np.sign(values), 0.0).astype(np.int64)


def slip_directions(state: ChainState, slip: Mapping[str, object] | None) -> FloatArray | None:
    """Directions of an impending slip by joint as signs, shape (nv,), zero where there is none.

    Raises
    ------
    InvalidInput
        If a direction is not -1, 0 or 1, or the shape does not fit the joint.
    UnknownName
        If a joint is not known.
    """
    if slip is None:
        return None
    signs = np.zeros(state.nv)
    for joint, value in as_mapping("slip", slip, "joints to directions").items():
        own = state.velocity_slice(joint)
        given = as_real(f"slip[{joint!r}]", value)
        if given.shape not in ((), (own.stop - own.start,)) or not np.isin(given, (-1.0, 0.0, 1.0)).all():
            raise InvalidInput(
                f"expected slip[{joint!r}] as {own.stop - own.start} directions, each -1, 0 or 1, got {value!r}"
            )
        signs[own] = given
    return signs * state.topology.column


def joint_names(state: ChainState, indices: NDArray[np.int64]) -> list[str]:
    """Joints of some coordinates of v, in the tree's order."""
    chosen = set(indices.tolist())
    names = [str(name) for name in list(state.model.names)[1:]]
    return [name for name in names if chosen & set(range(*state.velocity_slice(name).indices(state.nv)))]


def refuse_rest(state: ChainState, rubbing: Rubbing, advice: str) -> None:
    """Raise UnsupportedDynamics if a joint with friction is at rest, so that its friction is a range."""
    if len(rubbing.rest):
        raise UnsupportedDynamics("dry friction at rest", joint_names(state, rubbing.rest), advice)
