"""Equations of motion of a closed chain at one state: forces of the open tree and the effect of the multipliers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, LoopNotClosed, NearSingularConfiguration, SingularConfiguration
from ...core.validation import FloatArray, as_finite, as_mapping, frozen
from ..kinematics.rank import RESOLVED, configuration_error, rank_tolerance
from ..kinematics.structural_rank import structural_rank
from ..structure.chain_state import CLOSED, ChainState
from ..structure.motion_axes import carried_joints
from . import equation_kernels as kernels

#: Largest opening of the loops by a motion, as a share of its size: rounding of dependent_motion, of projections and
#: of typed numbers.
_OPENING = 1e-6
#: Largest residual, the same scaled; largest opening by v and size of v, both scaled; whether q is certainly far from a
#: singular configuration.
LoopMotion = tuple[float, float, float, float, bool, bool]
#: Least size of a motion in that comparison, characteristic lengths and rad a second (and squared), so that rounding
#: at rest does not count as a motion that opens the loops.
_REST = 1e-3


@dataclass(frozen=True, eq=False, slots=True)
class EquationsOfMotion:
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
    jacobian : ndarray
        J, shape (rows, nv).
    gap : float
        Largest scaled residual of the loops, or the tolerance of the geometry.
    motion : float
        Largest acceleration plus square of a velocity, characteristic lengths and rad a second squared.
    poses : ndarray
        Shape (njoints, 4, 3), as in :class:`exo_pin.chain.structure.memory.chain_buffers.ChainBuffers`.
    tree : ndarray
        Shape (njoints, 6), the wrench that every joint transmits to its child at λ = 0, about the world's origin.
    unit : ndarray
        Shape (rows, 6), the wrench on the body of frame a for a multiplier of one, about the world's origin.
    """

    state: ChainState
    q: FloatArray
    tau: FloatArray
    jacobian: FloatArray
    gap: float
    motion: float
    poses: FloatArray
    tree: FloatArray
    unit: FloatArray

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


def equations_of_motion(
    state: ChainState,
    q: FloatArray,
    v: FloatArray | None,
    a: FloatArray | None,
    external: Mapping[str, ArrayLike] | None = None,
    check_closed: bool = True,
) -> EquationsOfMotion:
    """Equations of motion at a state.

    Parameters
    ----------
    state : ChainState
        The chain.
    q, v, a : ndarray
        Shapes (nq,), (nv,), (nv,), checked; None counts as zero.
    external : mapping, optional
        As for :meth:`exo_pin.chain.ClosedChain.rnea`.
    check_closed : bool
        Whether to raise if the loops are open or the motion opens them.

    Raises
    ------
    LoopNotClosed
        If the residual of the loops exceeds 1e-8.
    InvalidInput
        If the motion opens the loops.
    UnknownName
        If a frame is not known.
    """
    work, top, model = state.buffers, state.topology, state.model
    moves = (v is not None and bool(v.any())) or (a is not None and bool(a.any()))
    # Arrays of one kind: kernels are compiled anew for those that can be written.
    v, a = (frozen(np.zeros(state.nv) if rates is None else rates.view()) for rates in (v, a))
    if moves and check_closed:
        work.jacobian_rates(q, v)
    else:
        pin.computeJointJacobians(model, work.data, q)
        np.copyto(work.q, q)
    tau = open_tree(state, q, v, a, external)
    jacobian, unit, tree, poses, worst, gap, speed, size, opening_v, opening_a = kernels.equations(
        work.poses, work.J, work.dJ, work.forces, v, a, moves and check_closed, top.loops, work.q, top.scales
    )
    if check_closed:
        if not worst <= state.closed:
            raise LoopNotClosed(q.copy(), worst, 0)
        refuse_opening(state, opening_v, speed)
        refuse_opening(state, opening_a, size, "acceleration")
    return EquationsOfMotion(state, q, tau, jacobian, state.uncertainty(gap), size, poses, tree, unit)


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
        put_on(state, external)
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
        work.gap, work.jacobian, work.jacobian_rate, work.drift,
    )  # fmt: skip
    return found


def refuse_opening(state: ChainState, opening: float, size: float, what: str = "velocity") -> None:
    """Raise InvalidInput if a velocity or acceleration opens the loops; both numbers are scaled."""
    if not opening <= max(_OPENING, state.contradiction) * max(size, _REST):
        unit = "a second" if what == "velocity" else "a second squared"
        raise InvalidInput(
            f"the {what} opens the loops by {opening:.3g} (characteristic lengths and rad {unit}): expected J v = 0 "
            f"and J a + J̇ v = 0, use project_{what} or dependent_motion"
        )


def refuse_missing(state: ChainState, q: FloatArray, v: FloatArray, opening: float, size: float) -> None:
    """Raise SingularConfiguration if the scaled error of an acceleration in the closures' rows is large.

    ``size`` is that of the motion: the acceleration plus the square of the velocity, scaled.
    """
    if not opening <= max(_OPENING, state.contradiction) * max(size, _REST):
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
    if not jacobian.size or (weakest**2 > CLOSED / RESOLVED and not state.tolerance):
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
    if error > RESOLVED * least:
        raise NearSingularConfiguration(q, least, error)


def put_on(state: ChainState, external: Mapping[str, ArrayLike] | None) -> None:
    """Add wrenches on frames to the external forces of the buffers; the poses there must be up to date."""
    work, frames = state.buffers, state.model.frames
    for name, value in as_mapping("external", external, "frames to wrenches").items():
        frame = frames[state.frame_index(name)]
        given = as_finite(f"external[{name!r}]", value, (6,))
        to_local = work.poses[frame.parentJoint, :3]
        force = to_local @ given[:3]
        work.external[frame.parentJoint, :3] += force
        work.external[frame.parentJoint, 3:] += to_local @ given[3:] + np.cross(frame.placement.translation, force)
