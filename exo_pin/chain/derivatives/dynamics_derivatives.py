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

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.records import Record
from ...core.validation import FloatArray, frozen
from ..dynamics.equations.equations_of_motion import open_tree, wrenches_on
from ..dynamics.equations.motion_kernels import NUMBERS
from ..dynamics.inverse_dynamics import refuse_motion, unbounded_forces
from ..dynamics.nonsmooth.joint_friction import friction_of, refuse_rest
from ..dynamics.reactions import ClosedForces
from ..kinematics.reduced_kinematics import refuse_choice
from ..structure.chain_state import ActuatedCoordinates, ChainState
from ..structure.memory.chain_buffers import ChainBuffers
from .force_change_kernels import COUNT, derivatives_of_motion, split_derivatives

#: No independent coordinates that were given.
NONE_GIVEN = frozen(np.array([], dtype=np.int64))


@dataclass(frozen=True, eq=False, repr=False)
class Derivatives(Record):
    """Derivatives of efforts and multipliers along the closed loops, with respect to d independent coordinates.

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain_with_masses()
    >>> q = chain.close(chain.neutral())
    >>> by = chain.inverse_dynamics_derivatives(q)
    >>> bool(np.allclose(by.v_q, 0.0)), by.tau_q.shape  # at rest; efforts by the three independent coordinates
    (True, (12, 3))
    """

    _given: tuple[ChainState, ActuatedCoordinates, FloatArray | None]
    _block: FloatArray
    _moved: FloatArray
    _change: FloatArray

    @cached_property
    def _parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What :func:`.force_change_kernels.split_derivatives` has."""
        state = self._given[0]
        parts: tuple[FloatArray, FloatArray, FloatArray]
        parts = split_derivatives.plain(self._block, (state.row_count, state.nv, state.model.njoints), state.nq)
        return parts

    @property
    def independent(self) -> NDArray[np.int64]:
        """Shape (d,), the independent coordinates' indices in v; columns are in this order."""
        return frozen(self._parts[2][4, : self._moved.shape[3]].astype(np.int64))

    @property
    def tau_q(self) -> FloatArray:
        """Shape (nv, d), derivative of the efforts with respect to the independent coordinates.

        In coordinates without actuator, of the generalised force that is missing there, which no actuator makes: zero
        where the actuators drive the whole chain. With loops it is the one of least sum of squares, forces multiplied
        by the characteristic length. All results are those with missing forces supplied.
        """
        return self._moved[3, 0]

    @property
    def tau_v(self) -> FloatArray:
        """As ``tau_q``, with respect to the independent velocities."""
        return self._moved[3, 1]

    @property
    def tau_a(self) -> FloatArray:
        """As ``tau_q``, with respect to the independent accelerations."""
        return self._moved[3, 2]

    @property
    def multipliers_q(self) -> FloatArray:
        """Shape (rows, d), derivative of λ with respect to the independent coordinates.

        Where closures are redundant, of the λ of least norm in the metric "closures".
        """
        return self._change[0]

    @property
    def multipliers_v(self) -> FloatArray:
        """As ``multipliers_q``, with respect to the independent velocities."""
        return self._change[1]

    @property
    def multipliers_a(self) -> FloatArray:
        """As ``multipliers_q``, with respect to the independent accelerations."""
        return self._change[2]

    @property
    def v_q(self) -> FloatArray:
        """Shape (nv, d), of all velocities with q_i at constant v_i; with v_i they change by the reduced Jacobian."""
        return self._moved[1, 0]

    @property
    def a_q(self) -> FloatArray:
        """Shape (nv, d), of all accelerations with q_i at constant v_i and a_i; with a_i by the reduced Jacobian."""
        return self._moved[2, 0]

    @property
    def a_v(self) -> FloatArray:
        """Shape (nv, d), of all accelerations with v_i at constant a_i."""
        return self._moved[2, 1]

    @property
    def numbers(self) -> list[float]:
        """The numbers of :data:`exo_pin.chain.dynamics.equations.motion_kernels.NUMBERS`."""
        numbers: list[float] = self._block[:NUMBERS].tolist()
        return numbers

    @property
    def choice(self) -> tuple[int, float, float]:
        """How many coordinates are dependent; the reduced Jacobian's largest error, and what is rounding there."""
        rank, error, cut = self._block[NUMBERS : COUNT - 1].tolist()
        return int(rank), error, cut

    @property
    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """q, v, a and the generalised forces of the open tree."""
        _, q, (v, a, tau, _, _) = self._parts
        return q, v, a, tau

    @property
    def terms(self) -> FloatArray:
        """The block of :func:`exo_pin.chain.dynamics.equations.motion_kernels.split_forces`."""
        return self._parts[0]

    @cached_property
    def forces(self) -> ClosedForces:
        """The forces themselves, in the metric "closures"."""
        state, drive, friction = self._given
        (flat, _, states), (q, _, _, tau) = self._parts, self.motion
        return unbounded_forces(state, (q, tau), drive, self.numbers, flat, states[3] != 0.0, "closures", friction)


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
    block, moved, change, certain = derivatives_of_motion.run(
        *work.for_derivatives, forces, local, tau, drive.passive, given, state.tolerance
    )
    known = state, drive, friction
    found = Derivatives.made_of(_given=known, _block=block, _moved=frozen(moved), _change=frozen(change))
    if not certain:
        refuse_motion(state, found.motion, drive, found.numbers, found.terms)
    if independent is not None:
        refuse_choice(state, work.q, given, *found.choice)
    return found


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
    _tree_by_motion(state, q, v, a, pushes)
    pin.computeJointJacobians(state.model, work.data, q)
    tau, friction = open_tree(state, q, v, a, pushes), None
    if state.passive.rubs:
        rubbing = friction_of(state, v)
        why = "its derivatives exist only in motion; without_friction() gives the chain without it"
        refuse_rest(state, rubbing, why)
        tau, friction = tau - rubbing.force, rubbing.force
    return work.forces, True, tau, friction


def _tree_by_motion(
    state: ChainState, q: FloatArray, v: FloatArray, a: FloatArray, external: Mapping[str, FloatArray]
) -> None:
    """Fill ``trees`` of the buffers, and the poses, Jacobians and ``tree``, too."""
    work = state.buffers
    data, (by_q, by_v, _) = work.data, work.trees
    pushed = _pushed(state, q, external) if external else None
    pin.computeRNEADerivatives(state.model, data, q, v, a)
    if state.passive.act:
        unit, none = np.eye(state.nv), np.zeros((state.nv, state.nv))
        by_q -= state.passive.change(q, unit, none)
        by_v -= state.passive.change(q, none, unit)
    if pushed is not None:
        by_q -= pushed


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
