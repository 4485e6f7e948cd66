"""Equations of motion of a closed chain at one state: forces of the open tree and the effect of the multipliers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ....core.errors import LoopNotClosed
from ....core.records import Record
from ....core.validation import FloatArray, as_finite, as_mapping, frozen
from ...structure.chain_state import ChainState
from ...structure.motion_axes import carried_joints
from . import equation_kernels as kernels
from .refusals import refuse_opening

#: Largest residual, the same scaled; largest opening by v and size of v, both scaled; whether q is certainly far from a
#: singular configuration.
LoopMotion = tuple[float, float, float, float, bool, bool]


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
        kernels.wrenches_of(self.poses, self.tree, self.unit, top.carried, top.loops, columns, 0, out)
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
        As for :meth:`exo_pin.chain.ClosedChain.inverse_dynamics`.
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
    v, a, moves, tau = tree_terms(state, q, v, a, external, check_closed)
    work, top = state.buffers, state.topology
    flat = np.empty(kernels.terms_size(state.row_count, state.nv, state.model.njoints))
    found = kernels.equations(
        work.poses, work.J, work.dJ, work.forces, True, v, a, moves, top.loops, work.q, top.scales,
        work.jacobian_rate, flat,
    )  # fmt: skip
    return checked_equations(state, q, tau, found, flat, check_closed)


def tree_terms(
    state: ChainState,
    q: FloatArray,
    v: FloatArray | None,
    a: FloatArray | None,
    external: Mapping[str, ArrayLike] | None,
    check_closed: bool = True,
) -> tuple[FloatArray, FloatArray, bool, FloatArray]:
    """Fill the buffers with what :func:`.equation_kernels.equations` takes of the open tree.

    Returns
    -------
    tuple
        Velocity and acceleration, read-only; whether there is a motion; generalised forces of the tree.
    """
    work = state.buffers
    moves = check_closed and not (v is None and a is None)
    # Arrays of one kind: kernels are compiled anew for those that can be written.
    v, a = (work.still if rates is None else frozen(rates.view()) for rates in (v, a))
    if moves:
        work.jacobian_rates(q, v)
    else:
        pin.computeJointJacobians(state.model, work.data, q)
        np.copyto(work.q, q)
    return v, a, moves, open_tree(state, q, v, a, external)


def checked_equations(
    state: ChainState, q: FloatArray, tau: FloatArray, found: Sequence[float], flat: FloatArray, check_closed: bool
) -> EquationsOfMotion:
    """The equations of motion with what the kernel found; see :func:`equations_of_motion`."""
    worst, gap, speed, size, opening_v, opening_a = found
    if check_closed:
        if not worst <= state.closed:
            raise LoopNotClosed(q.copy(), worst, 0)
        refuse_opening(state, opening_v, speed)
        refuse_opening(state, opening_a, size, "acceleration")
    return EquationsOfMotion.made_of(state=state, q=q, tau=tau, gap=state.uncertainty(gap), motion=size, flat=flat)


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
