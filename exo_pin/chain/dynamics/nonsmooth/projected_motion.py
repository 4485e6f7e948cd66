"""Constrained motion in the null space of the closures: acceleration, and its change with generalised forces.

a = a_0 + Z z with J Z = 0 and J a_0 = -J̇ v, (ZᵀMZ) z = Zᵀ(forces - M a_0).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ....core.errors import LoopNotClosed, SolverFailed
from ....core.records import keeps_read_only
from ....core.validation import FloatArray
from ...kinematics.closing import NOTHING_HELD, nearest_closed
from ...kinematics.kernels.dependent_kernels import nearest_motion
from ...kinematics.rank import rank_tolerance
from ...structure.chain_state import CLOSED, ChainState
from ..equations.equation_kernels import clear_motion
from ..equations.equations_of_motion import (
    MASSLESS,
    LoopMotion,
    inertia_matrix,
    massless_motion,
    moving_loops,
    open_tree,
)

#: A coordinate moves in no motion if its rows in an orthonormal basis are below this; its acceleration is rounding
#: below the second, a share of the largest.
_LOCKED, _ROUNDING = 1e-9, 1e-11
#: Most steps from open loops of a motion in time to closed ones.
_NEAR = 20


@keeps_read_only
class Applied(NamedTuple):
    """What makes a motion.

    Attributes
    ----------
    efforts : ndarray
        Shape (nv,), N and N m.
    external : mapping or None
        Wrenches on frames, as for :meth:`exo_pin.ClosedChain.inverse_dynamics`.
    """

    efforts: FloatArray
    external: Mapping[str, ArrayLike] | None

    def plus(self, force: FloatArray) -> Applied:
        """The same with generalised forces, shape (nv,), added to the efforts."""
        return self._replace(efforts=self.efforts + force)


@keeps_read_only
class ProjectedMotion(NamedTuple):
    """Motion of a chain at one state.

    Attributes
    ----------
    a : ndarray
        Shape (nv,), the acceleration, m/s² and rad/s².
    basis, ways, sizes : ndarray
        Shapes (nv, k), (k, k) and (k,): an orthonormal basis of the motions, metres divided by the characteristic
        length, and the eigenvectors and eigenvalues of the mass matrix in it.
    column : ndarray
        Shape (nv,), which takes those lengths to metres.
    """

    a: FloatArray
    basis: FloatArray
    ways: FloatArray
    sizes: FloatArray
    column: FloatArray

    @property
    def response(self) -> FloatArray:
        """R, shape (nv, k): generalised forces f change a by R Rᵀ f."""
        return np.asarray(self.column[:, None] * (self.basis @ (self.ways / np.sqrt(self.sizes))))

    def of(self, index: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Rows of the response and accelerations of some coordinates, shapes (n, k) and (n,), in lengths of one.

        A coordinate that the loops lock has a row of zeros, not of rounding, which forces would be divided by; its
        acceleration is zero where it is rounding, and else what the velocity makes it, as at a dead centre.
        """
        column = self.column[index]
        rows, start = self.response[index] / column[:, None], self.a[index] / column
        locked = np.linalg.norm(self.basis[index], axis=1) <= _LOCKED
        rows[locked] = 0.0
        start[locked & (np.abs(start) <= _ROUNDING * np.abs(self.a / self.column).max(initial=0.0))] = 0.0
        return rows, start


def projected_motion(state: ChainState, q: FloatArray, v: FloatArray, applied: Applied) -> ProjectedMotion:
    """Motion under forces; :func:`~..equations.equations_of_motion.moving_loops` must have been called.

    Raises
    ------
    MasslessMotion
        If some motion has no inertia.
    """
    work, column = state.buffers, state.topology.column
    right = -work.drift
    forces = column * (applied.efforts - open_tree(state, q, v, np.zeros(state.model.nv), applied.external))
    # a = start + column basis z: metres in characteristic lengths, as the rows.
    M, start, basis, ways, sizes = _reduced(state, q, right)
    if not basis.shape[1]:
        return ProjectedMotion(start, basis, ways, sizes, column)
    push = ways.T @ (basis.T @ (forces - M @ (start / column)))
    return ProjectedMotion(start + column * (basis @ (ways @ (push / sizes))), basis, ways, sizes, column)


def response_at(state: ChainState, q: FloatArray) -> ProjectedMotion:
    """The motions at q and their inertia, with a = 0: for changes of the velocity by impulses.

    Raises
    ------
    MasslessMotion
        If some motion has no inertia.
    """
    state.buffers.linearise(q)
    _, start, basis, ways, sizes = _reduced(state, q, np.zeros(state.row_count))
    return ProjectedMotion(np.zeros_like(start), basis, ways, sizes, state.topology.column)


