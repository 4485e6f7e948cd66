"""Equations of motion of a closed chain at one state: forces of the open tree and the effect of the multipliers.

When a motion or its forces are refused: loops that open, efforts that nothing makes, singular configurations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ....core.errors import (
    InvalidInput,
    MasslessMotion,
    NearSingularConfiguration,
    SingularConfiguration,
    UndrivenMotion,
)
from ....core.records import Record
from ....core.validation import FloatArray, as_finite, as_mapping
from ...kinematics.rank import RESOLVED, configuration_error, rank_tolerance
from ...kinematics.structural_rank import structural_rank
from ...structure.chain_state import CLOSED, ChainState
from ...structure.motion_axes import carried_joints, symmetric
from . import equation_kernels as kernels
from .solution_kernels import fill_solutions, largest_of_loops, new_memory

#: Largest opening of the loops by a motion, as a share of its size: rounding of dependent_motion, of projections and
#: of typed numbers.
OPENING = 1e-6
#: Least size of a motion in that comparison, characteristic lengths and rad a second (and squared), so that rounding
#: at rest does not count as a motion that opens the loops.
REST = 1e-3
#: Opening below which every motion keeps the loops closed.
STILL = OPENING * REST
#: Largest error of the equations of motion, as a share of the forces of the coordinate's joint and loops.
EXACT = 1e-7
#: A motion whose inertia is below this share of the largest counts as moving no mass.
MASSLESS = 1e-13
#: Axes of hinges no farther apart are in one line, rad and characteristic lengths.
_IN_LINE = 1e-3
#: A singular value above this is certain in an exact geometry.
CERTAIN = float(np.sqrt(CLOSED / RESOLVED))
#: Largest residual, the same scaled; largest opening by v and size of v, both scaled; whether q is certainly far from a
#: singular configuration; as :func:`.equation_kernels.moving_loops` returns them.
LoopMotion = tuple[float, float, float, float, bool, bool]


def refuse_opening(state: ChainState, opening: float, size: float, what: str = "velocity") -> None:
    """Raise InvalidInput if a velocity or acceleration opens the loops; both numbers are scaled."""
    if not (opening <= STILL or opening <= max(OPENING, state.contradiction) * max(size, REST)):
        unit = "a second" if what == "velocity" else "a second squared"
        raise InvalidInput(
            f"the {what} opens the loops by {opening:.3g} (characteristic lengths and rad {unit}): expected "
            f"J v = 0 and J a + J̇ v = 0, use project_{what} or dependent_motion"
        )


def refuse_missing(state: ChainState, q: FloatArray, v: FloatArray, opening: float, size: float) -> None:
    """Raise SingularConfiguration if the scaled error of an acceleration in the closures' rows is large.

    ``size`` is that of the motion: the acceleration plus the square of the velocity, scaled.
    """
    if not opening <= max(OPENING, state.contradiction) * max(size, REST):
        raise SingularConfiguration(q, v, opening)


def refuse_near_singular(
    state: ChainState,
    q: FloatArray,
    jacobian: FloatArray,
    gap: float,
    weakest: float = 0.0,
    passive: NDArray[np.int64] | None = None,
) -> None:
    """Raise if forces or accelerations depend on the rounding and the residual of the loops.

    Parameters
    ----------
    state : ChainState
        The chain.
    q, jacobian : ndarray
        Shapes (nq,) and (rows, nv), a closed configuration and the constraint Jacobian there.
    gap : float
        Largest scaled residual of the loops; of no effect in a rounded geometry.
    weakest : float
        A lower bound of the smallest singular value that is not zero of the equations that were solved, metres divided
        by the characteristic length.
    passive : ndarray of int, optional
        The coordinates of these equations; all of them if left out.

    Raises
    ------
    NearSingularConfiguration
        If the error of that singular value is more than a thousandth of it; in a rounded geometry, if the smallest one
        that is not zero away from singular poses is between a tenth of the tolerance of the rank and ten times it, so
        that it may be zero.
    """
    top, joints = state.topology, state.model.njoints
    # The constraints' singular values are no smaller than those of the equations, which are some of their columns.
    if not jacobian.size or (weakest > CERTAIN and not state.tolerance):
        return
    gap = state.uncertainty(gap)
    scaled = jacobian * top.row_scale[:, None] * top.column
    values = np.asarray(np.linalg.svd(scaled, compute_uv=False), dtype=np.float64)
    tolerance = rank_tolerance(scaled.shape, float(values[0]), joints, gap)
    error = configuration_error(values, tolerance, joints, gap) * float(values[0])
    if passive is not None:
        values = np.asarray(np.linalg.svd(scaled[:, passive], compute_uv=False), dtype=np.float64)
        tolerance = rank_tolerance(scaled[:, passive].shape, float(values.max(initial=0.0)), joints, gap)
    if state.tolerance:
        rank = structural_rank(state, q, passive)
        undetermined = [value for value in values[rank - 1 : rank] if 0.1 * tolerance < value <= 10.0 * tolerance]
        if rank and undetermined:
            raise NearSingularConfiguration(q, float(undetermined[0]), tolerance)
        return
    least = float(values[values > tolerance].min(initial=np.inf))
    # Digits that make no difference to the loops may make the last singular value.
    hidden = 10.0 * rank_tolerance(scaled.shape, float(values[0]), joints, state.digits) if state.digits else 0.0
    if error > RESOLVED * least or least < hidden:
        raise NearSingularConfiguration(q, least, max(error, hidden))


def check_solution(
    equations: EquationsOfMotion, passive: NDArray[np.int64], share: float, weakest: float, resolved: bool = True
) -> None:
    """Raise where no efforts make the motion, or near a singular configuration, by :func:`.fill_solutions`."""
    state, top = equations.state, equations.state.topology
    if not share <= max(EXACT, state.contradiction):
        height, count = state.row_count, len(passive)
        left, sizes = np.empty(count), np.empty(state.nv)
        fill_solutions(
            equations.jacobian, equations.tau, equations.tree, top.owners, passive, top.scales, top.length,
            equations.gap, new_memory(height, state.nv, count), np.empty(height), left, sizes,
            np.empty((height, height)),
        )  # fmt: skip
        _refuse_undriven(equations, passive, left, sizes[passive])
    if resolved and (weakest <= CERTAIN or state.tolerance):
        refuse_near_singular(state, equations.q, equations.jacobian, equations.gap, weakest, passive)


def _refuse_undriven(
    equations: EquationsOfMotion, passive: NDArray[np.int64], left: FloatArray, sizes: FloatArray
) -> None:
    """Raise UndrivenMotion, unless what is missing is rounding of weights and inertia forces that cancel (a fall)."""
    state, top = equations.state, equations.state.topology
    weights = equations.weights()
    largest_of_loops(weights, top.blocks[1], top.blocks[3])
    if (np.abs(left) <= max(EXACT, equations.state.contradiction) * np.maximum(sizes, weights[passive])).all():
        return
    scaled = np.zeros(state.model.nv)
    scaled[passive] = left
    names = [str(name) for name in list(state.model.names)[1:]]
    # Forces of slides at the characteristic length, so that no unit decides which joint is first.
    largest_in = {name: float(np.abs(scaled[state.velocity_slice(name)]).max(initial=0.0)) for name in names}
    largest = max(largest_in.values())
    worst = sorted((name for name in names if largest_in[name] > 1e-3 * largest), key=lambda name: -largest_in[name])
    raise UndrivenMotion(equations.q, scaled / top.column, worst)


@dataclass(frozen=True, eq=False)
class EquationsOfMotion(Record):
    """M a + h - passive - external = τ + Jᵀλ at one state; passive are the forces of springs and damping.

    Dry friction is part of τ.

    Attributes
    ----------
    state : ChainState
        The chain.
    q : ndarray
        Shape (nq,).
    tau : ndarray
        Shape (nv,), the left side: generalised forces of the open tree minus those of its springs and dampers,
        N and N m.
    gap : float
        Largest scaled residual of the loops, or the tolerance of the geometry.
    motion : float
        Largest acceleration plus square of a velocity, characteristic lengths and rad a second squared.
    flat : ndarray
        The terms of the closures in one block, see :func:`.equation_kernels.split_terms`.
    """

    state: ChainState
    q: FloatArray
    tau: FloatArray
    gap: float
    motion: float
    flat: FloatArray

    @cached_property
    def _terms(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, int]:
        shape = self.state.row_count, self.state.nv, self.state.model.njoints
        terms: tuple[FloatArray, FloatArray, FloatArray, FloatArray, int] = kernels.split_terms.plain(self.flat, shape)
        return terms

    @property
    def jacobian(self) -> FloatArray:
        """J, shape (rows, nv)."""
        return self._terms[0]

    @property
    def unit(self) -> FloatArray:
        """Shape (rows, 6), the wrench on the body of frame a for a multiplier of one, about the world's origin."""
        return self._terms[1]

    @property
    def tree(self) -> FloatArray:
        """Shape (njoints, 6), the wrench of every joint on its child at λ = 0, about the world's origin."""
        return self._terms[2]

    @property
    def poses(self) -> FloatArray:
        """Shape (njoints, 4, 3), as in :class:`exo_pin.chain.structure.memory.chain_buffers.ChainBuffers`."""
        return self._terms[3]

    def wrenches(self, multipliers: FloatArray) -> FloatArray:
        """All joints' and closures' wrenches, each about its own point, world axes, for sets of multipliers.

        Parameters
        ----------
        multipliers : ndarray
            Shape (rows, sets). The forces of the open tree count in the first set only.

        Returns
        -------
        ndarray
            Shape (6 (njoints - 1 + m), sets), joints but the world's first, then closures.
        """
        top = self.state.topology
        out = np.empty((6 * (len(self.tree) - 1 + len(top.kinds)), multipliers.shape[1]))
        columns = np.ascontiguousarray(multipliers)  # another order would be compiled anew
        kernels.wrenches_of(self.poses, self.tree, self.unit, top.carried, top.loops, columns, out)
        return out

    def weights(self) -> FloatArray:
        """Weight and inertia force, not cancelled, of what each coordinate carries, shape (nv,), N m (scaled)."""
        state, top = self.state, self.state.topology
        masses = carried_joints(state.model) @ np.array([inertia.mass for inertia in state.model.inertias])
        pull = float(np.linalg.norm(state.gravity)) + top.length * self.motion
        return np.asarray(top.length * pull * masses[top.owners])

    def metric(self, start: FloatArray, stresses: FloatArray, metric: str) -> FloatArray:
        """The forces whose sum of squares a metric minimises, N, for λ = start + stresses z.

        Returns
        -------
        ndarray
            Shape (p, 1 + k): at z = 0 in the first column, its change per unit of z in the others.
        """
        top = self.state.topology
        columns = np.column_stack([start, stresses])
        if metric == "closures":
            return np.where(top.row_metres, 1.0, 1.0 / top.length)[:, None] * columns
        wrenches = self.wrenches(columns).reshape(-1, 6, columns.shape[1])
        wrenches[:, 3:] /= top.length
        return wrenches.reshape(-1, columns.shape[1])


