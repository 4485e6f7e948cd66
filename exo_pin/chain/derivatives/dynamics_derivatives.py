"""Derivatives of inverse dynamics and of reactions along the closed loops.

A closed chain has as many freedoms as independent coordinates, and a motion of it is q_i, v_i and a_i of these: all
other coordinates follow. The derivatives are total derivatives on the constraint manifold with respect to them, as an
optimiser over closed motions needs.

The actuators of an underactuated chain (an acrobot, a cart with a pole, a walking robot) make a motion, and not every
motion near it. So all rows of the equations of motion are differentiated: in a coordinate without actuator a row of
``tau`` is the derivative of the generalised force that is missing there, as :class:`UndrivenMotion` has it. The
actuators make the changes of the motion, combinations of columns, in which all these rows are zero.

The pieces are Pinocchio's derivatives of RNEA, and J̇, which is linear in the velocity: ∂(Jᵀλ)/∂q along a direction is
J̇(direction)ᵀ λ. The change of J̇ v with q is written out, as :mod:`.change_kernels` has it. The wrench that a joint
transmits is the generalised force of a free flight in its place, so its derivatives are those of RNEA on a tree with
that joint replaced by a free flight.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.records import Record
from ...core.validation import FloatArray, as_choice, frozen
from ..dynamics.equations.equations_of_motion import open_tree, wrenches_on
from ..dynamics.equations.motion_kernels import NUMBERS
from ..dynamics.inverse_dynamics import refuse_motion, unbounded_forces
from ..dynamics.nonsmooth.joint_friction import friction_of, refuse_rest
from ..dynamics.reactions import ClosedForces
from ..dynamics.wrenches import own_frame, turned
from ..kinematics.reduced_kinematics import refuse_choice
from ..structure.chain_state import ActuatedCoordinates, ChainState
from ..structure.memory.chain_buffers import ChainBuffers
from .force_change_kernels import COUNT, derivatives_of_motion, split_derivatives
from .reaction_derivatives import Change, OperatingPoint, closure_change, joint_change, tree_derivatives

_NONE = frozen(np.array([], dtype=np.int64))


@dataclass(frozen=True, eq=False)
class ReactionDerivatives(Record):
    """Derivatives of a joint's or closure's reaction.

    Attributes
    ----------
    q, v, a : ndarray
        Shape (6, d), of the wrench (force and moment, N and N m, in the axes ``in_frame``) with respect to the
        independent coordinates (m, rad), velocities (m/s, rad/s) and accelerations (m/s², rad/s²).
    unique : ndarray of bool
        Shape (6,), which components are the same in every solution; the others are those of the least multipliers.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> by = chain.inverse_dynamics_derivatives([0.0], actuated=["hinge"]).joint_reaction("hinge")
    >>> by.a[0].round(3), bool(by.unique.all())  # N s²/rad: the hinge pushes the hanging rod by -m r a
    (array([-1.]), True)
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray
    unique: NDArray[np.bool_]


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

    _given: tuple[ChainState, ActuatedCoordinates, Mapping[str, FloatArray], FloatArray, FloatArray | None]
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
        state, drive, _, _, friction = self._given
        (flat, _, states), (q, _, _, tau) = self._parts, self.motion
        return unbounded_forces(state, (q, tau), drive, self.numbers, flat, states[3] != 0.0, "closures", friction)

    @cached_property
    def _point(self) -> OperatingPoint:
        (q, v, a, _), forces, (state, _, external, gravity, _) = self.motion, self.forces, self._given
        return OperatingPoint(state, q, v, a, np.array(forces.multipliers), forces.equations, external, gravity)

    def joint_reaction(self, joint: str, in_frame: str = "world") -> ReactionDerivatives:
        """Derivatives of the wrench that a joint or closure transmits, about its own, moving origin.

        Parameters
        ----------
        joint : str
            Name of a joint of the tree or of a closure; the wrench is that on its child link, or on the body of
            frame a.
        in_frame : {"world", "local"}
            Axes of the wrench: the world's or its own, as in :meth:`ClosedForces.joint_reaction`.

        Returns
        -------
        ReactionDerivatives

        Raises
        ------
        UnknownName
            If there is no such joint, closure or frame.
        InvalidInput
            If the joint's axes move in its child link, as those of Pinocchio's composite joints do.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> by = chain.inverse_dynamics_derivatives([0.0], [3.0], actuated=["hinge"]).joint_reaction("hinge")
        >>> by.v[2].round(3)  # N s/rad: of the centripetal force m ω² r, 2 m ω r
        array([6.])
        """
        as_choice("frame", in_frame, ("world", "local"))
        here = self.forces.joint_reaction(joint, in_frame=in_frame, intervals=False)
        changes = [np.concatenate(list(part), axis=1) for part in (*self._moved[:3], self._change)]
        change, multipliers, state = Change(*changes[:3]), changes[3], self._given[0]
        place, joints = state.part(joint).place, state.model.njoints - 1
        if place >= joints:
            local, turning = closure_change(self._point, place - joints, change, multipliers)
        else:
            local, turning = joint_change(self._point, 1 + place, change, multipliers)
        if in_frame == "world":
            local = turned(local, own_frame(self._point.equations, place)[1].T)
            local[:3] += np.cross(turning, here.force[:, None], axis=0)
            local[3:] += np.cross(turning, here.moment[:, None], axis=0)
        d = len(self.independent)
        by_q, by_v, by_a = (frozen(local[:, k * d : (k + 1) * d].copy()) for k in range(3))
        return ReactionDerivatives(by_q, by_v, by_a, here.unique)


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
    """Derivatives of efforts, multipliers and reactions along the closed loops.

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
    given = _NONE if independent is None else frozen(state.velocity_indices(independent))
    # Copies: reactions are computed later, when gravity and the caller's arrays may have changed.
    pushes, gravity = wrenches_on(state, external) if external is not None else {}, state.gravity_twist.copy()
    forces, local, tau, friction = _tree(state, work, pushes)
    block, moved, change, certain = derivatives_of_motion.run(
        *work.for_derivatives, forces, local, tau, drive.passive, given, state.tolerance
    )
    known = state, drive, pushes, gravity, friction
    found = Derivatives.made_of(_given=known, _block=block, _moved=frozen(moved), _change=frozen(change))
    if not certain:
        refuse_motion(state, found.motion, drive, found.numbers, found.terms)
    if independent is not None:
        refuse_choice(state, work.q, given, *found.choice)
    return found


def _tree(
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
    if not (pushes or state.axes.differs) and state.passive.is_idle:
        state.axes.rnea_derivatives(work.rate_data, q, v, a)
        return work.tree, False, work.tau, None
    tree_derivatives(state, q, v, a, pushes)
    pin.computeJointJacobians(state.model, work.data, q)
    tau, friction = open_tree(state, q, v, a, pushes), None
    if state.passive.rubs:
        rubbing = friction_of(state, v)
        why = "its derivatives exist only in motion; without_friction() gives the chain without it"
        refuse_rest(state, rubbing, why)
        tau, friction = tau - rubbing.force, rubbing.force
    return work.forces, True, tau, friction
