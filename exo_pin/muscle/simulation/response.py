"""Result of a step response: contraction over time, stick and slip, energies, settling."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, as_positive


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
    error_estimate : float or None
        m, largest change of the contraction when integrated again with tolerances a hundred times smaller.

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
    error_estimate: float | None

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
