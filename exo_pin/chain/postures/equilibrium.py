"""Static equilibrium: the posture of least potential energy on the closed loops."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.records import Record
from ...core.validation import FloatArray
from ..dynamics.inverse_dynamics import inverse_dynamics
from ..dynamics.reactions import ClosedForces
from ..structure.chain_state import ChainState
from .constrained_minimum import STATIONARY, minimum
from .posture_problem import problem_of, start_of


@dataclass(frozen=True, eq=False)
class Equilibrium(Record):
    """Answer of :meth:`exo_pin.chain.ClosedChain.equilibrium`.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), closed and within the joint limits.
    energy : float
        Potential energy of weight and springs, J; that of weight is zero with the centre of mass at the world's origin.
    kkt : float
        Largest generalised force that neither loops, held joints nor stops balance, over the weight times the
        characteristic length plus the springs' forces.
    curvature : float
        Least stiffness against motions of the chain, over the largest one: above zero for a stable equilibrium, zero
        with idle freedoms, infinite if nothing can move.
    at_limits : tuple of str
        Joints that rest on their stops.
    idle : tuple of str
        Joints that move in motions which change no energy, such as a rod's turn about itself. The equilibrium leaves
        them where they are.

    Examples
    --------
    >>> block = '<joint name="z" type="slide" axis="0 0 1" stiffness="200"/><geom size="0.1" mass="2"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{block}</body></worldbody></mujoco>")
    >>> hung = chain.equilibrium()
    >>> hung.q.round(4), round(hung.energy, 4)  # m: m g/k below; J: -(m g)²/(2 k)
    (array([-0.0981]), -0.9624)
    """

    q: FloatArray
    energy: float
    kkt: float
    curvature: float
    at_limits: tuple[str, ...]
    idle: tuple[str, ...]
    _doubts: tuple[str, ...] = field(repr=False)
    _held: tuple[str, ...] = field(repr=False)
    _state: ChainState = field(repr=False)

    @cached_property
    def forces(self) -> ClosedForces:
        """Forces of the posture: efforts of the held joints, reactions of the stops as efforts of their joints."""
        return inverse_dynamics(self._state, self.q, actuated=tuple(dict.fromkeys((*self._held, *self.at_limits))))

    @cached_property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about the answer."""
        rubbing: tuple[str, ...] = ()
        if self._state.passive.rubs:
            rubbing = ("dry friction of the joints is left out: with it the chain may rest in other postures, too",)
        return (*self._doubts, *rubbing)

    def __str__(self) -> str:
        kind = "indifferent" if self.idle else "stable" if self.curvature > 0.0 else "unstable"
        found = f"{kind} equilibrium" if self.kkt <= STATIONARY else "no equilibrium found"
        lines = [f"{found}, potential energy {self.energy:.6g} J"]
        lines += [f"Caution: {text}" for text in self.cautions]
        lines.append(f"generalised forces balance to {self.kkt:.1e} of weight and springs")
        named = ("on their stops", self.at_limits), ("free to move without any force (idle)", self.idle)
        return "\n".join([*lines, *(f"{what}: {', '.join(names)}" for what, names in named if names)])


class _Energy:
    """Potential energy of weight and springs, as an objective."""

    def __init__(self, state: ChainState) -> None:
        self._state = state
        mass = sum(float(body.mass) for body in list(state.model.inertias)[1:])
        self._weight = mass * float(np.linalg.norm(state.gravity)) * state.topology.length

    def value(self, q: FloatArray) -> float:
        state = self._state
        weight = float(pin.computePotentialEnergy(state.model, state.buffers.data, q))
        return weight + (state.passive.energy(q) if state.passive.act else 0.0)

    def gradient(self, q: FloatArray) -> FloatArray:
        state = self._state
        pull = np.array(pin.computeGeneralizedGravity(state.model, state.buffers.data, q))
        return pull - state.passive.force(q, None) if state.passive.act else pull

    def scale(self, q: FloatArray) -> float:
        state = self._state
        return self._weight + float(np.abs(state.passive.force(q, None) * state.topology.column).max(initial=0.0))


def equilibrium(
    state: ChainState,
    near: ArrayLike | None = None,
    hold: Iterable[str] = (),
    *,
    respect_limits: bool = True,
    tolerance: float = 1e-12,
) -> Equilibrium:
    """The static posture under weight, springs and held joints: a minimum of the potential energy.

    Actuators hold the joints of ``hold`` and no others; to find where a robot hangs while its motors are locked, hold
    them. The search descends from ``near``, so that the equilibrium is the one into which a slow, damped motion ends.
    Motions that change no energy are left alone and named in :attr:`Equilibrium.idle`. Dry friction is left out.

    Parameters
    ----------
    near : array_like, optional
        Shape (nq,), where to start; its loops are closed first. By default :meth:`ClosedChain.reference_configuration`.
    hold : iterable of str
        Joints that must not move.
    respect_limits : bool
        Whether joint limits are stops.
    tolerance : float
        Largest residual of a closed loop, m and rad.

    Returns
    -------
    Equilibrium
        The posture, with its forces and its stability.

    Raises
    ------
    LoopNotClosed
        If the loops do not close at the start.
    BeyondLimits
        If they close there only beyond joint limits.
    UnknownName
        If there is no such joint.

    Examples
    --------
    >>> spring = '<joint axis="0 1 0" stiffness="2"/><inertial mass="1" pos="0 0 0.5" diaginertia="1 1 1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{spring}</body></worldbody></mujoco>")
    >>> q = chain.equilibrium([0.3]).q[0]  # rad; the spring is too weak for the rod above it
    >>> round(float(9.81 * 0.5 * np.sin(q) - 2.0 * q), 6)  # N m: m g r sin q = k q
    0.0
    """
    names = tuple(hold) if isinstance(hold, Iterable) and not isinstance(hold, str) else (hold,)
    problem = problem_of(state, _Energy(state), names, respect_limits, tolerance)
    found = minimum(problem, start_of(problem, near))
    return Equilibrium(
        found.q, found.value, found.kkt, found.curvature, found.at_limits, found.idle, found.doubts, names, state
    )
