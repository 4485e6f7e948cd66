"""Forward dynamics of a closed chain: the acceleration that efforts make, in the null space of the loops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, LoopNotClosed, SolverFailed
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_mapping, as_real, frozen
from ..structure.chain_state import CLOSED, ChainState
from .equations.equation_kernels import missed
from .equations.equations_of_motion import (
    STILL,
    moving_loops,
    refuse_missing,
    refuse_near_singular,
    refuse_opening,
)
from .inverse_dynamics import least_forces
from .nonsmooth.contact_forces import ContactForces, with_contacts
from .nonsmooth.projected_motion import Applied, clear_acceleration, projected_motion
from .reactions import ClosedForces


@dataclass(frozen=True, eq=False)
class ClosedMotion(Record):
    """Acceleration of a closed chain under given efforts at one state.

    Attributes
    ----------
    a : ndarray
        Shape (nv,), the acceleration, m/s² and rad/s².
    tau : ndarray
        Shape (nv,), the efforts that made it, N and N m.
    residual : float
        Largest error of the acceleration in the closures' rows, m/s² and rad/s².

    Examples
    --------
    >>> block = '<joint name="z" type="slide" axis="0 0 1"/><inertial mass="2" pos="0 0 0" diaginertia="1 1 1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{block}</body></worldbody></mujoco>")
    >>> chain.forward_dynamics([0.0], tau={"z": [10.0]}).a  # m/s², 10 N less the weight, on 2 kg
    array([-4.81])
    """

    a: FloatArray
    tau: FloatArray
    residual: float
    _motion: tuple[ChainState, FloatArray, FloatArray, dict[str, FloatArray] | None, bytes] = field(repr=False)
    _contacts: ContactForces | None = field(repr=False, default=None)

    @property
    def friction(self) -> FloatArray:
        """Dry friction of the joints, shape (nv,), N and N m."""
        return np.zeros(len(self.a)) if self._contacts is None else self._contacts.friction

    @property
    def stop_reactions(self) -> FloatArray:
        """Reactions of the joint limits as stops, shape (nv,), N and N m, above zero at lower limits."""
        return np.zeros(len(self.a)) if self._contacts is None else self._contacts.stops

    @property
    def contact_is_unique(self) -> NDArray[np.bool_]:
        """Shape (nv,): where friction and the stop's reaction are the same in every solution; a is always."""
        return np.ones(len(self.a), dtype=np.bool_) if self._contacts is None else self._contacts.unique

    @property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about the acceleration and its forces, with their size; computed when they are asked for."""
        return self.forces.cautions

    @cached_property
    def forces(self) -> ClosedForces:
        """Multipliers and joint reactions of the motion, with their certificate.

        Where closures are redundant the multipliers are those of least norm in the metric "reactions" of
        :meth:`exo_pin.ClosedChain.inverse_dynamics`.
        """
        state, q, v, external, gravity = self._motion
        if state.gravity.tobytes() != gravity:
            model = state.model.copy()
            model.gravity.linear = np.frombuffer(gravity)
            state = ChainState(model, state.description)
        contacts = self._contacts
        all_forces = self.tau if contacts is None else self.tau + contacts.friction + contacts.stops
        # Nearness to a singular configuration was checked with the acceleration.
        found = least_forces(state, (q, v, self.a), external, state.drive(()), "reactions", all_forces, checked=False)
        friction = None if contacts is None else contacts.friction
        return ClosedForces.made_of(**vars(found) | {"tau": self.tau, "_friction": friction})


def forward_dynamics(
    state: ChainState,
    q: ArrayLike,
    v: ArrayLike | None = None,
    tau: ArrayLike | Mapping[str, ArrayLike] | None = None,
    *,
    external: Mapping[str, ArrayLike] | None = None,
    stops: bool = False,
) -> ClosedMotion:
    """Acceleration that efforts make.

    M a + h - passive - external = τ + f + Jᵀλ with J a + J̇ v = 0, where passive are the forces of springs and
    damping, and f dry friction and reactions of stops, as
    :mod:`exo_pin.chain.dynamics.nonsmooth` has them: the acceleration is unique, f may not be. A coordinate is at rest
    below 1e-9 characteristic lengths or rad a second, and at its stop within 1e-9 of it.

    The equations are solved in the null space of the closures, a = a_0 + Z z with J Z = 0: of every closure type, with
    redundant closures, and with links without mass if every motion of the chain has inertia.

    Parameters
    ----------
    q, v : array_like
        Shapes (nq,) and (nv,), a state with closed loops; v is zero if left out.
    tau : array_like or mapping, optional
        Efforts, shape (nv,), or by joint; zero where left out.
    external : mapping, optional
        As for :meth:`exo_pin.ClosedChain.inverse_dynamics`.
    stops : bool
        Whether joint limits are rigid stops.

    Returns
    -------
    ClosedMotion

    Raises
    ------
    LoopNotClosed
        If the residual of the loops exceeds 1e-8.
    MasslessMotion
        If some motion has no inertia.
    SingularConfiguration
        If every acceleration opens the loops.
    MotionBlocked
        If every acceleration moves a joint into its stop, whatever forces act.
    NearSingularConfiguration
        If q is so near a singular configuration that the acceleration depends on rounding.
    InvalidInput
        If v opens the loops; if a joint is beyond its stop or moves into it.
    UnknownName
        If a joint or frame is not known.
    SolverFailed
        If friction and stops meet their optimality conditions to no better than 1e-9.

    Examples
    --------
    >>> chain = ep.load("four-cables").chain_with_masses()
    >>> q = chain.close(chain.neutral())
    >>> motion = chain.forward_dynamics(q)  # nobody pulls: the arm swings under its weight
    >>> bool(np.abs(chain.constraint_jacobian(q) @ motion.a).max() < 1e-9)  # and the loops stay closed
    True
    """
    q = state.sized("q", q, state.nq).copy()
    v = np.zeros(state.nv) if v is None else state.sized("v", v, state.nv).copy()
    rough = stops or state.passive.rubs
    # Whether efforts are finite is seen by the acceleration, too.
    efforts = (
        efforts_of(state, tau) if rough or type(tau) is not np.ndarray else state.sized("tau", tau, state.nv).copy()
    )
    a, error, forces = None, None, None
    if rough:
        found = moving_loops(state, q, v)
    else:
        found, a, error = clear_acceleration(state, q, v, efforts, external)
    worst, gap, opening, speed, regular, finite = found
    if not finite or state.nq != state.nv:
        state.configuration(q)
        state.tangent("v", v)
    # What is certain without a call needs none.
    if not worst <= CLOSED and not state.is_closed(worst, gap):
        raise LoopNotClosed(q, worst, 0)
    if not opening <= STILL:
        refuse_opening(state, opening, speed)
    if rough:
        a, forces = with_contacts(state, q, v, Applied(efforts, external), stops)
    elif a is None:
        a = projected_motion(state, q, v, Applied(efforts, external)).a
    if error is None:
        work, top = state.buffers, state.topology
        error = missed.run(work.jacobian, work.drift, a, top.row_scale, top.column)
    largest, missing, size, finite = error
    if not finite:
        state.vector("tau", efforts, state.nv)
        raise SolverFailed("the constrained dynamics", np.inf, "the acceleration is not finite")
    if not missing <= STILL:
        refuse_missing(state, q, v, missing, size + speed * speed)
    if not regular or state.tolerance:
        refuse_near_singular(state, q, state.buffers.jacobian, gap)
    # Copies: gravity and the caller's arrays may have changed when forces are computed.
    given = None
    if external is not None:
        wrenches = as_mapping("external", external, "frames to wrenches")
        given = {name: np.array(wrench) for name, wrench in wrenches.items()}
    return ClosedMotion.made_of(
        a=frozen(a),
        tau=frozen(efforts),
        residual=largest,
        _motion=(state, q, v, given, state.gravity.tobytes()),
        _contacts=forces,
    )


def efforts_of(state: ChainState, tau: ArrayLike | Mapping[str, ArrayLike] | None) -> FloatArray:
    """Efforts as an array of shape (nv,), of any size: those of a controller may be large where a trial step leads."""
    if tau is None:
        return np.zeros(state.nv)
    if type(tau) is np.ndarray or not isinstance(tau, Mapping):
        given = state.sized("tau", as_real("tau", tau), state.nv)
        return given if np.isfinite(given).all() else as_finite("tau", tau, (state.nv,))
    efforts = np.zeros(state.model.nv)
    for joint, value in tau.items():
        own = state.velocity_slice(joint)
        given = as_real(f"tau[{joint!r}]", value)
        if given.shape not in ((), (own.stop - own.start,)) or not np.isfinite(given).all():
            raise InvalidInput(f"expected tau[{joint!r}] as {own.stop - own.start} finite numbers, got {value!r}")
        efforts[own] = given
    return efforts
