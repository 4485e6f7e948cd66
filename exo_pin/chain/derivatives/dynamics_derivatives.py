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

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.validation import FloatArray, frozen
from ..dynamics.equations.equations_of_motion import open_tree, wrenches_on
from ..dynamics.nonsmooth.joint_friction import friction_of, refuse_rest
from ..dynamics.solved_forces import refuse_motion
from ..kinematics.reduced_kinematics import refuse_choice
from ..structure.chain_state import ChainState
from ..structure.memory.chain_buffers import ChainBuffers
from .force_change_kernels import derivatives_of_motion
from .reaction_derivatives import tree_derivatives
from .results import Derivatives

_NONE = frozen(np.array([], dtype=np.int64))


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
