"""A recorded response of a muscle, and how far a law is from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive, as_rising, set_fields
from ..laws.dynamic import DynamicModel
from ..simulation.pressure import PressureInput, PressureTrace
from ..simulation.step_response import QUICK, simulate


@dataclass(frozen=True)
class Recording(Record):
    """One recorded response of a hung mass.

    Parameters
    ----------
    time : array_like
        Shape (n,), s, rising.
    contraction : array_like
        Shape (n,), m.
    pressure : PressureInput or array_like
        Pressure over time, or shape (n,) in Pa.
    mass : float
        kg.
    start : float or None
        Contraction in m at rest before the first sample; None for the first sample, with its noise.

    Examples
    --------
    >>> from exo_pin.muscle import Recording
    >>> recording = Recording([0.0, 0.1, 0.2], [0.03, 0.031, 0.033], [2e5, 2.1e5, 2.2e5], mass=1.5)
    >>> round(1e-5 * float(recording.pressure(0.1)), 9)  # bar: samples become a pressure over time
    2.1
    """

    time: FloatArray
    contraction: FloatArray
    pressure: PressureInput
    mass: float
    start: float | None = None

    def __init__(
        self,
        time: ArrayLike,
        contraction: ArrayLike,
        pressure: PressureInput | ArrayLike,
        mass: float,
        start: float | None = None,
    ) -> None:
        t = as_rising("time", time)
        set_fields(
            self,
            time=t,
            contraction=as_finite("contraction", contraction, (len(t),)),
            pressure=pressure if isinstance(pressure, PressureInput) else PressureTrace(t, pressure),
            mass=as_positive("mass", mass),
            start=None if start is None else float(as_finite("start", start, ())),
        )

    def residual(self, model: DynamicModel) -> FloatArray:
        """Return simulated less recorded contraction, shape (n,), m.

        Parameters
        ----------
        model : DynamicModel
            The law that is simulated.

        Returns
        -------
        numpy.ndarray
            Shape (n,), m; positive where the law contracts more.

        Examples
        --------
        >>> from exo_pin.muscle import PressureStep, Recording, dynamic_model, simulate
        >>> law, step, time = dynamic_model("tang-3-31"), PressureStep(2e5, 3e5, 0.1, 0.3), np.linspace(0.0, 2.0, 51)
        >>> recording = Recording(time, simulate(law, 1.5, step, time, outside="mark").contraction, step, mass=1.5)
        >>> bool(np.abs(recording.residual(law)).max() < 1e-9)  # m, of the law that made the record
        True
        """
        # A small negative first sample is noise about the stop.
        start = max(0.0, float(self.contraction[0])) if self.start is None else self.start
        response = simulate(model, self.mass, self.pressure, self.time, start, **QUICK)
        return np.asarray(response.contraction - self.contraction)
