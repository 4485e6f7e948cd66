"""Acceleration of a chain at one state, by Pinocchio or by projection, with friction and stops."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ....core.errors import InvalidInput, SolverFailed
from ....core.validation import FloatArray
from ...structure.chain_state import ChainState
from ..equations_of_motion import moving_loops, open_tree
from .contact_forces import ContactForces, contact_forces, contacts_at, only_sliding
from .projected_motion import projected_motion

__all__ = ["acceleration", "smooth_acceleration", "with_contacts"]


def smooth_acceleration(
    state: ChainState,
    q: FloatArray,
    v: FloatArray,
    efforts: FloatArray,
    external: Mapping[str, ArrayLike] | None,
    stabilisation: float,
    method: str,
) -> FloatArray:
    """Acceleration without dry friction and stops, "proximal" or "projected".

    :func:`exo_pin.chain.dynamics.equations_of_motion.moving_loops` must have been called.

    Raises
    ------
    MasslessMotion
        If some motion has no inertia.
    """
    if method == "projected":
        return projected_motion(state, q, v, efforts, external, stabilisation).a
    return _proximal(state, q, v, efforts, external)


def acceleration(
    state: ChainState,
    q: FloatArray,
    v: FloatArray,
    efforts: FloatArray,
    external: Mapping[str, ArrayLike] | None,
    method: str,
    stabilisation: float,
) -> FloatArray:
    """:func:`smooth_acceleration` for the integrator, which has not computed the loops.

    Raises
    ------
    MasslessMotion
        If some motion has no inertia.
    SolverFailed
        If the answer is not finite.
    """
    if method == "projected":
        moving_loops(state, q, v)
    a = smooth_acceleration(state, q, v, efforts, external, stabilisation, method)
    if not math.isfinite(a.dot(a)):
        raise SolverFailed("the constrained dynamics", np.inf, "the acceleration is not finite")
    return a


def with_contacts(
    state: ChainState,
    q: FloatArray,
    v: FloatArray,
    efforts: FloatArray,
    external: Mapping[str, ArrayLike] | None,
    stabilisation: float,
    chosen: str,
    method: str,
    stops: bool,
) -> tuple[str, FloatArray, ContactForces]:
    """Method, acceleration and forces with friction and stops; :func:`moving_loops` must have been called."""
    rubbing, contacts = contacts_at(state, q, v, stops)
    applied = efforts + rubbing.force
    if len(contacts.place):
        if method == "proximal":
            raise InvalidInput(
                "method 'proximal' is not applicable with friction at rest or an active stop: use 'projected'"
            )
        motion = projected_motion(state, q, v, applied, external, stabilisation)
        found = contact_forces(state, motion, contacts, rubbing.force)
        return "projected", found.a, found
    return chosen, *only_sliding(
        smooth_acceleration(state, q, v, applied, external, stabilisation, chosen), rubbing.force
    )


def _proximal(
    state: ChainState,
    q: FloatArray,
    v: FloatArray,
    efforts: FloatArray,
    external: Mapping[str, ArrayLike] | None,
) -> FloatArray:
    """Pinocchio's constrained dynamics, which knows no stabilisation."""
    model, problem = state.model, state.proximal_problem
    if external:
        state.workspace.linearise(q)
        still = np.zeros(state.nv)
        efforts = efforts + open_tree(state, q, still, still, None) - open_tree(state, q, still, still, external)
    if state.passive.act:
        efforts = efforts + state.passive.force(q, v)
    return np.array(
        pin.constraintDynamics(model, problem.data, q, v, efforts, problem.models, problem.datas, problem.settings)
    )
