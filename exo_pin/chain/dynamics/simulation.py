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
from .equations_of_motion import moving_loops, refuse_opening
from .forward_dynamics import Method, forward_dynamics
from .integration import Instant, Rates, efforts_at, energies_of, integrated

__all__ = ["Simulation", "simulate"]

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
        Shape (count,), energy that dampers have dissipated since the start, J; it never falls.
    opening : ndarray
        Shape (count,), largest residual of the loops, m and rad.
    steps : int
        Steps of the integrator.
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

    @property
    def energy_drift(self) -> float:
        """Largest change of the energy without that by work and damping, over the largest kinetic energy.

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
    external: Mapping[str, ArrayLike] | None = None,
    method: Method = "auto",
    projection: bool = True,
    stabilisation: float = 0.0,
    rtol: float = 1e-9,
    atol: float = 1e-11,
    progress: bool = False,
) -> Simulation:
    """Integrate the motion under given efforts, weight, springs and damping.

    Joint limits do not stop the motion, and bodies pass through each other.

    SciPy's DOP853 on the configuration manifold: the coordinates of every step are relative to the configuration at
    its start, so that quaternions have length 1. After every step the state is projected on the closed loops, so that
    their residual is at most 1e-12 for any length of time.

    Parameters
    ----------
    q, v : array_like
        Shapes (nq,) and (nv,), the instant at the first time, with closed loops.
    times : array_like
        Shape (count,), ascending, s, at which the state is returned.
    tau : array_like, mapping or callable, optional
        Efforts as for :meth:`ClosedChain.forward_dynamics`, or a function of time, q and v that returns them.
    external, method
        As for :meth:`ClosedChain.forward_dynamics`.
    projection : bool
        Whether to project after every step. Without it the loops open slowly, faster for a larger ``rtol``.
    stabilisation : float
        Rate of Baumgarte's terms, 1/s, as for :meth:`ClosedChain.forward_dynamics`.
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
        If v opens the loops at the start, or the times do not ascend.
    SimulationStopped
        If the steps become too small, or the energy jumps: usually the motion has reached a singular
        configuration, from which more than one motion is possible. A step across one is not detected.
    """
    start, velocity = closed_configuration(state, q).copy(), state.tangent("v", v).copy()
    when = as_finite("times", times, (None,))
    if len(when) < 1 or (np.diff(when) <= 0.0).any():
        raise InvalidInput(f"expected ascending times, in s, each later than the one before, got {when}")
    for name, value in (("rtol", rtol), ("atol", atol)):
        if not 0.0 < as_finite(name, value, ()) < 1.0:
            raise InvalidInput(f"expected {name} between 0 and 1, got {value}")
    _, _, opening, speed, _ = moving_loops(state, start, velocity)
    refuse_opening(opening, speed)
    # Checks the efforts, the external wrenches and the method, and chooses one.
    efforts = efforts_at(state, tau, float(when[0]), start, velocity)
    first = forward_dynamics(
        state, start, velocity, efforts, external=external, method=method, stabilisation=stabilisation
    )
    rates = Rates(state, tau, external, first.method, stabilisation)
    states, steps = integrated(rates, Instant(start, velocity, 0.0, 0.0), when, projection, (rtol, atol), progress)
    return _simulation(state, when, states, steps)


def _simulation(state: ChainState, when: FloatArray, states: list[Instant], steps: int) -> Simulation:
    """The record of a motion."""
    energies = np.array([energies_of(state, instant) for instant in states])
    return Simulation(
        frozen(when),
        frozen(np.array([instant.q for instant in states])),
        frozen(np.array([instant.v for instant in states])),
        frozen(energies[:, 0].copy()),
        frozen(energies[:, 1].copy()),
        frozen(np.array([instant.work for instant in states])),
        frozen(np.array([instant.dissipated for instant in states])),
        frozen(np.array([float(np.abs(residual(state, instant.q)).max(initial=0.0)) for instant in states])),
        steps,
    )
