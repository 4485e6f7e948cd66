"""Motion through singular configurations: the incoming motion is carried on to the other side.

Next to a configuration in which the loops lose rank the equations of motion are divided by the singular value σ that
vanishes there, and in it more than one motion is possible: a flat parallelogram may go on as one or turn into an
antiparallelogram. Without an impact velocities are continuous, so that the branch is that of the incoming motion; where
two branches have one tangent its curvature and all higher derivatives decide, which are continuous, too. Where the m-th
derivative is the first that differs, σ vanishes like the m-th power of time.

So the accelerations of the motion before the place, each computed where σ is still large, are continued as a polynomial
of time, until σ is as large again on the other side. There the loops have to close, the velocity has to keep them
closed, and the equations of motion have to give the acceleration that was continued; otherwise the motion is not
decided, and the simulation stops. Forces that jump while σ is small are not seen.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import scipy
from numpy.polynomial import chebyshev

from ...core.errors import ExoPinError, SimulationStopped
from ...core.validation import FloatArray
from ..kinematics.closing import close
from ..kinematics.loops import project_velocity, refined, scaled_jacobian
from ..structure.chain_state import ChainState
from .integration import Instant, Rates, instant_of
from .nonsmooth.settling import MotionEvent

#: The motion is carried through where σ is below this share of its largest value in the motion, and not before it is
#: below the second one if there was no smooth motion before.
_ZONE, _LEAST = 1e-2, 1e-4
#: Degree of the polynomial, samples, and time before the place in units of the time that is left to it.
_DEGREE, _SAMPLES, _BEFORE, _LEAST_BEFORE = 8, 24, 10.0, 4.0
#: Longest passage, in units of the time that was left to the place.
_LONGEST = 8.0
#: Largest misfit of the polynomial, and largest change behind the place by its last two terms, as a share of the
#: largest acceleration.
_MISFIT, _DOUBT = 1e-6, 1e-4
#: Steps halve or double σ at most where it is below this share of its largest value.
_NEAR = 0.3
#: How far continued velocity and acceleration may be from those that the loops allow, as a share of the largest.
_MISSED_SPEED, _MISSED_RATE = 1e-5, 1e-2
#: Singular values below this share of the largest are not counted: rows are redundant to the loops' residual.
_REDUNDANT = 1e-6
#: Steps that are kept; next to the place they halve σ, so that few reach back far enough.
_KEPT = 64
#: σ that does not change its sign has touched zero if it was below this share of that at the start of the passage.
_TOUCH = 1e-3
#: Step along the motion, characteristic lengths and rad, to the derivative of σ.
_STEP = 1e-6


class Nearness(NamedTuple):
    """The least singular value that is not always zero, its rate, 1/s, its motion, (nv,), and combination of rows."""

    value: float
    rate: float
    motion: FloatArray
    rows: FloatArray

    @property
    def left(self) -> float:
        """Time until it vanishes, s, if it goes on as it does."""
        return self.value / -self.rate if self.rate < 0.0 else np.inf


class SmoothStep(NamedTuple):
    """A step of the integrator, from ``start`` to ``end``, s, with its dense output relative to ``base``."""

    start: float
    end: float
    base: FloatArray
    inside: scipy.integrate.DenseOutput


class Passage(NamedTuple):
    """Where a motion is carried through: until ``end``, s, from where it was ``near``, at ``start``."""

    start: float
    end: float
    near: Nearness


def _polynomial(end: float, length: float, coefficients: FloatArray) -> Callable[[float], FloatArray]:
    """A function of time by Chebyshev coefficients over the ``length`` before ``end``, s, also behind the end."""
    return lambda time: np.asarray(chebyshev.chebval(1.0 + 2.0 * (time - end) / length, coefficients))


@dataclass
class Crossings:
    """Singular configurations on the way of one integration.

    Attributes
    ----------
    rates : Rates
        The differential equations.
    largest : float
        Largest σ so far.
    rank : int
        Largest rank of the loops so far.
    smooth_steps : deque of SmoothStep
        The last steps, none from before the motion was last not smooth.
    last : tuple or None
        Time, s, and rate of σ before, 1/s.
    """

    rates: Rates
    largest: float = 0.0
    rank: int = 0
    smooth_steps: deque[SmoothStep] = field(default_factory=lambda: deque(maxlen=_KEPT))
    last: tuple[float, float] | None = None

    def near(self, instant: Instant) -> Nearness:
        """How near the loops are to losing rank; their rows are scaled with the characteristic length."""
        state = self.rates.state
        values, left, right = _singular_values(state, instant.q)
        rank = int(np.count_nonzero(values > _REDUNDANT * values[0]))
        if 0 < self.rank < rank:
            self.largest = 0.0
        self.rank = max(self.rank, rank)
        if not self.rank:
            return Nearness(np.inf, 0.0, np.zeros(state.nv), np.zeros(state.row_count))
        value = float(values[self.rank - 1])
        self.largest = max(self.largest, value)
        speed = float(np.abs(instant.v / state.topology.column).max(initial=0.0))
        motion, rows = right[self.rank - 1], left[:, self.rank - 1]
        if speed == 0.0:
            return Nearness(value, 0.0, motion, rows)
        ahead = pin.integrate(state.model, instant.q, instant.v * (_STEP / speed))
        moved = scaled_jacobian(state, ahead)[0]
        return Nearness(value, float(rows @ moved @ motion - value) * speed / _STEP, motion, rows)

    def ahead(self, time: float, instant: Instant, end: float) -> tuple[float, Passage | None]:
        """Until when the next step may go, and where it starts to carry the motion through, in which passage.

        Raises
        ------
        SimulationStopped
            If no smooth motion leads to the singular configuration.
        """
        if not self.rates.state.row_count:
            return end, None
        before = self.rank
        near = self.near(instant)
        if 0 < before < self.rank:
            raise _undecided(time, instant, "the motion started in a singular configuration", near.motion, self.rates)
        zone = _ZONE * self.largest
        if near.value > _NEAR * self.largest and near.left >= end - time:
            self.last = (time, near.rate)
            return end, None
        if near.value <= zone and self.smooth_steps:
            smooth = self._continued(time, near.left)
            if smooth is not None:
                self.rates.carried = smooth
                return time + 2.0 * near.left, Passage(time, time + 2.0 * near.left, near)
        if near.value <= _LEAST * self.largest:
            reason = "the loops lose rank at a singular configuration, and no smooth motion leads there"
            raise _undecided(time, instant, reason, near.motion, self.rates)
        return min(end, time + self._halving(time, near)), None

    def _halving(self, time: float, near: Nearness) -> float:
        """Time in which σ falls to about a half, or rises to the double, s; its second derivative is a difference."""
        bend = 0.0 if self.last is None else (near.rate - self.last[1]) / (time - self.last[0])
        self.last = (time, near.rate)
        half = 0.5 * near.value
        # Roots of half + rate t + bend t²/2 (falling) and -2 half + rate t + bend t²/2 (rising).
        roots = [root for rest in (half, -2.0 * half) for root in np.roots([0.5 * bend, near.rate, rest])]
        return min((float(root.real) for root in roots if root.imag == 0.0 and root.real > 0.0), default=np.inf)

    def arrived(
        self, time: float, instant: Instant, passage: Passage
    ) -> tuple[Instant, Passage | None, list[MotionEvent]]:
        """Behind a singular configuration: the state on closed loops, and the crossing if σ was zero.

        Where σ is too small still, the passage that goes on is the second one.

        Raises
        ------
        SimulationStopped
            If the loops allow no motion that continues the incoming one.
        """
        rates, state = self.rates, self.rates.state
        near, entry, lasted = self.near(instant), passage.near, passage.end - passage.start
        if near.rate < 0.0 or near.value < 0.1 * entry.value:
            if lasted > _LONGEST * entry.left:
                raise _undecided(time, instant, "the motion stays singular", near.motion, rates)
            return instant, passage._replace(end=time + 0.5 * entry.left), []
        assert rates.carried is not None
        continued, rates.carried = rates.carried(time), None
        column = state.topology.column
        try:
            q = refined(state, close(state, instant.q, restarts=0))
            v = project_velocity(state, q, instant.v)
            a = rates.acceleration(time, q, v)
        except ExoPinError as error:
            raise _undecided(time, instant, f"behind it {error}", near.motion, rates) from error
        speed = float(np.abs(instant.v / column).max())
        size = max(float(np.abs(x / column).max()) for x in (continued, a))
        slip, miss = (float(np.abs(x / column).max()) for x in (v - instant.v, a - continued))
        if slip > _MISSED_SPEED * speed or miss > _MISSED_RATE * size:
            reason = f"no motion of the loops continues the incoming one: velocities differ by {slip:.3g} rad/s"
            raise _undecided(time, instant, reason, near.motion, rates)
        found = Instant(q, v, instant.work, instant.dissipated)
        # σ = c τ^m is its rate times τ / m.
        order = max(1, round(lasted / (entry.left + near.value / near.rate)))
        before, behind = (value ** (1.0 / order) for value in (entry.value, near.value))
        middle = passage.start + lasted * before / (before + behind)
        base, y = self._at(middle)
        least = _singular_values(state, pin.integrate(state.model, base, y[: state.nv]))[0][self.rank - 1]
        crosses = entry.rows @ scaled_jacobian(state, q)[0] @ entry.motion < 0.0
        if not crosses and (order == 1 or least > _TOUCH * entry.value):
            return found, None, []
        there = y[state.nv : 2 * state.nv]
        tangent = tuple((there / np.abs(there).max()).tolist())
        return found, None, [MotionEvent(middle, "crossing", moving_joints(state, entry.motion), order, tangent)]

    def _continued(self, time: float, left: float) -> Callable[[float], FloatArray] | None:
        """The acceleration as a polynomial of time, from that of the motion before; None if that was not smooth."""
        length = min(_BEFORE * left, time - self.smooth_steps[0].start)
        while length >= _LEAST_BEFORE * left:
            nodes = np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
            times = time - 0.5 * length * (1.0 - nodes)
            values = np.array([self._acceleration(t) for t in times.tolist()])
            found = chebyshev.chebfit(nodes, values, _DEGREE)
            size, smooth = np.abs(values).max(), _polynomial(time, length, found)
            misfit = np.abs(chebyshev.chebval(nodes, found).T - values).max()
            behind = time + 2.0 * left
            doubt = np.abs(smooth(behind) - _polynomial(time, length, found[:-2])(behind)).max()
            if misfit <= _MISFIT * size and doubt <= _DOUBT * size:
                return smooth
            length *= 0.5
        return None

    def _acceleration(self, time: float) -> FloatArray:
        rates, base = self.rates, self.rates.base
        rates.base, y = self._at(time)
        instant = instant_of(rates, y)
        rates.base = base
        return rates.acceleration(time, instant.q, instant.v)

    def _at(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Base and state of the last steps at a time."""
        step = next(p for p in reversed(self.smooth_steps) if p.start <= time)
        return step.base, step.inside(min(time, step.end))


def _singular_values(state: ChainState, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of the scaled Jacobian of the loops: values, left ones as columns, right ones as rows."""
    left, values, right = np.linalg.svd(scaled_jacobian(state, q)[0], full_matrices=False)
    return values, left, right


def moving_joints(state: ChainState, motion: FloatArray) -> tuple[str, ...]:
    """Names of the joints that move in a motion, shape (nv,), in characteristic lengths and rad."""
    own = np.flatnonzero(np.abs(motion) > 1e-3 * np.abs(motion).max(initial=0.0))
    return tuple(str(state.model.names[int(i)]) for i in np.unique(state.topology.owners[own]))


def _undecided(time: float, instant: Instant, reason: str, motion: FloatArray, rates: Rates) -> SimulationStopped:
    joints = ", ".join(moving_joints(rates.state, motion))
    return SimulationStopped(
        time,
        instant.q.copy(),
        instant.v.copy(),
        f"{reason}. At a singular configuration more than one motion is possible, and {joints} move in another one: "
        "stop before it, or start from another state",
    )
