"""Inverse dynamics of many samples, one by one: a sample without an answer marks itself."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....core.errors import ExoPinError, InvalidInput, SamplesFailed, UnknownName
from ....core.progress import track
from ....core.validation import LARGEST, FloatArray, as_mapping, as_real, frozen
from ...kinematics import closing
from ...kinematics.loops import project_acceleration, project_velocity
from ...structure.chain_state import ChainState
from ..reactions import ClosedForces
from .force_stacks import ClosedForcesStack

#: Forces of one sample at q, v and a, under wrenches on frames.
One = Callable[[FloatArray, FloatArray | None, FloatArray | None, Mapping[str, FloatArray] | None], ClosedForces]


class _Arrays(NamedTuple):
    """What is filled sample by sample; see :class:`ClosedForcesStack`."""

    tau: FloatArray
    friction: FloatArray
    multipliers: FloatArray
    residual: FloatArray
    undetermined: NDArray[np.int64]
    unique: NDArray[np.bool_]
    poses: FloatArray
    tree: FloatArray
    unit: FloatArray
    start: FloatArray
    sharpness: FloatArray
    stresses: list[FloatArray]

    def put(self, k: int, forces: ClosedForces) -> None:
        """Take over the forces of one sample."""
        equations = forces._equations
        self.tau[k], self.friction[k], self.multipliers[k] = forces.tau, forces.friction, forces.multipliers
        self.residual[k], self.undetermined[k] = forces.residual, forces.undetermined
        self.unique[k], self.start[k] = forces.effort_is_unique, forces._start
        self.poses[k], self.tree[k], self.unit[k] = equations.poses, equations.tree, equations.unit
        self.sharpness[k], self.stresses[k] = forces._sharpness, forces.self_stresses


def stack_of_forces(
    state: ChainState,
    motion: tuple[ArrayLike, ArrayLike | None, ArrayLike | None],
    external: Mapping[str, ArrayLike] | None,
    one: One,
    close: bool,
    progress: bool,
) -> ClosedForcesStack:
    """Forces of n samples.

    Parameters
    ----------
    state : ChainState
        The chain.
    motion : tuple of array_like
        q, v, a of shapes (n, nq), (n, nv) and (n, nv); zero for None.
    external : mapping or None
        Frame name to wrench, shape (6,) or (n, 6).
    one : callable
        :data:`One`.
    close : bool
        Whether to close the loops and to project the motion.
    progress : bool
        Whether to show a bar.
    """
    q, v, a = _samples(state, motion)
    wrenches = {
        name: _shaped(f"external[{name!r}]", given, len(q), 6)
        for name, given in as_mapping("external", external, "frames to wrenches").items()
    }
    errors: dict[int, ExoPinError] = {}
    if close:
        _close(state, q, errors, progress)
        a = np.zeros((len(q), state.nv)) if a is None and v is not None else a
    arrays, bounded = _empty(state, len(q)), dict[int, ClosedForces]()
    for k in track([k for k in range(len(q)) if k not in errors], "forces", progress):
        try:
            speed, rate = (None if rates is None else rates[k] for rates in (v, a))
            if close:
                speed, rate = projected(state, q[k], speed, rate)
            forces = one(q[k], speed, rate, {name: given[k] for name, given in wrenches.items()} or None)
        except UnknownName:  # a mistake of the question, not of the sample
            raise
        except ExoPinError as error:
            errors[k] = error
            continue
        for rates, own in ((v, speed), (a, rate)):
            if rates is not None:
                rates[k] = own
        arrays.put(k, forces)
        if forces.is_bounded:
            bounded[k] = forces
    return _stack(state, (q, v, a), arrays, errors, bounded)


def projected(
    state: ChainState, q: FloatArray, v: ArrayLike | None, a: ArrayLike | None
) -> tuple[FloatArray | None, FloatArray | None]:
    """The nearest velocity and acceleration that keep the loops closed; None stays where nothing moves."""
    if v is None and a is None:
        return None, None
    still = np.zeros(state.nv)
    speed = None if v is None else project_velocity(state, q, v)
    return speed, project_acceleration(state, q, still if speed is None else speed, still if a is None else a)


def _samples(
    state: ChainState, motion: tuple[ArrayLike, ArrayLike | None, ArrayLike | None]
) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
    given = as_real("q", motion[0])
    if given.ndim != 2 or given.shape[1] != state.nq:
        raise InvalidInput(f"expected q to have shape (n, {state.nq}), got {given.shape}")
    v, a = (
        None if rates is None else _shaped(name, rates, len(given), state.nv)
        for name, rates in zip("va", motion[1:], strict=True)
    )
    return given, v, a


def _shaped(name: str, value: ArrayLike, count: int, size: int) -> FloatArray:
    """Real numbers of shape (count, size), of which every sample may have the same; they need not be finite."""
    array = as_real(name, value)
    if array.shape not in ((size,), (count, size)):
        raise InvalidInput(f"expected {name} to have shape ({count}, {size}) or ({size},), got {array.shape}")
    return np.array(np.broadcast_to(array, (count, size)))


def _close(state: ChainState, q: FloatArray, errors: dict[int, ExoPinError], progress: bool) -> None:
    """Close the loops of samples in place; those that do not close keep what they had."""
    some = np.flatnonzero((np.abs(q) <= LARGEST).all(axis=1))  # and no NaN
    try:
        q[some] = closing.close(state, q[some], progress=progress)
    except SamplesFailed as failed:
        errors.update({int(some[k]): error for k, error in failed.failures.items()})
        q[some] = np.where(np.isnan(failed.result), q[some], failed.result)


def _empty(state: ChainState, count: int) -> _Arrays:
    """Arrays of samples without an answer."""
    rows, nv, joints = state.row_count, state.nv, state.model.njoints

    def unknown(*shape: int) -> FloatArray:
        return np.full((count, *shape), np.nan)

    return _Arrays(
        unknown(nv), unknown(nv), unknown(rows), unknown(), np.full(count, -1), np.zeros((count, nv), dtype=np.bool_),
        unknown(joints, 4, 3), unknown(joints, 6), unknown(rows, 6), unknown(rows), np.zeros(count),
        [np.zeros((rows, 0))] * count,
    )  # fmt: skip


def _stack(
    state: ChainState,
    motion: tuple[FloatArray, FloatArray | None, FloatArray | None],
    arrays: _Arrays,
    errors: Mapping[int, ExoPinError],
    bounded: Mapping[int, ClosedForces],
) -> ClosedForcesStack:
    count = len(motion[0])
    free = max((null.shape[1] for null in arrays.stresses), default=0)
    columns = np.zeros((count, state.row_count, 2 + free))
    columns[:, :, 0], columns[:, :, 1] = arrays.multipliers, arrays.start - arrays.multipliers
    for k, null in enumerate(arrays.stresses):
        columns[k, :, 2 : 2 + null.shape[1]] = null
    q, v, a = (np.zeros((count, state.nv)) if part is None else part for part in motion)
    words = {k: re.sub(r"(?<!^)(?=[A-Z])", "_", type(error).__name__).lower() for k, error in errors.items()}
    return ClosedForcesStack(
        frozen(q), frozen(v), frozen(a), frozen(arrays.tau), frozen(arrays.friction), frozen(arrays.multipliers),
        frozen(arrays.residual), frozen(arrays.undetermined), frozen(arrays.unique),
        frozen(np.array([words.get(k, "ok") for k in range(count)])), MappingProxyType(dict(sorted(errors.items()))),
        state, frozen(arrays.poses), frozen(arrays.tree), frozen(arrays.unit), frozen(columns),
        frozen(arrays.sharpness), MappingProxyType(dict(bounded)),
    )  # fmt: skip
