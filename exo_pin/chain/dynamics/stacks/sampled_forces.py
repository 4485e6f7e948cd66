"""Inverse dynamics of many samples: in compiled code where it has the answer, one by one where that needs care."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....core.errors import ExoPinError, InvalidInput, SamplesFailed, UnknownName
from ....core.progress import track
from ....core.validation import LARGEST, FloatArray, as_mapping, as_real, frozen
from ...kinematics import closing
from ...kinematics.loops import BLOCK, project_acceleration, project_velocity
from ...structure.chain_state import ActuatedCoordinates, ChainState
from ..equations.equation_stacks import passes, trees_of_stack
from ..equations.equations_of_motion import add_push
from ..equations.motion_kernels import NUMBERS, forces_of_stack, forces_size
from ..reactions import ClosedForces
from .force_stacks import ClosedForcesStack

#: Numbers in the blocks of the samples that one call of a kernel takes, at most.
_NUMBERS = 2_000_000
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

    def take(self, into: NDArray[np.int64], flat: FloatArray, numbers: FloatArray, shape: tuple[int, int, int]) -> None:
        """Take over blocks of :func:`split_forces`, and the numbers beside them, of several samples."""
        rows, nv, joints = shape
        ends = np.cumsum([rows * nv, rows * 6, joints * 6, joints * 12, nv, rows, rows])
        parts = np.split(flat[:, : ends[-1]], ends[:-1], axis=1)
        count = len(into)  # -1 has no meaning where a tree has no rows
        self.unit[into], self.tree[into] = parts[1].reshape(count, rows, 6), parts[2].reshape(count, joints, 6)
        self.poses[into] = parts[3].reshape(count, joints, 4, 3)
        self.tau[into], self.multipliers[into], self.start[into] = parts[4:]
        self.undetermined[into], self.sharpness[into] = numbers[:, 6], numbers[:, 7]
        self.residual[into] = numbers[:, 10]
        for k, row, free in zip(into.tolist(), flat, numbers[:, 6].astype(int).tolist(), strict=True):
            if free:
                self.stresses[k] = row[ends[-1] : ends[-1] + rows * free].reshape(rows, free).copy()


def stack_of_forces(
    state: ChainState,
    motion: tuple[ArrayLike, ArrayLike | None, ArrayLike | None],
    external: Mapping[str, ArrayLike] | None,
    fast: tuple[ActuatedCoordinates, str] | None,
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
    fast : tuple or None
        Coordinates with actuators and the metric, where compiled code has the answer of most samples: without bounds,
        objective and dry friction. For None, and where its answer needs care, ``one`` has it.
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
    finite = np.ones(len(q), dtype=np.bool_)
    for each in (q, *(part for part in (v, a) if part is not None), *wrenches.values()):
        finite &= (np.abs(each) <= LARGEST).all(axis=1)  # and no NaN
    errors: dict[int, ExoPinError] = {}
    if close:
        q, v, a = _closed(state, (q, v, a), np.flatnonzero(finite), errors, progress)
    arrays, done = _empty(state, len(q)), np.zeros(len(q), dtype=np.bool_)
    usable = finite & np.array([k not in errors and state.has_unit_turns(row) for k, row in enumerate(q)], dtype=bool)
    if fast is not None and not state.tolerance:
        done = _compiled(state, (q, v, a), wrenches, usable, fast, arrays, progress)
    bounded: dict[int, ClosedForces] = {}
    rest = [int(k) for k in np.flatnonzero(~done) if int(k) not in errors]
    for k in track(rest, "forces", progress and not done.any()):
        try:
            own = {name: given[k] for name, given in wrenches.items()}
            forces = one(q[k], None if v is None else v[k], None if a is None else a[k], own or None)
        except UnknownName:  # a mistake of the question, not of the sample
            raise
        except ExoPinError as error:
            errors[k] = error
            continue
        arrays.put(k, forces)
        done[k] = True
        if forces.is_bounded:
            bounded[k] = forces
    return _stack(state, (q, v, a), arrays, errors, bounded)


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


def _closed(
    state: ChainState,
    motion: tuple[FloatArray, FloatArray | None, FloatArray | None],
    index: NDArray[np.int64],
    errors: dict[int, ExoPinError],
    progress: bool,
) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
    """The motion with closed loops, and the nearest velocities and accelerations that keep them closed."""
    q, v, a = motion

    def of(function: Callable[..., FloatArray], into: FloatArray, *given: FloatArray) -> None:
        """Fill the samples without an error; those that fail keep what they had."""
        some = np.array([k for k in index if int(k) not in errors], dtype=np.int64)
        try:
            found = function(*(part[some] for part in given))
        except SamplesFailed as failed:
            errors.update({int(some[k]): error for k, error in failed.failures.items()})
            found = np.where(np.isnan(failed.result), into[some], failed.result)
        into[some] = found

    of(lambda given: closing.close(state, given, progress=progress), q, q)
    if v is not None:
        of(lambda *given: project_velocity(state, *given), v, q, v)
    if v is not None or a is not None:
        still, a = np.zeros((len(q), state.nv)) if v is None else v, np.zeros((len(q), state.nv)) if a is None else a
        of(lambda *given: project_acceleration(state, *given), a, q, still, a)
    return q, v, a


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


def _compiled(
    state: ChainState,
    motion: tuple[FloatArray, FloatArray | None, FloatArray | None],
    wrenches: Mapping[str, FloatArray],
    usable: NDArray[np.bool_],
    fast: tuple[ActuatedCoordinates, str],
    arrays: _Arrays,
    progress: bool,
) -> NDArray[np.bool_]:
    """Fill the answers of samples that pass every check in compiled code, and say which they are."""
    top, (drive, metric) = state.topology, fast
    _, nv, _ = shape = state.row_count, state.nv, state.model.njoints
    moves = motion[1] is not None or motion[2] is not None
    done, size = np.zeros(len(usable), dtype=np.bool_), forces_size(*shape)
    index, block = np.flatnonzero(usable), max(1, min(BLOCK, _NUMBERS // size))
    for first in track(range(0, len(index), block), "forces", progress):
        own = index[first : first + block]
        q = motion[0][own]
        v, a = (np.zeros((len(own), nv)) if rates is None else rates[own] for rates in motion[1:])
        tree = trees_of_stack(state, q, v if moves else None, a, partial(_pushes, state, wrenches, own))
        flat, numbers = np.empty((len(own), size)), np.empty((len(own), NUMBERS))
        unique = np.empty((len(own), nv), dtype=np.bool_)
        forces_of_stack(
            tree.poses, tree.J, tree.dJ, tree.forces, v, a, moves, tree.tau, q, top.loops, top.scales, top.bodies,
            drive.passive, state.tolerance, metric == "reactions", flat, unique, numbers,
        )  # fmt: skip
        good = passes(state, numbers)
        into = own[good]
        arrays.take(into, flat[good], numbers[good], shape)
        arrays.unique[into], arrays.friction[into] = unique[good], 0.0
        done[into] = True
    return done


def _pushes(
    state: ChainState, wrenches: Mapping[str, FloatArray], own: NDArray[np.int64], poses: FloatArray
) -> FloatArray | None:
    """Wrenches on the joints' bodies, shape (n, njoints, 6), in their own axes; None where there are none."""
    if not wrenches:
        return None
    out = np.zeros((len(own), state.model.njoints, 6))
    for name, given in wrenches.items():
        add_push(state, name, given[own], poses, out)
    return out


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
