"""Time integration of a closed chain on the configuration manifold, with a check of the energy at every step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import scipy
from numpy.typing import ArrayLike

from ...core.errors import SimulationStopped
from ...core.validation import FloatArray
from ..kinematics.closing import close
from ..kinematics.loops import project_velocity, refined, tree_frame_jacobian
from ..structure.chain_state import ChainState
from .equations.equations_of_motion import inertia_matrix
from .forward_dynamics import efforts_of
from .nonsmooth.contact_forces import ContactMode, at_rest
from .nonsmooth.projected_motion import Applied, acceleration

#: Largest error of the energy in a step, as a share of the kinetic energy; larger only where a motion passes a
#: singularity.
_JUMP = 1e-4
#: Factor on the error that tolerances and rounding explain, below which an error is no jump: at rest there is no
#: kinetic energy to compare with.
_SPARE = 10.0
#: With more steps in a row than this below this size, s, the integration has failed. A jump of the efforts takes
#: fewer, at most six in trials: after it steps may grow tenfold each.
_LEAST_STEP, _SHORT_STEPS = 1e-9, 8
#: Step of the derivative of the rates.
_DIFFERENCE = 1e-7
_SINGULAR = (
    "Usually the configuration there is singular, and more than one motion is possible: stop before it, or start from "
    "another state"
)
_NONE = np.array([])


class Instant(NamedTuple):
    """Configuration, velocity, and the work done and energy dissipated so far, J."""

    q: FloatArray
    v: FloatArray
    work: float
    dissipated: float


@dataclass
class Rates:
    """The right side of the differential equations: y = (ξ, v, work, dissipated), with q = base ⊕ ξ.

    ``tau`` and ``external`` are given as for :meth:`ClosedChain.simulate`. In a mode with friction and stops the
    impulses of the coordinates that it holds follow, so that the steps resolve forces that change while nothing moves.
    ``carried`` is an acceleration of time that stands for that of the equations of motion.
    """

    state: ChainState
    tau: Any
    external: Any
    base: FloatArray = field(default_factory=lambda: np.array([]))
    mode: ContactMode | None = None
    carried: Callable[[float], FloatArray] | None = None

    def __call__(self, t: float, y: FloatArray) -> FloatArray:  # noqa: D102 - SciPy calls it
        state, model = self.state, self.state.model
        shift, v = y[: model.nv], y[model.nv : 2 * model.nv]
        q = pin.integrate(model, self.base, shift)
        applied = self.applied(t, q, v)
        rubbed = 0.0 if self.mode is None else -float(self.mode.sliding @ v)
        if self.carried is None:
            a, held = self._solved(q, v, applied)
        else:
            a, held = self.carried(t), np.zeros(len(y) - 2 * model.nv - 2)
        # d/dt (base ⊕ ξ) = v, so that ξ' is the inverse of the step's right Jacobian times v.
        rate = v
        if model.nq != model.nv:
            right = np.reshape(pin.dIntegrate(model, self.base, shift)[1], (model.nv, model.nv))
            rate = np.asarray(np.linalg.solve(right, v))
        return np.concatenate(
            [rate, a, [applied.efforts @ v + self._power(q, v, applied.external), state.passive.loss(v) + rubbed], held]
        )

    def derivative(self, t: float, y: FloatArray, rate: FloatArray) -> FloatArray:
        """Of the right side, ``rate``, by y, shape (n, n), by differences: it serves Newton's method alone."""
        found = np.zeros((len(y), len(y)))
        for k in range(2 * self.state.model.nv):
            moved = y.copy()
            moved[k] += _DIFFERENCE * max(1.0, abs(y[k]))
            found[:, k] = (self(t, moved) - rate) / (moved[k] - y[k])
        return found

    def _solved(self, q: FloatArray, v: FloatArray, applied: Applied) -> tuple[FloatArray, FloatArray]:
        if self.mode is None:
            return acceleration(self.state, q, v, applied), _NONE
        return self.mode.acceleration(q, v, applied)

    def acceleration(self, t: float, q: FloatArray, v: FloatArray) -> FloatArray:
        """Acceleration by the equations of motion, shape (nv,)."""
        return self._solved(q, v, self.applied(t, q, v))[0]

    def applied(self, t: float, q: FloatArray, v: FloatArray) -> Applied:
        """Efforts and external wrenches at a time and state."""
        tau = self.tau(t, q.copy(), v.copy()) if callable(self.tau) else self.tau
        external = self.external(t, q.copy(), v.copy()) if callable(self.external) else self.external
        return Applied(efforts_of(self.state, tau), external)

    def _power(self, q: FloatArray, v: FloatArray, external: Mapping[str, ArrayLike] | None) -> float:
        """Of the external wrenches, W."""
        return sum(
            float(np.asarray(wrench) @ (tree_frame_jacobian(self.state, q, frame) @ v))
            for frame, wrench in (external or {}).items()
        )


