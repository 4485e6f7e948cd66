"""Derivatives of inverse dynamics along the closed loops.

A closed chain has as many freedoms as independent coordinates, and a motion of it is q_i, v_i and a_i of these: all
other coordinates follow. The derivatives are total derivatives on the constraint manifold with respect to them, as an
optimiser over closed motions needs.

The actuators of an underactuated chain (an acrobot, a cart with a pole, a walking robot) make a motion, and not every
motion near it. So all rows of the equations of motion are differentiated: in a coordinate without actuator a row of
``tau`` is the derivative of the generalised force that is missing there, as :class:`UndrivenMotion` has it. The
actuators make the changes of the motion, combinations of columns, in which all these rows are zero.

The pieces are Pinocchio's derivatives of RNEA, and J̇, which is linear in the velocity: ∂(Jᵀλ)/∂q along a direction is
J̇(direction)ᵀ λ. The change of J̇ v with q is written out, as :mod:`.change_kernels` has it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.records import Record
from ...core.validation import FloatArray, frozen
from ..dynamics.equations.equations_of_motion import open_tree, wrenches_on
from ..dynamics.inverse_dynamics import refuse_motion, unbounded_forces
from ..dynamics.nonsmooth.joint_friction import friction_of, refuse_rest
from ..dynamics.reactions import ClosedForces
from ..kinematics.reduced_kinematics import NONE_GIVEN, refuse_choice
from ..structure.chain_state import ChainState
from ..structure.memory.chain_buffers import ChainBuffers
from .force_change_kernels import derivatives_of_motion


def window(name: str, *place: Any) -> Any:
    """A part of an array of an object as a property: to make all parts takes longer than a small factorisation."""
    return property(lambda self: getattr(self, name)[place])


@dataclass(frozen=True, eq=False, repr=False)
class Derivatives(Record):
    """Derivatives of efforts and multipliers along the closed loops, with respect to d independent coordinates.

    Attributes
    ----------
    independent : ndarray of int
        Shape (d,), the independent coordinates' indices in v; columns are in this order.
    tau_q, tau_v, tau_a : ndarray
        Shape (nv, d), derivatives of the efforts with respect to the independent coordinates, velocities and
        accelerations.

        In coordinates without actuator, of the generalised force that is missing there, which no actuator makes: zero
        where the actuators drive the whole chain. With loops it is the one of least sum of squares, forces multiplied
        by the characteristic length. All results are those with missing forces supplied.
    multipliers_q, multipliers_v, multipliers_a : ndarray
        Shape (rows, d), the same of λ. Where closures are redundant, of the λ of least norm in the metric "closures".
    v_q : ndarray
        Shape (nv, d), of all velocities with q_i at constant v_i; with v_i they change by the reduced Jacobian.
    a_q, a_v : ndarray
        Shape (nv, d), of all accelerations with q_i at constant v_i and a_i, and with v_i at constant a_i; with a_i by
        the reduced Jacobian.

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain_with_masses()
    >>> q = chain.close(chain.neutral())
    >>> by = chain.inverse_dynamics_derivatives(q)
    >>> bool(np.allclose(by.v_q, 0.0)), by.tau_q.shape  # at rest; efforts by the three independent coordinates
    (True, (12, 3))
    """

    independent: NDArray[np.int64]
    _moved: FloatArray  # (4, 3, nv, d): of q, v, a and efforts with q_i, v_i and a_i
    _change: FloatArray  # (3, rows, d)
    _given: tuple[Any, ...]  # of the forces

    tau_q, tau_v, tau_a = (window("_moved", 3, k) for k in range(3))
    multipliers_q, multipliers_v, multipliers_a = (window("_change", k) for k in range(3))
    v_q, a_q, a_v = window("_moved", 1, 0), window("_moved", 2, 0), window("_moved", 2, 1)

    @cached_property
    def forces(self) -> ClosedForces:
        """The forces themselves, in the metric "closures"."""
        state, at, drive, numbers, *rest = self._given
        return unbounded_forces(state, at, drive, numbers.tolist(), *rest)


def inverse_dynamics_derivatives(
    state: ChainState,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    *,
    independent: Iterable[str] | None = None,
    external: Mapping[str, ArrayLike] | None = None,
    actuated: Iterable[str] | None = None,
) -> Derivatives:
    """Derivatives of efforts and multipliers along the closed loops.

    Parameters
    ----------
    q, v, a, external, actuated
        As for :meth:`ClosedChain.inverse_dynamics`; the components of external wrenches in world axes are constant.
    independent : iterable of str, optional
        Joints whose coordinates are independent, as for :meth:`ClosedChain.split`, which chooses them otherwise.

    Returns
    -------
    Derivatives

    Raises
    ------
    UndeterminedMotion
        If the given joints do not determine the others.
    UnsupportedDynamics
        If a joint with dry friction is at rest: forces have no derivatives there.
    LoopNotClosed, InvalidInput, UnknownName, UndrivenMotion
        As for :meth:`ClosedChain.inverse_dynamics`.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> by = chain.inverse_dynamics_derivatives([0.4], actuated=["hinge"])
    >>> by.tau_q.round(4), by.tau_a.round(4)  # m g r cos q, N m/rad, and the inertia, kg m²
    (array([[9.0356]]), array([[0.6]]))
    """
    work, drive = state.buffers, state.drive(actuated)
    work.q[:] = state.sized("q", q, state.nq)
    work.v[:] = 0.0 if v is None else state.sized("v", v, state.nv)
    work.a[:] = 0.0 if a is None else state.sized("a", a, state.nv)
    if not state.has_unit_turns(work.q):
        state.configuration(q)  # which raises
    given = NONE_GIVEN if independent is None else frozen(state.velocity_indices(independent))
    pushes = wrenches_on(state, external) if external is not None else {}
    forces, local, tau, friction = tree_derivatives(state, work, pushes)
    flat, unique, numbers, moved, change, own, choice, certain = derivatives_of_motion.run(
        *work.for_derivatives, forces, local, tau, drive.passive, given, state.tolerance
    )
    at = work.q.copy(), tau.copy()
    if not certain:
        refuse_motion(state, (at[0], work.v.copy(), work.a.copy(), at[1]), drive, numbers.tolist(), flat)
    if independent is not None:
        refuse_choice(state, at[0], given, *choice)
    known = state, at, drive, numbers, flat, unique, "closures", friction
    return Derivatives.made_of(independent=frozen(own), _moved=frozen(moved), _change=frozen(change), _given=known)


def tree_derivatives(
    state: ChainState, work: ChainBuffers, pushes: Mapping[str, FloatArray]
) -> tuple[FloatArray, bool, FloatArray, FloatArray | None]:
    """Fill the derivatives of the open tree at the state in the buffers.

    Returns
    -------
    tuple
        What :func:`.force_change_kernels.derivatives_of_motion` takes: the joints' wrenches; whether in local axes; the
        generalised forces. Then the dry friction of the joints, or None.

    Raises
    ------
    UnsupportedDynamics
        If a joint with dry friction is at rest.
    """
    q, v, a = work.q, work.v, work.a
    if not pushes and state.passive.is_idle:
        pin.computeRNEADerivatives(state.model, work.data, q, v, a)
        return work.tree, False, work.tau, None
    pushed, (by_q, by_v, _) = _pushed(state, q, pushes), work.trees
    pin.computeRNEADerivatives(state.model, work.data, q, v, a)
    by_q -= pushed
    if state.passive.act:
        unit, none = np.eye(state.nv), np.zeros((state.nv, state.nv))
        by_q -= state.passive.change(q, unit, none)
        by_v -= state.passive.change(q, none, unit)
    pin.computeJointJacobians(state.model, work.data, q)
    tau, friction = open_tree(state, q, v, a, pushes), None
    if state.passive.rubs:
        rubbing = friction_of(state, v)
        why = "its derivatives exist only in motion; without_friction() gives the chain without it"
        refuse_rest(state, rubbing, why)
        tau, friction = tau - rubbing.force, rubbing.force
    return work.forces, True, tau, friction


def _pushed(state: ChainState, q: FloatArray, external: Mapping[str, FloatArray]) -> FloatArray:
    """Derivatives of the generalised forces of wrenches on frames with respect to q, shape (nv, nv)."""
    model, data, axes = state.model, state.buffers.data, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    found = np.zeros((state.nv, state.nv))
    for name, wrench in external.items():
        for k, direction in enumerate(np.eye(state.nv)):
            pin.computeJointJacobiansTimeVariation(model, data, q, direction)
            pin.updateFramePlacements(model, data)
            rate = pin.getFrameJacobianTimeVariation(model, data, state.frames[name], axes)
            found[:, k] += np.reshape(rate, (6, state.nv)).T @ wrench
    return found
