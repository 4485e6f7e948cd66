"""Acceleration of a chain at one state, compiled where nothing is in doubt, and with friction and stops."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ....core.errors import SolverFailed
from ....core.validation import FloatArray
from ...structure.chain_state import CLOSED, ChainState
from ...structure.inertia import MASSLESS
from ..equations.equation_kernels import clear_motion
from ..equations.equations_of_motion import LoopMotion, moving_loops, open_tree
from .contact_forces import ContactForces, contact_forces, contacts_at, only_sliding
from .projected_motion import Applied, projected_motion

#: What :func:`~exo_pin.chain.dynamics.equations.equation_kernels.missed` returns.
Missed = tuple[float, float, float, bool]


def clear_acceleration(
    state: ChainState, q: FloatArray, v: FloatArray, applied: Applied
) -> tuple[LoopMotion, FloatArray | None, Missed | None]:
    """The loops of a moving chain, and its acceleration by projection, without friction and stops.

    Returns
    -------
    tuple
        What :func:`moving_loops` returns; the acceleration, and what
        :func:`~exo_pin.chain.dynamics.equations.equation_kernels.missed` returns for it, None where it is in doubt.
    """
    work, top, nv = state.buffers, state.topology, state.nv
    work.jacobian_rates(q, v)
    forces = applied.efforts - open_tree(state, q, v, work.still, applied.external)
    lower = np.reshape(pin.crba(state.model, work.data, q), (nv, nv)).T
    found, clear, a, error = clear_motion.run(
        work.poses, work.J, work.dJ, v, top.loops, work.q, top.scales, work.gap, work.jacobian, work.jacobian_rate,
        work.drift, lower, forces, (state.tolerance, CLOSED, MASSLESS),
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
    _, a, _ = clear_acceleration(state, q, v, applied)
    if a is None:
        moving_loops(state, q, v)
        a = projected_motion(state, q, v, applied).a
    if not np.isfinite(a).all():
        raise SolverFailed("the constrained dynamics", np.inf, "the acceleration is not finite")
    return a


def with_contacts(
    state: ChainState, q: FloatArray, v: FloatArray, applied: Applied, stops: bool
) -> tuple[FloatArray, ContactForces]:
    """Acceleration and forces with friction and stops; :func:`moving_loops` must have been called."""
    rubbing, contacts = contacts_at(state, q, v, stops)
    motion = projected_motion(state, q, v, applied.plus(rubbing.force))
    if not len(contacts.place):
        return only_sliding(motion.a, rubbing.force)
    found = contact_forces(state, motion, contacts, rubbing.force)
    return found.a, found
