"""The controller of the prototype, Figure 5-8: contraction ratios, one PI controller a muscle.

Wanted pose -> inverse kinematics -> wanted ratio (5-4); measured pose -> inverse kinematics -> ratio; their difference
-> PI -> duty -> pulses of 20 Hz (the plant's valves). Each muscle follows its own length: nothing in it knows of
tensions, of the singular pose, or that a muscle cannot push.

What the thesis does not print, and is taken here:

* The unit of the error. The gains are of the order of 0.03; with errors as ratios below 0.4 the valves would hardly
  open. With **percent** of the nominal length an error of 10 % opens them for about a quarter of the time.
* The unit of T_i. Taken as **seconds**. In minutes, the habit of some control programs, the integral would need more
  than half a minute, and the error after 5 s would not be "within 5 %".
* The duty 0 of a muscle that is longer than wanted: the valve then only vents.
* Anti-windup: back-calculation with T_t = T_i. The thesis mentions none.

The PI controllers are in discrete time, with limits of the output:

    v_k = K_c e_k + I_k             u_k = v_k, limited to the range of the output
    I_k+1 = I_k + h (K_c e_k / T_i + (u_k - v_k) / T_t)

h is the time between samples, rectangles to the left. The last term, back-calculation (Åström and Hägglund, Advanced
PID Control, 2006, Section 3.5), draws the integral back while the output is at a limit: with the tracking time T_t
it follows the limit instead of running away.

Source: thesis Table 5-5, Figure 5-8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_choice, as_finite, as_positive, require_type, set_positive
from ...muscle.valve.flow import LAYOUTS
from ..plant.contractions import contractions_of


@checked
@dataclass(frozen=True)
class PIGains:
    """Gains of a PI controller.

    Attributes
    ----------
    K_c : float
        Proportional gain, output per unit of error.
    T_i : float
        Integral time, s, which is that of the anti-windup, too.

    Examples
    --------
    >>> from exo_pin.control import PIGains, ProportionalIntegral
    >>> pi = ProportionalIntegral([PIGains(K_c=0.1, T_i=2.0)])
    >>> outputs = [float(pi.step([1.0], 0.5)[0]) for _ in range(5)]
    >>> round(outputs[4] / outputs[0], 9)  # after T_i a constant error has doubled the output
    2.0
    """

    K_c: float
    T_i: float

    def __post_init__(self) -> None:
        set_positive(self, "K_c", zero=True)
        set_positive(self, "T_i")


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

    Examples
    --------
    >>> from exo_pin.control import PIGains, ProportionalIntegral
    >>> pi = ProportionalIntegral([PIGains(0.1, 2.0), PIGains(0.2, 2.0)])
    >>> pi.step([1.0, 1.0], 0.01)  # at first the proportional part alone
    array([0.1, 0.2])
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
        self._tracking = np.array([1.0 / each.T_i for each in gains])
        self.reset()

    def reset(self) -> None:
        """Forget the past: the integral to zero.

        Examples
        --------
        >>> from exo_pin.control import PIGains, ProportionalIntegral
        >>> pi = ProportionalIntegral([PIGains(0.1, 2.0)])
        >>> out = pi.step([1.0], 0.5)
        >>> pi.reset()
        >>> pi.integral
        array([0.])
        """
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

        Examples
        --------
        >>> from exo_pin.control import PIGains, ProportionalIntegral
        >>> pi = ProportionalIntegral([PIGains(0.1, 2.0)], output=(0.0, 0.12))
        >>> [round(float(pi.step([1.0], 0.1)[0]), 3) for _ in range(6)]  # K_c h/T_i more each, up to the limit
        [0.1, 0.105, 0.11, 0.115, 0.12, 0.12]
        """
        h = as_positive("interval", interval)
        e = as_finite("error", error, (len(self.gains),))
        wanted = self._proportional * e + self.integral
        given = np.clip(wanted, *self.output)
        self.integral = self.integral + h * (self._integral * e + (given - wanted) * self._tracking)
        return given


#: Table 5-5, by nominal length in m; T_d = 0 there, so there is no derivative.
TABLE_5_5 = {0.150: PIGains(2.3e-2, 6.62e-1), 0.250: PIGains(3.3e-2, 9.5e-1)}


