"""Motion of a closed chain in time under given efforts, kept on its loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import scipy
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, SimulationStopped
from ...core.progress import track
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, frozen
from ..kinematics.reduced_kinematics import Kinematics
from .equations_of_motion import refuse_opening
from .forward_dynamics import ForwardDynamics, Method, acceleration, efforts_of, inertia_matrix

__all__ = ["Simulation", "Simulations"]

Efforts = ArrayLike | Mapping[str, ArrayLike] | None
#: A step may lose or make so much energy, as a share of the kinetic one; more only where a motion passes a singularity.
_JUMP = 1e-4
#: What a step's tolerances and rounding explain of that, with so much to spare, is no jump: a chain at rest has no
#: kinetic energy to compare with.
_SPARE = 10.0
#: More than so many steps in a row below this, s, mean that the equations cannot be integrated any further. A jump of
#: the efforts takes fewer, six at most where it was tried: behind it steps may grow tenfold each.
_LEAST_STEP, _SHORT_STEPS = 1e-9, 8


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
        Shape (count,), what efforts and external wrenches have put in since the start, J.
    dissipated : ndarray
        Shape (count,), what dampers have taken out since the start, J; it never falls.
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
        """Largest change of the energy that neither work nor damping explains, over the largest kinetic energy.

        Meaningless for a chain that hardly moves.
        """
        largest = float(self.kinetic_energy.max())
        change = float(np.abs(self.energy - self.work + self.dissipated - self.energy[0]).max())
        return change / largest if largest > 0.0 else change


class Simulations(Kinematics, ForwardDynamics):
    """Motion in time of a closed chain."""

    def simulate(
        self,
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

        SciPy's DOP853 on the configuration manifold: every step has coordinates of its own around the configuration
        that it starts from, so that quaternions stay of length 1. After every step the state is projected
        on the closed loops, which keeps them closed to 1e-12 for any length of time.

        Parameters
        ----------
        q, v : array_like
            Shapes (nq,) and (nv,), the state at the first time, with closed loops.
        times : array_like
            Shape (count,), ascending, s: when the state is wanted.
        tau : array_like, mapping or callable, optional
            Efforts as for :meth:`forward_dynamics`, or a function of time, q and v that returns them.
        external, method
            As for :meth:`forward_dynamics`.
        projection : bool
            Whether to project after every step. Without, the loops drift open, as fast as ``rtol`` lets them.
        stabilisation : float
            Rate of Baumgarte's terms, 1/s, as for :meth:`forward_dynamics`.
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
            If the loops stand open at the start, or cannot be closed after a step.
        MasslessMotion
            If some motion moves no mass.
        InvalidInput
            If v opens the loops at the start, or the times do not ascend.
        SimulationStopped
            If the steps become too small, or the energy jumps: as a rule the motion has run into a singular
            configuration, where more than one motion goes on. A step over one is not noticed.
        """
        start, velocity = self._closed(q).copy(), self._tangent("v", v).copy()
        when = as_finite("times", times, (None,))
        if len(when) < 1 or (np.diff(when) <= 0.0).any():
            raise InvalidInput("expected ascending times")
        for name, value in (("rtol", rtol), ("atol", atol)):
            if not 0.0 < as_finite(name, value, ()) < 1.0:
                raise InvalidInput(f"expected {name} between 0 and 1, got {value}")
        self._workspace.linearise(start)
        refuse_opening(self, velocity)
        # Once through the front door: it says what does not fit, and which method does.
        first = self.forward_dynamics(
            start, velocity, _efforts(self, tau, float(when[0]), start, velocity),
            external=external, method=method, stabilisation=stabilisation,
        )  # fmt: skip
        rates = _Rates(self, tau, external, first.method, stabilisation)
        states, steps = _integrate(rates, _State(start, velocity, 0.0, 0.0), when, projection, (rtol, atol), progress)
        return _told(self, when, states, steps)


class _State(NamedTuple):
    """Configuration, velocity, and the work done and energy dissipated so far."""

    q: FloatArray
    v: FloatArray
    work: float
    dissipated: float


@dataclass
class _Rates:
    """The right side of the equations, in coordinates around ``base``: y = (ξ, v, work, dissipated), q = base ⊕ ξ."""

    chain: Simulations
    tau: object
    external: Mapping[str, ArrayLike] | None
    method: str
    stabilisation: float
    base: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __call__(self, t: float, y: FloatArray) -> FloatArray:
        chain, model = self.chain, self.chain.model
        shift, v = y[: model.nv], y[model.nv : -2]
        q = pin.integrate(model, self.base, shift)
        efforts = _efforts(chain, self.tau, t, q, v)
        a = acceleration(chain, q, v, efforts, self.external, self.method, self.stabilisation)
        # d/dt (base ⊕ ξ) is v where ξ' is v seen through the right Jacobian of the step.
        rate = v if model.nq == model.nv else np.asarray(np.linalg.solve(_right_jacobian(model, self.base, shift), v))
        return np.concatenate([rate, a, [efforts @ v + self._power(q, v), chain._passive.loss(v)]])

    def _power(self, q: FloatArray, v: FloatArray) -> float:
        """Of the external wrenches, W."""
        return sum(
            float(np.asarray(wrench) @ (self.chain._tree_frame_jacobian(q, frame) @ v))
            for frame, wrench in (self.external or {}).items()
        )


