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
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.records import Record
from ...core.validation import FloatArray, as_choice, frozen
from ..dynamics.equations.equations_of_motion import equations_of_motion
from ..dynamics.nonsmooth.joint_friction import friction_of, refuse_rest
from ..dynamics.reactions import ClosedForces
from ..dynamics.solved_forces import least_forces, solved
from ..dynamics.wrenches import own_frame, turned
from ..kinematics.reduced_kinematics import reduced
from ..structure.chain_state import ChainState
from .reaction_derivatives import closure_change, joint_change
from .state_changes import Change, OperatingPoint, change_of


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


@dataclass(frozen=True, eq=False)
class Derivatives(Record):
    """Derivatives of efforts and multipliers along the closed loops.

    Attributes
    ----------
    independent : ndarray of int
        Shape (d,), the independent coordinates' indices in v; columns are in this order.
    tau_q, tau_v, tau_a : ndarray
        Shape (nv, d), of the efforts; in coordinates without actuator, of the generalised force that is missing there,
        which no actuator makes: zero where the actuators drive the whole chain. With loops it is the one of least sum
        of squares, forces multiplied by the characteristic length. All results are those with missing forces supplied.
    multipliers_q, multipliers_v, multipliers_a : ndarray
        Shape (rows, d), of λ; where closures are redundant, of the λ of least norm in the metric "closures".
    v_q, a_q, a_v : ndarray
        Shape (nv, d), of all velocities and accelerations. With respect to q_i, those of q are the reduced
        Jacobian, and so are those of v with respect to v_i and of a with respect to a_i.
    forces : ClosedForces
        The forces themselves, in the metric "closures".

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain_with_masses()
    >>> q = chain.close(chain.neutral())
    >>> by = chain.inverse_dynamics_derivatives(q)
    >>> bool(np.allclose(by.v_q, 0.0)), by.tau_q.shape  # at rest; efforts by the three independent coordinates
    (True, (12, 3))
    """

    independent: NDArray[np.int64]
    tau_q: FloatArray
    tau_v: FloatArray
    tau_a: FloatArray
    multipliers_q: FloatArray
    multipliers_v: FloatArray
    multipliers_a: FloatArray
    v_q: FloatArray
    a_q: FloatArray
    a_v: FloatArray
    forces: ClosedForces
    _point: OperatingPoint = field(repr=False)
    _change: Change = field(repr=False)

    def joint_reaction(self, joint: str, in_frame: str = "world") -> ReactionDerivatives:
        """Derivatives of the wrench that a joint or closure transmits, about its own, moving origin.

        Parameters
        ----------
        joint : str
            Name of a joint of the tree or of a closure; the wrench is that on its child link, or on the body of
            frame a.
        in_frame : {"world", "local"}
            Axes of the wrench: the world's or its own, as in :meth:`ClosedForces.joint_reaction`.

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
        change = np.hstack([self.multipliers_q, self.multipliers_v, self.multipliers_a])
        state = self._point.state
        place, joints = state.part(joint).place, state.model.njoints - 1
        if place >= joints:
            local, turning = closure_change(self._point, place - joints, self._change, change)
        else:
            local, turning = joint_change(self._point, 1 + place, self._change, change)
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
    q = state.configuration(q).copy()
    v = np.zeros(state.model.nv) if v is None else state.tangent("v", v).copy()
    a = np.zeros(state.model.nv) if a is None else state.tangent("a", a).copy()
    drive = state.drive(actuated)
    if state.passive.rubs:
        equations = equations_of_motion(state, q, v, a, external)
        rubbing = friction_of(state, v)
        refuse_rest(
            state, rubbing, "its derivatives exist only in motion; without_friction() gives the chain without it"
        )
        equations = replace(equations, tau=equations.tau - rubbing.force)
        forces = solved(equations, drive, metric="closures", rubbing=rubbing)
    else:
        forces = least_forces(state, q, v, a, external, drive, "closures")
    chosen, dependent, G, _ = reduced(state, q, independent, filled=True)
    # Copies: reactions are computed later, when gravity and the caller's arrays may have changed.
    wrenches = {name: np.array(wrench, dtype=np.float64) for name, wrench in (external or {}).items()}
    gravity = np.array(state.model.gravity.vector)
    point = OperatingPoint(state, q, v, a, np.array(forces.multipliers), forces.equations, wrenches, gravity)
    change, tau, multipliers = change_of(point, dependent, G, drive.passive)
    d = len(chosen)
    tau, multipliers = frozen(tau), frozen(multipliers)
    first, second, third = slice(d), slice(d, 2 * d), slice(2 * d, 3 * d)
    return Derivatives.made_of(
        independent=chosen,
        tau_q=tau[:, first],
        tau_v=tau[:, second],
        tau_a=tau[:, third],
        multipliers_q=multipliers[:, first],
        multipliers_v=multipliers[:, second],
        multipliers_a=multipliers[:, third],
        v_q=change.v[:, first],
        a_q=change.a[:, first],
        a_v=change.a[:, second],
        forces=forces,
        _point=point,
        _change=change,
    )