def _reduced(
    state: ChainState, q: FloatArray, right: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """M in characteristic lengths, the least x with J x = right, the motions, and M's eigenvectors and values there."""
    work, top = state.buffers, state.topology
    J, gap = work.jacobian, residual_of_rank(state, q, state.scaled_gap())
    M = inertia_matrix(state, q) * top.column[:, None] * top.column
    start, basis, _ = nearest_motion(J, right, top.scales, state.model.njoints, gap, True)
    if not basis.shape[1]:
        return M, start, basis, np.zeros((0, 0)), np.array([])
    sizes, ways = np.linalg.eigh(basis.T @ M @ basis)
    if not sizes[0] > MASSLESS * max(float(sizes[-1]), float(np.abs(np.diag(M)).max(initial=0.0))):
        raise massless_motion(state, q, basis)
    return M, start, basis, ways, sizes


def residual_of_rank(state: ChainState, q: FloatArray, gap: float) -> float:
    """The scaled residual with which the rank of open loops is that of the closed ones nearby.

    Within a step of an integration the loops are open. Redundant rows of an overconstrained
    mechanism contradict each other there, in proportion to ``gap``, and must not become constraints.

    Parameters
    ----------
    state : ChainState
        The chain; its buffers are linearised at q afterwards.
    q : ndarray
        Shape (nq,).
    gap : float
        Largest scaled residual there.
    """
    least = state.uncertainty(min(gap, CLOSED))
    if gap <= max(least, CLOSED):
        return least
    work, top, joints = state.buffers, state.topology, state.model.njoints

    def spectrum(at: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
        work.linearise(at)
        scaled = work.jacobian * top.row_scale[:, None] * top.column
        values = np.asarray(np.linalg.svd(scaled, compute_uv=False), dtype=np.float64)
        kept = [rank_tolerance(work.jacobian.shape, float(values[0]), joints, size) for size in (least, gap)]
        return values, np.asarray(np.count_nonzero(values > np.array(kept)[:, None], axis=1))

    values, ranks = spectrum(q)
    found = least
    if ranks[0] != ranks[1]:
        with suppress(LoopNotClosed):
            there = nearest_closed(state, q, NOTHING_HELD, 1e-12, _NEAR)[0]
            rank = int(spectrum(there)[1][0])
            if 0 < rank < ranks[0]:
                # Between the two singular values, whatever their sizes.
                between = math.sqrt(float(values[rank - 1] * values[rank]))
                found = between / rank_tolerance(work.jacobian.shape, float(values[0]), 0, 1.0)
        work.linearise(q)
    return found


#: What :func:`~exo_pin.chain.dynamics.equations.equation_kernels.missed` returns.
Missed = tuple[float, float, float, bool]


def clear_acceleration(
    state: ChainState, q: FloatArray, v: FloatArray, efforts: FloatArray, external: Mapping[str, ArrayLike] | None
) -> tuple[LoopMotion, FloatArray | None, Missed | None]:
    """The loops of a moving chain, and its acceleration by projection, without friction and stops.

    Returns
    -------
    tuple
        What :func:`moving_loops` returns; the acceleration, and what
        :func:`~exo_pin.chain.dynamics.equations.equation_kernels.missed` returns for it, None where it is in doubt.
    """
    work = state.buffers
    pin.computeJointJacobiansTimeVariation(state.model, work.data, q, v)
    if external is None and not state.passive.act:
        pin.rnea(state.model, work.data, q, v, work.still)
        forces = efforts - work.tau
    else:
        forces = efforts - open_tree(state, q, v, work.still, external)
    pin.crba(state.model, work.data, q)
    found, clear, a, error = clear_motion.run(
        work.poses, work.J, work.dJ, v, q, work.constants, work.gap, work.jacobian, work.jacobian_rate,
        work.drift, work.trees[2], forces, (state.tolerance, CLOSED, MASSLESS),
    )  # fmt: skip
    return (found, a, error) if clear else (found, None, None)


def acceleration(state: ChainState, q: FloatArray, v: FloatArray, applied: Applied) -> FloatArray:
    """Acceleration without dry friction and stops, for the integrator.

    Raises
    ------
    MasslessMotion
        If some motion has no inertia.
    SolverFailed
        If the answer is not finite.
    """
    _, a, _ = clear_acceleration(state, q, v, applied.efforts, applied.external)
    if a is None:
        moving_loops(state, q, v)
        a = projected_motion(state, q, v, applied).a
    if not np.isfinite(a).all():
        raise SolverFailed("the constrained dynamics", np.inf, "the acceleration is not finite")
    return a