def table_5_5_gains(nominal_lengths: Sequence[float]) -> tuple[PIGains, ...]:
    """Gains of Table 5-5 for muscles of these nominal lengths, m; those of the nearest length printed there."""
    return tuple(TABLE_5_5[min(TABLE_5_5, key=lambda printed: abs(printed - length))] for length in nominal_lengths)


def command_of_duty(duty: ArrayLike, layout: str = "3/2") -> FloatArray:
    """Valve command of the share of time for which a muscle fills.

    A 3/2-way valve vents whenever it does not fill, so the command is 2 d - 1. With separate valves that can both be
    closed the duty is the command itself.

    Parameters
    ----------
    duty : array_like
        Shape (n,), 0 to 1.
    layout : {"3/2", "fill and vent"}
        Of the valves (:class:`exo_pin.muscle.ValveUnit`).
    """
    share = as_finite("duty", duty, (None,))
    return np.asarray(2.0 * share - 1.0 if as_choice("layout", layout, LAYOUTS) == "3/2" else share)


class ContractionController:
    """PI control of contraction ratios; see the module.

    Parameters
    ----------
    mechanism : Mechanism, or contractions of a plant
        The design that the controller takes for granted; the plant may be another.
    reference : callable
        Orientations over time, ``reference(t).orientation``.
    gains : sequence of PIGains, optional
        One a muscle, duty per percent of contraction; those of Table 5-5 if left out.
    rate : float
        Samples a second, Hz.
    layout : {"3/2", "fill and vent"}
        Of the valves.

    Raises
    ------
    InvalidInput
        If there is not one gain a muscle; UnknownName if there is no such layout.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo = ep.load("prototype")
    >>> controller = control.ContractionController(exo.mechanism, control.abduction())
    >>> command = ep.Plant(exo).simulate(controller, 0.05).commands[0]
    >>> (0.5 * (1.0 + command)).round(2)  # share of the time for which each valve fills its muscle at first
    array([0.  , 0.  , 0.14])
    """

    def __init__(
        self,
        mechanism: Any,
        reference: Callable[[float], Any],
        gains: Sequence[PIGains] | None = None,
        rate: float = 100.0,
        layout: str = "3/2",
    ) -> None:
        self.contractions = contractions_of(mechanism)
        require_type("reference", reference, Callable, "a function of time")
        self._reference = reference
        count = len(self.contractions.nominal)
        if gains is not None and not np.iterable(gains):
            raise InvalidInput(f"expected gains as a sequence of PIGains, one a muscle, got {echo(gains)}")
        chosen = table_5_5_gains(self.contractions.nominal.tolist()) if gains is None else tuple(gains)
        if len(chosen) != count:
            raise InvalidInput(f"expected {count} gains, one a muscle, got {len(chosen)}")
        self._pi = ProportionalIntegral(chosen, (0.0, 1.0))
        self._interval = 1.0 / as_positive("rate", rate)
        self._layout = as_choice("layout", layout, LAYOUTS)
        self.reset()

    def wanted(self, t: float) -> FloatArray:
        """Contraction ratios of the reference at a time in s, shape (n,).

        Parameters
        ----------
        t : float
            s.

        Returns
        -------
        ndarray
            Shape (n,).

        Examples
        --------
        >>> from exo_pin import control
        >>> exo = ep.load("prototype")
        >>> controller = control.ContractionController(exo.mechanism, control.abduction())
        >>> (100.0 * (controller.wanted(5.0) - controller.wanted(0.0))).round(1)  # % by which each muscle shortens
        array([17.7, 34.7, 35.1])
        """
        return self.contractions.ratios(self.contractions.lengths(self._reference(t).orientation))

    def reset(self) -> None:
        """Integrals to zero: vented muscles.

        Examples
        --------
        >>> from exo_pin import control
        >>> exo = ep.load("prototype")
        >>> plant, controller = ep.Plant(exo), control.ContractionController(exo.mechanism, control.flexion())
        >>> once = plant.simulate(controller, 0.1).pressures
        >>> controller.reset()
        >>> bool((plant.simulate(controller, 0.1).pressures == once).all())  # Pa
        True
        """
        self._pi.reset()

    def __call__(self, t: float, measurement: Any) -> FloatArray:
        """Commands at a sample; see :class:`Controller`. Without a reading it goes on with the last one."""
        ratio = self.contractions.ratios(self.contractions.lengths(measurement.orientation))
        return command_of_duty(self._pi.step(100.0 * (self.wanted(t) - ratio), self._interval), self._layout)
