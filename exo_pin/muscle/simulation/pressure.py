"""Pressure inside the muscle as a function of time, the input of a step response."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import exp, inf

import numpy as np
import scipy
from numpy.typing import ArrayLike

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