def _right_jacobian(model: pin.Model, q: FloatArray, shift: FloatArray) -> FloatArray:
    """How q ⊕ ξ changes with ξ, shape (nv, nv)."""
    return np.array(np.reshape(pin.dIntegrate(model, q, shift)[1], (model.nv, model.nv)))


def _efforts(chain: Simulations, tau: object, t: float, q: FloatArray, v: FloatArray) -> FloatArray:
    return efforts_of(chain, tau(t, q.copy(), v.copy()) if callable(tau) else tau)  # type: ignore[arg-type]


def _integrate(
    rates: _Rates,
    state: _State,
    when: FloatArray,
    projection: bool,
    tolerances: tuple[float, float],
    progress: bool,
) -> tuple[list[_State], int]:
    """States at the wanted times, and the number of steps."""
    states, steps, step, short = [state], 0, None, 0
    time, end = float(when[0]), float(when[-1])
    for target in track(when[1:].tolist(), "simulating", progress, len(when) - 1):
        while time < target and len(states) < len(when):
            rates.base = state.q
            y = np.concatenate([np.zeros(len(state.v)), state.v, [state.work, state.dissipated]])
            solver = scipy.integrate.DOP853(
                rates, time, y, end, first_step=step, rtol=tolerances[0], atol=tolerances[1]
            )
            message = solver.step()
            failed = solver.status == "failed"
            short = short + 1 if not failed and solver.step_size < _LEAST_STEP else 0
            if failed or short > _SHORT_STEPS:
                reason = message or f"steps would have to be below {_LEAST_STEP:g} s"
                raise SimulationStopped(time, state.q.copy(), state.v.copy(), reason)
            inside = solver.dense_output()
            while len(states) < len(when) and when[len(states)] <= solver.t:
                states.append(_state(rates, inside(float(when[len(states)])), projection))
            before, state = state, _state(rates, solver.y, projection)
            if not rates.stabilisation:
                _refuse_jump(rates.chain, before, state, time, solver.y[: len(state.v)], tolerances)
            time, steps = float(solver.t), steps + 1
            step = min(solver.h_abs, end - time) or None
    return states, steps


def _state(rates: _Rates, y: FloatArray, projection: bool) -> _State:
    chain, nv = rates.chain, rates.chain.model.nv
    q, v = pin.integrate(chain.model, rates.base, y[:nv]), y[nv:-2].copy()
    if projection and chain.row_count:
        q = chain.close(q, restarts=0)
        v = chain.project_velocity(q, v)
    return _State(q, v, float(y[-2]), float(y[-1]))


def _energies(chain: Simulations, state: _State) -> tuple[float, float]:
    """Total and kinetic energy, J."""
    data = chain._workspace.data
    height = float(pin.computePotentialEnergy(chain.model, data, state.q))
    kinetic = _kinetic_energy(chain, state.q, state.v)
    return height + chain._passive.energy(state.q) + kinetic, kinetic


def _kinetic_energy(chain: Simulations, q: FloatArray, v: FloatArray) -> float:
    """J, rotors included: Pinocchio's own leaves them out for joints about an axis that is none of x, y, z."""
    return float(0.5 * v @ inertia_matrix(chain, q) @ v)


def _refuse_jump(
    chain: Simulations,
    before: _State,
    after: _State,
    time: float,
    shift: FloatArray,
    tolerances: tuple[float, float],
) -> None:
    """Raise if a step changed the energy by more than its work and its tolerances explain."""
    (old, kinetic), (new, moving) = _energies(chain, before), _energies(chain, after)
    jump = abs(new - old - (after.work - before.work) + (after.dissipated - before.dissipated))
    explained = _SPARE * _explained(chain, after, (new, moving), shift, tolerances)
    if jump > _JUMP * max(kinetic, moving) + explained:
        raise SimulationStopped(
            time, before.q.copy(), before.v.copy(), f"the next step changes the energy by {jump:.3g} J"
        )


def _explained(
    chain: Simulations,
    state: _State,
    energies: tuple[float, float],
    shift: FloatArray,
    tolerances: tuple[float, float],
) -> float:
    """Error of the energy that the tolerances of a step and rounding allow, J."""
    (rtol, atol), (total, kinetic) = tolerances, energies
    model, data = chain.model, chain._workspace.data
    # A closed loop may still stand open by 1e-12.
    pull = np.abs(pin.computeGeneralizedGravity(model, data, state.q)) + np.abs(chain._passive.force(state.q, None))
    height = pull @ (atol + 1e-12 + rtol * np.abs(shift))
    stray = _kinetic_energy(chain, state.q, atol + rtol * np.abs(state.v))
    speed = stray + 2.0 * np.sqrt(kinetic * stray)
    rounding = np.finfo(float).eps * (abs(total) + abs(state.work) + state.dissipated)
    return float(height + speed + 2.0 * atol + rtol * (abs(state.work) + state.dissipated) + rounding)


def _told(chain: Simulations, when: FloatArray, states: list[_State], steps: int) -> Simulation:
    energies = np.array([_energies(chain, state) for state in states])
    return Simulation(
        frozen(when),
        frozen(np.array([state.q for state in states])),
        frozen(np.array([state.v for state in states])),
        frozen(energies[:, 0].copy()),
        frozen(energies[:, 1].copy()),
        frozen(np.array([state.work for state in states])),
        frozen(np.array([state.dissipated for state in states])),
        frozen(np.array([float(np.abs(chain.residual(state.q)).max(initial=0.0)) for state in states])),
        steps,
    )