def open_tree(
    state: ChainState, q: FloatArray, v: FloatArray, a: FloatArray, external: Mapping[str, ArrayLike] | None
) -> FloatArray:
    """Generalised forces of the open tree without its springs and dampers, shape (nv,); fills ``forces``.

    Dry friction is not in them: callers know whether joints slide or rest. The poses in the buffers must be up to date.
    """
    work = state.buffers
    if external is None:
        tau = np.array(pin.rnea(state.model, work.data, q, v, a))
    else:
        work.external[:] = 0.0
        for name, given in wrenches_on(state, external).items():
            add_push(state, name, given, work.poses, work.external)
        tau = np.array(pin.rnea(state.model, work.data, q, v, a, work.external_vector))
    if state.passive.act:
        tau -= state.passive.force(q, v)
    return tau


def moving_loops(state: ChainState, q: FloatArray, v: FloatArray) -> LoopMotion:
    """Fill the ``gap``, ``jacobian``, ``jacobian_rate`` and ``drift`` of the buffers at a state of motion."""
    work, top = state.buffers, state.topology
    work.jacobian_rates(q, v)
    found: LoopMotion = kernels.moving_loops.run(
        work.poses, work.J, work.dJ, v, top.loops, work.q, top.scales,
        work.gap, work.jacobian, work.jacobian_rate, work.drift, True,
    )  # fmt: skip
    return found


