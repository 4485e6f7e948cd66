"""Result of a step response: contraction over time, stick and slip, energies, settling."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import IntEnum
from math import exp, inf

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive, as_rising, frozen


class PressureInput(Record, ABC):
    """Gauge pressure in Pa over time in s.

    Examples
    --------
    >>> from exo_pin.muscle import PressureInput, PressureStep, PressureTrace
    >>> [issubclass(kind, PressureInput) for kind in (PressureStep, PressureTrace)]
    [True, True]
    """

    #: Times in s at which the pressure jumps or has a kink; integration restarts there.
    breaks: tuple[float, ...] = ()
    #: Time in s over which it changes noticeably, infinite for a pressure that is constant between breaks.
    time_scale: float = inf

    @abstractmethod
    def __call__(self, time: float) -> float:
        """Pressure in Pa, at a break that after it."""

    def before(self, time: float) -> float:
        """Pressure in Pa, at a break that before it.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        float
            Pa.

        Examples
        --------
        >>> from exo_pin.muscle import PressureTrace
        >>> trace = PressureTrace([0.0, 1.0, 2.0], [1e5, 2e5, 2e5])
        >>> trace.before(1.0) == trace(1.0)  # Pa: a record has no break
        True
        """
        return self(time)

    def sample(self, times: FloatArray) -> FloatArray:
        """Pressure in Pa at each time, shape (n,).

        Parameters
        ----------
        times : ndarray
            Shape (n,), s.

        Returns
        -------
        ndarray
            Shape (n,), Pa.

        Examples
        --------
        >>> from exo_pin.muscle import PressureStep
        >>> lag = PressureStep(0.0, 2e5, time_constant=0.5).sample(np.array([0.5, 5.0]))
        >>> (lag / 2e5).round(3)  # 1 - 1/e after one time constant, then all of it
        array([0.632, 1.   ])
        """
        return np.array([self(t) for t in as_finite("times", times, (None,)).tolist()])


@checked
class PressureStep(PressureInput):
    """From one pressure to another: at once, or as a first-order lag, the way a muscle fills through a restriction.

    Parameters
    ----------
    initial, final : float
        Pa, zero or more.
    at : float
        Time of the step, s.
    time_constant : float
        Of the lag, s; 0 for a jump. The source records pressure beside contraction but prints neither.

    Raises
    ------
    InvalidInput
        If a value is not finite or negative.

    Examples
    --------
    >>> from exo_pin.muscle import PressureStep
    >>> filling = PressureStep(1e5, 3e5, at=0.2, time_constant=0.1)
    >>> filling(0.2), round(filling(0.2 + 0.1 * np.log(2.0)))  # Pa: half the way after ln 2 time constants
    (100000.0, 200000)
    """

    def __init__(self, initial: float, final: float, at: float = 0.0, time_constant: float = 0.0) -> None:
        self.initial = as_positive("initial", initial, zero=True)
        self.final = as_positive("final", final, zero=True)
        self.at = as_positive("at", at, zero=True)
        self.time_constant = as_positive("time_constant", time_constant, zero=True)
        self.breaks = (self.at,)
        self.time_scale = self.time_constant if self.time_constant > 0 else inf

    def __call__(self, time: float) -> float:
        """See :meth:`PressureInput.__call__`."""
        if time < self.at:
            return self.initial
        if self.time_constant == 0.0:
            return self.final
        return self.final + (self.initial - self.final) * exp(-(time - self.at) / self.time_constant)

    def before(self, time: float) -> float:
        """See :meth:`PressureInput.before`.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        float
            Pa.

        Examples
        --------
        >>> from exo_pin.muscle import PressureStep
        >>> jump = PressureStep(1e5, 3e5, at=0.2)
        >>> jump.before(0.2), jump(0.2)  # Pa
        (100000.0, 300000.0)
        """
        return self.initial if time <= self.at else self(time)


class PressureTrace(PressureInput):
    """A recorded pressure, interpolated without overshoot (monotone cubics), constant beyond its ends.

    Parameters
    ----------
    time : array_like
        Shape (n,), s, rising, at least two.
    pressure : array_like
        Shape (n,), Pa, zero or more.

    Raises
    ------
    InvalidInput
        If the shapes differ, the times do not rise, or a pressure is negative.

    Examples
    --------
    >>> from exo_pin.muscle import PressureTrace
    >>> trace = PressureTrace([0.0, 1.0, 2.0], [1e5, 3e5, 3e5])
    >>> trace(1.0), trace(9.0)  # Pa: at a sample, and after the last
    (300000.0, 300000.0)
    """

    def __init__(self, time: ArrayLike, pressure: ArrayLike) -> None:
        self.time = as_rising("time", time)
        self.pressure = as_finite("pressure", pressure, (len(self.time),))
        if (self.pressure < 0).any():
            raise InvalidInput(f"expected pressure to be zero or more, got {self.pressure.min():g} Pa")
        self._curve = scipy.interpolate.PchipInterpolator(self.time, self.pressure)
        self.breaks = (float(self.time[0]), float(self.time[-1]))
        self.time_scale = float(np.diff(self.time).min())

    def __call__(self, time: float) -> float:
        """See :meth:`PressureInput.__call__`."""
        return float(self._curve(min(max(time, self.breaks[0]), self.breaks[1])))

    def sample(self, times: FloatArray) -> FloatArray:
        """See :meth:`PressureInput.sample`.

        Parameters
        ----------
        times : ndarray
            Shape (n,), s.

        Returns
        -------
        ndarray
            Shape (n,), Pa.

        Examples
        --------
        >>> from exo_pin.muscle import PressureTrace
        >>> trace = PressureTrace([0.0, 1.0, 2.0], [1e5, 3e5, 3e5])
        >>> bool(trace.sample(np.linspace(0.0, 2.0, 101)).max() <= 3e5)  # Pa: it does not overshoot
        True
        """
        times = as_finite("times", times, (None,))
        return frozen(np.asarray(self._curve(np.clip(times, self.breaks[0], self.breaks[1]))))


class Mode(IntEnum):
    """What the muscle is doing.

    Examples
    --------
    >>> from exo_pin.muscle import Mode
    >>> [mode.name for mode in Mode]
    ['LENGTHENING', 'STICKING', 'SHORTENING', 'AT_STOP']
    """

    LENGTHENING = -1
    STICKING = 0
    SHORTENING = 1
    #: Held by its braid, which does not stretch.
    AT_STOP = 2


@dataclass(frozen=True)
class StepResponse(Record):
    """Motion of a hung mass.

    Attributes
    ----------
    time, contraction, velocity, pressure : ndarray
        Shape (n,), s, m, m/s, Pa.
    mode : ndarray of int
        Shape (n,), values of :class:`Mode`.
    inside : ndarray of bool
        Shape (n,), whether the model's range holds there. Elsewhere pull, friction and damping are cut at
        zero, so that they never push, and the motion is an extrapolation.
    switches : tuple of (float, Mode)
        Times in s and the mode that begins there.
    mass : float
        kg.
    muscle_work, friction_loss, damping_loss, impact_loss : float
        J over the whole motion: work of the static force on the mass and what friction, damping and hits on the
        stop took.
    energy_residual : float
        J, gain of kinetic and potential energy less the balance of the above: the integration's own error.

    Examples
    --------
    >>> from exo_pin.muscle import PressureStep, dynamic_model, simulate
    >>> step = PressureStep(2e5, 3e5, at=0.1, time_constant=0.3)
    >>> run = simulate(dynamic_model("tang-3-31"), 1.5, step, np.linspace(0.0, 3.0, 61), outside="mark")
    >>> bool(abs(run.energy_residual) < 1e-4 * run.muscle_work)  # J: work goes to height, motion, friction and damping
    True
    """

    time: FloatArray
    contraction: FloatArray
    velocity: FloatArray
    pressure: FloatArray
    mode: NDArray[np.int_]
    inside: NDArray[np.bool_]
    switches: tuple[tuple[float, Mode], ...]
    mass: float
    muscle_work: float
    friction_loss: float
    damping_loss: float
    impact_loss: float
    energy_residual: float

    @property
    def cautions(self) -> tuple[str, ...]:
        """That the motion leaves the model's range, if it does."""
        if self.inside.all():
            return ()
        return (
            f"The motion is inside the range of the model for {100.0 * self.inside.mean():.1f} % of the time; "
            "elsewhere it is extrapolated.",
        )

    @property
    def at_rest(self) -> bool:
        """Whether the motion has ended: the last mode is sticking or at the stop."""
        return self.mode[-1] in (Mode.STICKING, Mode.AT_STOP)

    @property
    def steady_state(self) -> float:
        """Contraction in m at the end; a steady state only if :attr:`at_rest`."""
        return float(self.contraction[-1])

    @property
    def step(self) -> float:
        """Contraction at the end less that at the start, m.

        Raises
        ------
        InvalidInput
            If the mass ends where it began, so that no number relative to the step is defined.
        """
        step = self.steady_state - float(self.contraction[0])
        if abs(step) < 1e-12:
            raise InvalidInput("expected a response that ends elsewhere than it began")
        return step

    @property
    def overshoot(self) -> float:
        """Largest excursion beyond the steady state, as a fraction of the step; 0 if there is none."""
        beyond = (self.contraction - self.steady_state) / self.step
        return max(0.0, float(beyond.max()))

    def settling_time(self, band: float = 0.02) -> float:
        """Time in s from the start until the contraction stays within ``band`` times the step of its steady state.

        Interpolated between samples; infinite if it left the band in the last tenth of the time, so that it
        may not have settled.

        Parameters
        ----------
        band : float
            Share of the step.

        Returns
        -------
        float
            s.

        Raises
        ------
        InvalidInput
            If ``band`` is not above zero or the response has no step.

        Examples
        --------
        >>> from exo_pin.muscle import PressureStep, dynamic_model, simulate
        >>> step, law = PressureStep(2e5, 3e5, time_constant=0.3), dynamic_model("tang-3-31")
        >>> slow = simulate(law, 1.5, step, np.linspace(0.0, 3.0, 301), outside="mark")
        >>> round(slow.settling_time(), 2)  # s; that of the pressure alone is 0.3 s · ln 50 = 1.17 s
        1.08
        """
        width = as_positive("band", band) * abs(self.step)
        away = np.abs(self.contraction - self.steady_state) - width
        outside = np.nonzero(away > 0)[0]
        if len(outside) == 0:
            return 0.0
        last = int(outside[-1])
        if self.time[last] - self.time[0] > 0.9 * (self.time[-1] - self.time[0]):
            return float("inf")
        share = away[last] / (away[last] - away[last + 1])
        return float(self.time[last] + share * (self.time[last + 1] - self.time[last]) - self.time[0])
