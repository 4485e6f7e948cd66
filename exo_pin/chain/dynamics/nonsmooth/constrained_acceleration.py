"""Acceleration of a chain at one state, by Pinocchio or by projection, with friction and stops."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ....core.errors import InvalidInput, SolverFailed
from ....core.validation import FloatArray
from ...structure.chain_state import CLOSED, ChainState
from ...structure.inertia import MASSLESS
from ..equations.equation_kernels import CLEAR, HEAVY, clear_motion
from ..equations.equations_of_motion import LoopMotion, moving_loops, open_tree
from .contact_forces import ContactForces, contact_forces, contacts_at, only_sliding
from .projected_motion import Applied, projected_motion

#: What :func:`~exo_pin.chain.dynamics.equations.equation_kernels.missed` returns.
Missed = tuple[float, float, float, bool]


def smooth_acceleration(state: ChainState, q: FloatArray, v: FloatArray, applied: Applied) -> FloatArray:
    """Acceleration without dry friction and stops.

    :func:`exo_pin.chain.dynamics.equations.equations_of_motion.moving_loops` must have been called.

    Raises
    ------
    MasslessMotion
        If some motion has no inertia.
    """
    if applied.method == "projected":
        return projected_motion(state, q, v, applied).a
    # Pinocchio's constrained dynamics, which knows no stabilisation.
    efforts, problem = applied.efforts, state.proximal_problem
    if applied.external:
        state.buffers.linearise(q)
        still = np.zeros(state.nv)
        load = open_tree(state, q, still, still, None) - open_tree(state, q, still, still, applied.external)
        efforts = efforts + load
    if state.passive.act:
        efforts = efforts + state.passive.force(q, v)
    found = pin.constraintDynamics(
        state.model, problem.data, q, v, efforts, problem.models, problem.datas, problem.settings
    )
    return np.asarray(found).copy()


def clear_acceleration(
    state: ChainState, q: FloatArray, v: FloatArray, applied: Applied
) -> tuple[LoopMotion, FloatArray | None, Missed, bool]:
    """The loops of a moving chain, and its acceleration by projection, without friction, stops and stabilisation.

    Returns
    -------
    tuple
        What :func:`moving_loops` returns; the acceleration, None where it is Pinocchio's or a singular value is in
        doubt; what :func:`~exo_pin.chain.dynamics.equations.equation_kernels.missed` returns for it; whether every
        motion of the open tree is known to have inertia.
    """
    work, top, nv = state.buffers, state.topology, state.nv
    work.jacobian_rates(q, v)
    forces = applied.efforts - open_tree(state, q, v, work.still, applied.external)
    lower = np.reshape(pin.crba(state.model, work.data, q), (nv, nv)).T
    found, status, a, error = clear_motion.run(
        work.poses, work.J, work.dJ, v, top.loops, work.q, top.scales, work.gap, work.jacobian, work.jacobian_rate,
        work.drift, lower, forces, (state.tolerance, CLOSED, MASSLESS), applied.method == "projected",
    )  # fmt: skip
    return found, a if status == CLEAR else None, error, status == HEAVY


def acceleration(state: ChainState, q: FloatArray, v: FloatArray, applied: Applied) -> FloatArray:
    """:func:`smooth_acceleration` for the integrator, which has not computed the loops.

    Raises
    ------
    MasslessMotion
        If some motion has no inertia.
    SolverFailed
        If the answer is not finite.
    """
    if applied.method == "projected":
        moving_loops(state, q, v)
    a = smooth_acceleration(state, q, v, applied)
    if not np.isfinite(a).all():
        raise SolverFailed("the constrained dynamics", np.inf, "the acceleration is not finite")
    return a


def with_contacts(
    state: ChainState, q: FloatArray, v: FloatArray, applied: Applied, requested: str, stops: bool
) -> tuple[str, FloatArray, ContactForces]:
    """Method, acceleration and forces with friction and stops; :func:`moving_loops` must have been called.

    ``requested`` is the method that the caller has chosen: "proximal" is not applicable with contacts.
    """
    rubbing, contacts = contacts_at(state, q, v, stops)
    applied = applied.plus(rubbing.force)
    if len(contacts.place):
        if requested == "proximal":
            raise InvalidInput(
                "method 'proximal' is not applicable with friction at rest or an active stop: use 'projected'"
            )
        motion = projected_motion(state, q, v, applied)
        found = contact_forces(state, motion, contacts, rubbing.force)
        return "projected", found.a, found
    return applied.method, *only_sliding(smooth_acceleration(state, q, v, applied), rubbing.force)