def wrenches_on(state: ChainState, external: Mapping[str, ArrayLike] | None) -> dict[str, FloatArray]:
    """Wrenches on frames, each as an array of its own, shape (6,), N and N m."""
    given = as_mapping("external", external, "frames to wrenches")
    for name in given:
        state.frame_index(name)
    return {name: as_finite(f"external[{name!r}]", value, (6,)) for name, value in given.items()}


def add_push(state: ChainState, name: str, given: FloatArray, poses: FloatArray, out: FloatArray) -> None:
    """Add a wrench on a frame to those on the joints' bodies, in their own axes about their own origins.

    Parameters
    ----------
    name : str
        Of the frame.
    given : ndarray
        Shape (..., 6), about the frame's origin, world axes, N and N m.
    poses, out : ndarray
        Shapes (..., njoints, 4, 3), as in :class:`EquationsOfMotion`, and (..., njoints, 6).
    """
    frame = state.model.frames[state.frame_index(name)]
    to_local = poses[..., frame.parentJoint, :3, :]
    force, moment = (np.einsum("...ij,...j->...i", to_local, part) for part in (given[..., :3], given[..., 3:]))
    out[..., frame.parentJoint, :3] += force
    out[..., frame.parentJoint, 3:] += moment + np.cross(frame.placement.translation, force)