def taken(solver: scipy.integrate.OdeSolver, instant: Instant, short: int) -> int:
    """Take a step and return the number of very short steps in a row.

    Raises
    ------
    SimulationStopped
        If the steps become too small.
    """
    time, message = float(solver.t), solver.step()
    failed = solver.status == "failed"
    short = short + 1 if not failed and solver.step_size < _LEAST_STEP else 0
    if failed or short > _SHORT_STEPS:
        reason = message or f"steps would have to be below {_LEAST_STEP:g} s"
        raise SimulationStopped(time, instant.q.copy(), instant.v.copy(), f"{reason}. {_SINGULAR}")
    return short


def instant_of(rates: Rates, y: FloatArray) -> Instant:
    """The state that y is, with closed loops; those of a motion that is carried are closed behind."""
    state, nv = rates.state, rates.state.model.nv
    q, v = pin.integrate(state.model, rates.base, y[:nv]), y[nv : 2 * nv].copy()
    if state.row_count and rates.carried is None:
        q = refined(state, close(state, q, restarts=0))
        v = project_velocity(state, q, v)
    if rates.mode is not None:
        v = at_rest(state, q, v, rates.mode.index)
    return Instant(q, v, float(y[2 * nv]), float(y[2 * nv + 1]))


def energies_of(state: ChainState, instant: Instant) -> tuple[float, float]:
    """Total and kinetic energy, J."""
    data = state.buffers.data
    height = float(pin.computePotentialEnergy(state.model, data, instant.q))
    kinetic = kinetic_energy(state, instant.q, instant.v)
    return height + state.passive.energy(instant.q) + kinetic, kinetic


def kinetic_energy(state: ChainState, q: FloatArray, v: FloatArray) -> float:
    """J, rotors included: Pinocchio's own leaves them out for joints about an axis other than x, y or z."""
    return float(0.5 * v @ inertia_matrix(state, q) @ v)


def refuse_jump(
    state: ChainState, before: Instant, after: Instant, time: float, shift: FloatArray, tolerances: tuple[float, float]
) -> None:
    """Raise if a step changed the energy by more than its work, its tolerances and rounding explain."""
    (old, kinetic), (new, moving) = energies_of(state, before), energies_of(state, after)
    jump = abs(new - old - (after.work - before.work) + (after.dissipated - before.dissipated))
    model, data, (rtol, atol) = state.model, state.buffers.data, tolerances
    # The residual of a closed loop may be 1e-12.
    pull = np.abs(pin.computeGeneralizedGravity(model, data, after.q)) + np.abs(state.passive.force(after.q, None))
    height = float(pull @ (atol + 1e-12 + rtol * np.abs(shift)))
    stray = kinetic_energy(state, after.q, atol + rtol * np.abs(after.v))
    speed = stray + 2.0 * np.sqrt(moving * stray)
    exchanged = abs(after.work) + after.dissipated
    rounding = np.finfo(float).eps * (abs(new) + exchanged)
    explained = height + speed + 2.0 * atol + rtol * exchanged + rounding
    if jump > _JUMP * max(kinetic, moving) + _SPARE * explained:
        raise SimulationStopped(
            time,
            before.q.copy(),
            before.v.copy(),
            f"the next step changes the energy by {jump:.3g} J beyond work and dissipation. {_SINGULAR}",
        )
