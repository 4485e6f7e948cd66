"""Settling of a hung mass against the lag of its air supply."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive, frozen
from ..laws.dynamic import DynamicModel
from .pressure import PressureStep
from .response import StepResponse
from .step_response import QUICK, simulate

__all__ = ["SettlingCurve", "settling_against_lag"]

#: The thesis records each response for so long, s (Section 3.2).
RECORD = 8.0


@dataclass(frozen=True, eq=False)
class SettlingCurve(Record):
    """Settling times over the lag of the pressure.

    Attributes
    ----------
    lags : ndarray
        Shape (n,), s, time constants of the pressure.
    settling : ndarray
        Shape (n,), s, from the step to the moment after which the contraction stays within ``band`` times the step of
        its last value; infinite where it has not settled by the end of the record.
    overshoot : ndarray
        Shape (n,), fraction of the step.
    in_range : ndarray of bool
        Shape (n,), whether the motion stays within the model's range from the moment it first enters it. The start of
        the stroke of an empty muscle is outside.
    band : float
        Half the width of the band, as a fraction of the step.
    mass : float
        kg.
    pressure : float
        Final pressure, Pa.
    record : float
        Length of the record, s.
    """

    lags: FloatArray
    settling: FloatArray
    overshoot: FloatArray
    in_range: NDArray[np.bool_]
    band: float
    mass: float
    pressure: float
    record: float

    @property
    def quoted(self) -> FloatArray:
        """Settling times, NaN for motions that leave the model's range: these are not results of the model."""
        return np.where(self.in_range, self.settling, np.nan)


def settling_against_lag(
    model: DynamicModel,
    mass: float,
    pressure: float,
    lags: Sequence[float] | FloatArray,
    band: float = 0.02,
    record: float = RECORD,
) -> SettlingCurve:
    """Settling time of a mass lifted by an empty muscle, for supplies of different lag.

    Parameters
    ----------
    model : DynamicModel
        The muscle.
    mass : float
        Hung mass, kg.
    pressure : float
        Final pressure, Pa.
    lags : array_like
        Time constants of the pressure, s; 0 for a jump.
    band : float
        Half the width of the band, as a fraction of the step.
    record : float
        How long the response is recorded, s. With a long lag the last value is still short of the steady state.

    Returns
    -------
    SettlingCurve

    Raises
    ------
    InvalidInput
        If an argument is not usable.
    """
    taus = as_finite("lags", lags, (None,))
    if (taus < 0).any():
        raise InvalidInput(f"expected lags in s, zero or more, got {taus.min():g}")
    length = as_positive("record", record)
    times = np.linspace(0.0, length, 2001)
    supplies = [PressureStep(0.0, pressure, time_constant=float(tau)) for tau in taus]
    runs = [simulate(model, mass, supply, times, **QUICK) for supply in supplies]
    return SettlingCurve(
        lags=taus,
        settling=frozen(np.array([run.settling_time(band) for run in runs])),
        overshoot=frozen(np.array([run.overshoot for run in runs])),
        in_range=frozen(np.array([_stays_inside(run) for run in runs])),
        band=float(band),
        mass=float(mass),
        pressure=float(pressure),
        record=length,
    )


def _stays_inside(run: StepResponse) -> bool:
    """Whether a response stays within the model's range once it has entered it."""
    return bool(run.inside.any() and run.inside[int(run.inside.argmax()) :].all())