def inertia_matrix(state: ChainState, q: FloatArray) -> FloatArray:
    """M, shape (nv, nv), rotors included. Pinocchio fills the upper half."""
    nv = state.model.nv
    found: FloatArray = symmetric(np.reshape(pin.crba(state.model, state.buffers.data, q), (nv, nv)).T)
    return found


def massless_motion(state: ChainState, q: FloatArray, basis: FloatArray) -> MasslessMotion:
    """The error of the motion of least inertia among those of a basis."""
    column = state.topology.column
    M = inertia_matrix(state, q) * column[:, None] * column
    way = np.abs(basis @ np.linalg.eigh(basis.T @ M @ basis)[1][:, 0])
    names = [str(name) for name in list(state.model.names)[1:]]
    moved = {name: float(way[state.velocity_slice(name)].max(initial=0.0)) for name in names}
    largest = max(moved.values())
    found = sorted((name for name in names if moved[name] > 0.1 * largest), key=lambda name: -moved[name])
    pin.computeJointJacobians(state.model, state.buffers.data, q)
    world = np.array(state.buffers.data.J).reshape(6, -1)
    world[:3] /= state.topology.length
    hinges = {name: world[:, own.start] for name in found if (own := state.velocity_slice(name)).stop == own.start + 1}
    for one, other in combinations(sorted(hinges, key=names.index), 2):
        pair = np.array([hinges[one], hinges[other]])
        pair = pair / np.linalg.norm(pair[:, 3:], axis=1, keepdims=True).clip(min=0.5)
        off = min(np.abs(pair[0] - side * pair[1]).max() for side in (1.0, -1.0))
        if off < _IN_LINE and np.linalg.norm(pair[0, 3:]) > 0.5:
            return MasslessMotion(found, (one, other))
    return MasslessMotion(found)
