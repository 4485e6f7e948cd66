"""A proportional and integral controller in discrete time, with output limits and anti-windup.

    v_k = K_c e_k + I_k             u_k = v_k, limited to the range of the output
    I_k+1 = I_k + h (K_c e_k / T_i + (u_k - v_k) / T_t)

h is the time between samples, rectangles to the left. The last term, back-calculation (Åström and Hägglund, Advanced
PID Control, 2006, Section 3.5), draws the integral back while the output is at a limit: with the tracking time T_t
it follows the limit instead of running away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.fields import set_positive
from ...core.validation import FloatArray, as_finite, as_positive


@dataclass(frozen=True)
class PIGains:
    """Gains of a PI controller.

    Attributes
    ----------
    K_c : float
        Proportional gain, output per unit of error.
    T_i : float
        Integral time, s.
    T_t : float or None
        Tracking time of the anti-windup, s; None for ``T_i``, infinite for none.
    """

    K_c: float
    T_i: float
    T_t: float | None = None

    def __post_init__(self) -> None:
        set_positive(self, "K_c", zero=True)
        set_positive(self, "T_i")
        if self.T_t is not None and self.T_t != np.inf:
            set_positive(self, "T_t")

    @property
    def tracking_time(self) -> float:
        """T_t, s."""
        return self.T_i if self.T_t is None else float(self.T_t)


class ProportionalIntegral:
    """PI controllers of n channels; see the module.

    Parameters
    ----------
    gains : sequence of PIGains
        One a channel.
    output : (float, float)
        Lowest and highest output of every channel.

    Attributes
    ----------
    integral : ndarray
        I, shape (n,), in units of the output.
    """

    def __init__(self, gains: list[PIGains] | tuple[PIGains, ...], output: tuple[float, float] = (0.0, 1.0)) -> None:
        if not isinstance(gains, tuple | list) or not gains or not all(isinstance(each, PIGains) for each in gains):
            raise InvalidInput("expected gains as a sequence of PIGains, one a channel")
        low, high = as_finite("output", output, (2,)).tolist()
        if not low < high:
            raise InvalidInput(f"expected output limits (lowest, highest), got ({low:g}, {high:g})")
        self.gains, self.output = tuple(gains), (low, high)
        self._proportional = np.array([each.K_c for each in gains])
        self._integral = np.array([each.K_c / each.T_i for each in gains])
        self._tracking = np.array([1.0 / each.tracking_time for each in gains])
        self.reset()

    def reset(self) -> None:
        """Forget the past: the integral to zero."""
        self.integral = np.zeros(len(self.gains))

    def step(self, error: ArrayLike, interval: float) -> FloatArray:
        """The output at a sample, and the integral taken on to the next.

        Parameters
        ----------
        error : array_like
            Shape (n,), wanted less measured.
        interval : float
            Time to the next sample, s.

        Returns
        -------
        ndarray
            Shape (n,), within the limits.

        Raises
        ------
        InvalidInput
            If an error is not finite, or the interval is not above zero.
        """
        h = as_positive("interval", interval)
        e = as_finite("error", error, (len(self.gains),))
        wanted = self._proportional * e + self.integral
        given = np.clip(wanted, *self.output)
        self.integral = self.integral + h * (self._integral * e + (given - wanted) * self._tracking)
        return given
