"""Motion of a closed chain in time under given efforts, with closed loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, frozen
from ..kinematics.loops import closed_configuration, residual
from ..structure.chain_state import ChainState
from ..structure.motion_axes import limits_of
from .equations.equations_of_motion import moving_loops, refuse_opening
from .forward_dynamics import forward_dynamics
from .integration import Instant, Rates, energies_of
from .nonsmooth.contact_forces import stops_at
from .nonsmooth.event_integration import EventIntegration
from .nonsmooth.settling import MotionEvent, StopRules

Efforts = ArrayLike | Mapping[str, ArrayLike] | None


@dataclass(frozen=True, eq=False)
class Simulation(Record):
    """A motion in time.

    Attributes
    ----------
    times : ndarray
        Shape (count,), s.
    q, v : ndarray
        Shapes (count, nq) and (count, nv).
    energy : ndarray
        Shape (count,), kinetic, of the weight, and of the springs, J.
    kinetic_energy : ndarray
        Shape (count,), J.
    work : ndarray
        Shape (count,), work of efforts and external wrenches since the start, J.
    dissipated : ndarray
        Shape (count,), energy that dampers, dry friction and impacts have dissipated since the start, J; it never
        falls.
    opening : ndarray
        Shape (count,), largest residual of the loops, m and rad.
    steps : int
        Steps of the integrator.
    events : tuple of MotionEvent
        Joints that stick, slip, hit, reach or leave their stops, and crossings of singular configurations, in time.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> run = chain.simulate([np.pi / 2], [0.0], np.linspace(0.0, 0.6, 61))
    >>> round(float(run.kinetic_energy.max()), 2)  # J, at the lowest point: m g r = 9.81 J
    9.81
    """

    times: FloatArray
    q: FloatArray
    v: FloatArray
    energy: FloatArray
    kinetic_energy: FloatArray
    work: FloatArray
    dissipated: FloatArray
    opening: FloatArray
    steps: int
    events: tuple[MotionEvent, ...] = ()

    @property
    def energy_drift(self) -> float:
        """Largest change of the energy without that by work and dissipation, over the largest kinetic energy.

        It is meaningless for a chain that hardly moves.
        """
        largest = float(self.kinetic_energy.max())
        change = float(np.abs(self.energy - self.work + self.dissipated - self.energy[0]).max())
        return change / largest if largest > 0.0 else change


def simulate(
    state: ChainState,
    q: ArrayLike,
    v: ArrayLike,
    times: ArrayLike,
    tau: Efforts | Callable[[float, FloatArray, FloatArray], Efforts] = None,
    *,
    external: Mapping[str, ArrayLike] | Callable[[float, FloatArray, FloatArray], object] | None = None,
    stops: bool = False,
    restitution: float = 0.0,
    rtol: float = 1e-9,
    atol: float = 1e-11,
    progress: bool = False,
) -> Simulation:
    """Integrate the motion under given efforts, weight, springs, damping and dry friction.

    Joint limits stop the motion with ``stops=True`` only, and bodies pass through each other. With friction or stops
    the motion goes from event to event: joints stick, slip, hit, reach and leave their stops.

    SciPy's DOP853 on the configuration manifold: the coordinates of every step are relative to the configuration at
    its start, so that quaternions have length 1. A stiff motion, in which stability and not accuracy has bounded
    fifteen steps, goes on with implicit ones (Radau IIA of order nine, :mod:`exo_pin.chain.dynamics.implicit`), in
    which strong dampers, springs or controllers cost nothing. After every step the state is projected on the closed
    loops, so that their residual is at most 1e-12 for any length of time; through a singular configuration
    (:mod:`exo_pin.chain.dynamics.crossing`) it is that of the continued motion, below 1e-9.

    Parameters
    ----------
    q, v : array_like
        Shapes (nq,) and (nv,), the instant at the first time, with closed loops.
    times : array_like
        Shape (count,), ascending, s, at which the state is returned.
    tau : array_like, mapping or callable, optional
        Efforts as for :meth:`ClosedChain.forward_dynamics`, or a function of time, q and v that returns them.
    external : mapping or callable, optional
        As for :meth:`ClosedChain.forward_dynamics`, or a function of time, q and v that returns it.
    stops : bool
        Whether joint limits are rigid stops.
    restitution : float
        Newton's restitution at stops, from 0, no bounce, to 1, no loss. Impacts slower than 1e-5 characteristic
        lengths or rad a second, or within a microsecond of the joint's last one, do not bounce.
    rtol, atol : float
        Tolerances of a step, relative, and absolute in m, rad, m/s and rad/s.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    Simulation

    Raises
    ------
    LoopNotClosed
        If the residual of the loops exceeds 1e-8 at the start, or the loops cannot be closed after a step.
    MasslessMotion
        If some motion has no inertia.
    InvalidInput
        If v opens the loops at the start, the times do not ascend, or a joint is beyond its stop at the start.
    SimulationStopped
        If the steps become too small or the energy jumps; if a motion starts in a singular configuration or no smooth
        motion leads through one (:mod:`exo_pin.chain.dynamics.crossing`). If the loops move a joint into its stop, so
        that no motion is possible; if sticking and slipping alternate without end.

    Examples
    --------
    >>> chain = ep.load("prototype").chain_with_masses()
    >>> q, v = chain.close(chain.neutral()), np.zeros(chain.model.nv)
    >>> run = chain.simulate(q, v, np.linspace(0.0, 0.1, 6))
    >>> bool(np.ptp(run.energy) < 1e-7)  # J
    True
    """
    start, velocity = closed_configuration(state, q).copy(), state.tangent("v", v).copy()
    when = as_finite("times", times, (None,))
    if len(when) < 1 or (np.diff(when) <= 0.0).any():
        raise InvalidInput(f"expected ascending times, in s, each later than the one before, got {when}")
    for name, value in (("rtol", rtol), ("atol", atol)):
        if not 0.0 < as_finite(name, value, ()) < 1.0:
            raise InvalidInput(f"expected {name} between 0 and 1, got {value}")
    _, _, opening, speed, _, _ = moving_loops(state, start, velocity)
    refuse_opening(state, opening, speed)
    bounce = float(as_finite("restitution", restitution, ()))
    if not 0.0 <= bounce <= 1.0:
        raise InvalidInput(f"expected a restitution from 0 to 1, got {restitution}")
    rates, instant = Rates(state, tau, external), Instant(start, velocity, 0.0, 0.0)
    efforts, wrenches = rates.applied(float(when[0]), start, velocity)
    # Checks the efforts and the external wrenches.
    forward_dynamics(state, start, velocity, efforts, external=wrenches)
    rules = StopRules(limits_of(state.model) if stops else None, bounce)
    stops_at(state, rules.limits, start)
    states, steps, found = EventIntegration(rates, rules).run(instant, when, (rtol, atol), progress)
    energies = np.array([energies_of(state, instant) for instant in states])
    parts: list[FloatArray] = [frozen(np.array(part)) for part in zip(*states, strict=True)]
    gaps = np.array([np.abs(residual(state, instant.q)).max(initial=0.0) for instant in states])
    energy, kinetic = (frozen(part) for part in energies.T.copy())
    q_all, v_all, work, dissipated = parts
    return Simulation(when, q_all, v_all, energy, kinetic, work, dissipated, frozen(gaps), steps, tuple(found))
