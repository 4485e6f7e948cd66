"""Derivatives of forward dynamics: the implicit function theorem on the equations of a closed chain's motion.

M a + h = τ + Jᵀλ and J a + J̇ v = 0 define a and λ. Their differentials are the same linear equations with other right
sides, so that one factorisation of J and one of the inertia in its null space, ZᵀMZ with J Z = 0, serve all of them:

    da = a_0 + Z (ZᵀMZ)⁻¹ Zᵀ (dτ - dh - dM a + dJᵀ λ - M a_0),    J a_0 = - dJ a - d(J̇ v).

The pieces are Pinocchio's derivatives of RNEA and the changes of the closures of :mod:`.change_kernels`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.compiled import kernel
from ...core.records import Record
from ...core.validation import FloatArray, frozen
from ...numerics.small_linear import solve_transposed
from ..dynamics.equations.equation_kernels import clear_motion
from ..dynamics.equations.equations_of_motion import MASSLESS, STILL, wrenches_on
from ..dynamics.forward_dynamics import ClosedMotion, efforts_of, forward_dynamics
from ..kinematics.kernels.closure_kernels import new_scratch
from ..kinematics.kernels.dependent_kernels import reduced_motion
from ..kinematics.reduced_kinematics import NONE_GIVEN, refuse_choice
from ..structure.chain_state import CLOSED, ChainState
from ..structure.memory.chain_buffers import unpacked_constants
from .change_kernels import motion_changes, new_change_memory
from .dynamics_derivatives import tree_derivatives, window
from .force_change_kernels import open_changes


@dataclass(frozen=True, eq=False, repr=False)
class MotionDerivatives(Record):
    """Derivatives of the acceleration of a closed chain by q, v and τ, in all and in d independent coordinates.

    A motion of the chain is a change dq = Z dq_i with dv = Z dv_i + v_q dq_i; for these ``a_q`` dq + ``a_v`` dv is
    exact. For changes that open the loops the closures' equations hold nevertheless, redundant ones as far as they
    agree.

    Attributes
    ----------
    a_q, a_v, a_tau : ndarray
        Shape (nv, nv), of all accelerations with q, in its tangent space, at constant v and τ, with v, and with τ.
    independent : ndarray of int
        Shape (d,), the independent coordinates' indices in v.
    reduced_jacobian : ndarray
        Z, shape (nv, d): changes of all coordinates with the independent ones, along the closed loops.
    v_q : ndarray
        Shape (nv, d), of all velocities with q_i at constant v_i.
    independent_q, independent_v, independent_tau : ndarray
        Shapes (d, d), (d, d) and (d, nv), of the independent accelerations with q_i at constant v_i, with v_i, and with
        all efforts.

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain_with_masses()
    >>> by = chain.forward_dynamics_derivatives(chain.close(chain.neutral()))
    >>> by.a_q.shape, by.independent_q.shape, by.independent_tau.shape  # of 12 coordinates three are independent
    ((12, 12), (3, 3), (3, 12))
    """

    independent: NDArray[np.int64]
    reduced_jacobian: FloatArray
    v_q: FloatArray
    independent_q: FloatArray
    independent_v: FloatArray
    independent_tau: FloatArray
    _changes: FloatArray  # (3, nv, nv): of a with q, v and τ
    _given: tuple[ChainState, FloatArray, FloatArray, FloatArray, dict[str, FloatArray] | None]

    a_q, a_v, a_tau = (window("_changes", k) for k in range(3))

    @cached_property
    def motion(self) -> ClosedMotion:
        """The acceleration itself, with its forces."""
        state, q, v, tau, external = self._given
        return forward_dynamics(state, q, v, tau, external=external)


def forward_dynamics_derivatives(
    state: ChainState,
    q: ArrayLike,
    v: ArrayLike | None = None,
    tau: ArrayLike | Mapping[str, ArrayLike] | None = None,
    *,
    independent: Iterable[str] | None = None,
    external: Mapping[str, ArrayLike] | None = None,
) -> MotionDerivatives:
    """Derivatives of the acceleration that efforts make.

    Parameters
    ----------
    q, v, tau, external
        As for :meth:`ClosedChain.forward_dynamics`; the components of external wrenches in world axes are constant.
    independent : iterable of str, optional
        Joints whose coordinates are independent, as for :meth:`ClosedChain.split`, which chooses them otherwise.

    Returns
    -------
    MotionDerivatives

    Raises
    ------
    UndeterminedMotion
        If the given joints do not determine the others.
    UnsupportedDynamics
        If a joint with dry friction is at rest: its acceleration has no derivatives there.
    LoopNotClosed, MasslessMotion, SingularConfiguration, NearSingularConfiguration, InvalidInput, UnknownName
        As for :meth:`ClosedChain.forward_dynamics`.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> by = chain.forward_dynamics_derivatives([0.4])
    >>> by.a_q.round(4), by.a_tau.round(4)  # -m g r cos q over the inertia of 0.6 kg m², 1/s², and its inverse
    (array([[-15.0593]]), array([[1.6667]]))
    """
    q = state.sized("q", q, state.nq).copy()
    v = np.zeros(state.nv) if v is None else state.sized("v", v, state.nv).copy()
    efforts, work = efforts_of(state, tau), state.buffers
    given = NONE_GIVEN if independent is None else frozen(state.velocity_indices(independent))
    work.q[:], work.v[:] = q, v
    a = None if external else _certain_acceleration(state, q, v, efforts)
    # What is in doubt is solved or refused there.
    work.a[:] = forward_dynamics(state, q, v, efforts, external=external).a if a is None else a
    work.v[:] = v
    pushes = wrenches_on(state, external) if external is not None else {}
    left = tree_derivatives(state, work, pushes)[2] - efforts
    changes, Z, v_q, own, (by_q, by_v, by_tau), choice = acceleration_changes.run(
        *work.for_derivatives, work.jacobian, work.gap, left, given, state.tolerance
    )
    if independent is not None:
        refuse_choice(state, q, given, *choice)
    kept = {name: np.array(wrench) for name, wrench in pushes.items()} or None
    return MotionDerivatives.made_of(
        independent=frozen(own), reduced_jacobian=frozen(Z), v_q=frozen(v_q), independent_q=frozen(by_q),
        independent_v=frozen(by_v), independent_tau=frozen(by_tau), _changes=frozen(changes),
        _given=(state, q, v, efforts, kept),
    )  # fmt: skip


def _certain_acceleration(state: ChainState, q: FloatArray, v: FloatArray, efforts: FloatArray) -> FloatArray | None:
    """The acceleration of a chain without springs where it is certain that nothing has to be refused; else None."""
    work = state.buffers
    if not state.passive.is_idle or state.tolerance or not state.has_unit_turns(q):
        return None
    # One call of Pinocchio in place of the three of forward dynamics.
    pin.computeRNEADerivatives(state.model, work.data, q, v, work.still)
    certain, a = certain_motion.run(
        work.poses, work.J, work.dJ, work.for_derivatives[3], work.constants, work.gap, work.jacobian,
        work.jacobian_rate, work.trees[2], efforts - work.tau,
    )  # fmt: skip
    return a if certain else None


@kernel
def certain_motion(
    poses: Any, J: Any, dJ: Any, motion: Any, constants: Any, gap: Any, jacobian: Any, rate: Any, lower: Any,
    forces: Any,
) -> Any:  # fmt: skip
    """Whether the acceleration is certain, and it; parameters as for :func:`.equation_kernels.clear_motion`."""
    (height, nv), nq = rate.shape, len(motion) - 2 * len(forces)
    (worst, _, opening, _, regular, finite), clear, a, (_, missing, _, moves) = clear_motion(
        poses, J, dJ, motion[nq : nq + nv], motion[:nq], constants, gap, jacobian, rate, np.empty(height), lower,
        forces, (0.0, CLOSED, MASSLESS),
    )  # fmt: skip
    return clear and finite and regular and moves and worst <= CLOSED and opening <= STILL and missing <= STILL, a


@kernel
def acceleration_changes(
    poses: Any, J: Any, dJ: Any, motion: Any, trees: Any, constants: Any, rate: Any, jacobian: Any, gap: Any,
    left: Any, given: Any, tolerance: float,
) -> Any:  # fmt: skip
    """Changes of the acceleration with q, v and τ.

    Parameters
    ----------
    poses, J, dJ, motion, trees, constants, rate, given, tolerance
        As for :func:`.force_change_kernels.derivatives_of_motion`.
    jacobian, gap : ndarray
        Shapes (rows, nv) and (rows,), the closures' Jacobian and residual.
    left : ndarray
        Shape (nv,), generalised forces of the loops, Jᵀλ.

    Returns
    -------
    found : ndarray
        Shape (3, nv, nv), changes of a with q, v and τ.
    Z, v_q : ndarray
        Shape (nv, d), of :class:`MotionDerivatives`.
    own, choice
        As of :func:`exo_pin.chain.kinematics.kernels.dependent_kernels.reduced_motion`.
    inner : tuple of ndarray
        Changes of the independent accelerations with q_i, v_i and τ, shapes (d, d), (d, d) and (d, nv).
    """
    loops, scales, _, axes = unpacked_constants(constants[0], constants[1])
    (height, nv), nq = rate.shape, len(motion) - 2 * len(left)
    q, v, a = motion[:nq], motion[nq : nq + nv], motion[nq + nv :]
    lower = trees[2]
    row_scale, column, _ = scales
    known = tolerance
    for r in range(height if tolerance == 0.0 else 0):
        known = max(known, abs(gap[r] * row_scale[r]))
    own, Z, order, factors, choice = reduced_motion(jacobian, given, scales, len(poses), known)
    rank, d = choice[0], len(own)
    v_q = np.zeros((nv, d))
    # Jᵀ λ = left.
    multipliers = np.zeros(height)
    for i in range(rank):
        multipliers[i] = column[order[i]] * left[order[i]]
    solve_transposed(factors[0], factors[1], factors[2], rank, multipliers)
    for r in range(height):
        multipliers[r] *= row_scale[r]
    # Along each coordinate by itself, with the velocities that follow it; these are taken off again.
    moved, along = np.zeros((4, 3, nv, nv)), np.empty((nv, height, nv))
    for k in range(nv):
        moved[0, 0, k, k] = 1.0
    motion_changes(
        poses, J, v, a, q, rate, axes, loops, scales, order, rank, factors, moved, along, new_scratch(),
        new_change_memory(len(poses), nv, height),
    )  # fmt: skip
    open_changes(trees, along, multipliers, moved)
    following, found, change = moved[1, 0], moved[2], np.empty(nv)
    for part in (moved[2], moved[3]):
        _add_product(part[1], following, -1.0, part[0])
    response = _response(lower, Z)
    for n in range(2):
        for s in range(d):
            change[:] = 0.0
            for i in range(nv):
                for k in range(nv):
                    change[k] -= response[s, i] * moved[3, n, i, k]
            _add_outer(response[s], change, found[n])
    found[2] = 0.0
    for s in range(d):
        _add_outer(response[s], response[s], found[2])
    _add_product(following, Z, 1.0, v_q)
    inner_q, inner_v, inner_tau = np.zeros((d, d)), np.zeros((d, d)), np.empty((d, nv))
    for s in range(d):
        for k in range(nv):
            by_q, by_v = found[0, own[s], k], found[1, own[s], k]
            for t in range(d):
                inner_q[s, t] += by_q * Z[k, t] + by_v * v_q[k, t]
                inner_v[s, t] += by_v * Z[k, t]
            inner_tau[s, k] = found[2, own[s], k]
    return found, Z, v_q, own, (inner_q, inner_v, inner_tau), choice


@kernel
def _add_product(A: Any, B: Any, factor: float, out: Any) -> None:
    """Add a multiple of A B."""
    for j in range(len(B)):
        for i in range(len(A)):
            if A[i, j] != 0.0:
                for k in range(B.shape[1]):
                    out[i, k] += factor * A[i, j] * B[j, k]


@kernel
def _response(lower: Any, Z: Any) -> Any:
    """L⁻¹ Zᵀ with L Lᵀ = ZᵀMZ, shape (d, nv), from the lower half of M: forces f move the chain by its square on f."""
    nv, d = Z.shape
    MZ, L, out = np.zeros((nv, d)), np.zeros((d, d)), Z.T.copy()
    for i in range(nv):
        for j in range(nv):
            for s in range(d):
                MZ[i, s] += lower[max(i, j), min(i, j)] * Z[j, s]
    for i in range(nv):
        for s in range(d):
            for t in range(s + 1):
                L[s, t] += Z[i, s] * MZ[i, t]
    for s in range(d):
        for t in range(s + 1):
            for k in range(t):
                L[s, t] -= L[s, k] * L[t, k]
            L[s, t] = math.sqrt(L[s, s]) if s == t else L[s, t] / L[t, t]
        for i in range(nv):
            for k in range(s):
                out[s, i] -= L[s, k] * out[k, i]
            out[s, i] /= L[s, s]
    return out


@kernel
def _add_outer(one: Any, other: Any, out: Any) -> None:
    """Add one otherᵀ."""
    for i in range(len(one)):
        for k in range(len(other)):
            out[i, k] += one[i] * other[k]
