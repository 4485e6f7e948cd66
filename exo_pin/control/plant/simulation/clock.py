"""The instants of a run: of controller, samples and faults; and how exact it has to be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....core.errors import InvalidInput
from ....core.validation import FloatArray, as_positive, set_positive
from ..faults import Fault
from .drive_schedule import SAME

#: A run with more instants than this is a slip in duration or rate.
_MOST_INSTANTS = 10_000_000
#: Beyond this tolerance a run would end with a motion that is off by degrees, and not say so.
_LOOSEST = 1e-3
#: Decimals of the time at which a motion ends between all instants, s: sums of times then end where one long run does.
_DECIMALS = 12


def end_time(start: float, duration: float, *rates: float) -> float:
    """When a motion ends that takes a duration from a start on, s: on an instant of one of the rates, Hz, if at one."""
    end = start + duration
    for rate in rates:
        nearest = round(end * rate) / rate
        if abs(nearest - end) <= SAME:
            return nearest
    return round(end, _DECIMALS)


@dataclass(frozen=True)
class Clock:
    """Duration in s, control and sample rate in Hz, and the time in s at which it begins."""

    duration: float
    control_rate: float
    sample_rate: float
    start: float = 0.0

    def __post_init__(self) -> None:
        set_positive(self, "duration", "control_rate", "sample_rate")
        for name in ("control_rate", "sample_rate"):
            if self.duration * getattr(self, name) > _MOST_INSTANTS:
                raise InvalidInput(
                    f"expected {name} in Hz for at most {_MOST_INSTANTS} instants in {self.duration:g} s, got "
                    f"{getattr(self, name):g}"
                )

    @property
    def end(self) -> float:
        """When it ends, s."""
        return end_time(self.start, self.duration, self.control_rate, self.sample_rate)

    def ticks(self, rate: float) -> FloatArray:
        """Multiples of the period from start to end, s."""
        first = int(np.ceil((self.start - SAME) * rate))
        return np.arange(first, int(np.floor((self.end + SAME) * rate)) + 1) / rate

    def instants(self, faults: tuple[Fault, ...]) -> list[RunInstant]:
        """Those that are known beforehand: of controller, samples and faults."""
        controls, samples = self.ticks(self.control_rate), self.ticks(self.sample_rate)
        events = [t for fault in faults for t in (fault.start, fault.end) if self.start < t < self.end]
        # Start and end are samples; the controller is not called at the end any more.
        samples = np.concatenate([[self.start], samples, [self.end]])
        fixed = np.unique(np.concatenate([controls, samples, events]))
        fixed = fixed[np.append(True, np.diff(fixed) > SAME)]
        controlled = _among(fixed, controls) & (fixed < self.end - SAME)
        each = zip(fixed.tolist(), _among(fixed, samples).tolist(), controlled.tolist(), strict=True)
        return [RunInstant(*one) for one in each]


def as_tolerance(rtol: float) -> float:
    """A relative tolerance with which a run is a motion of the plant.

    Raises
    ------
    InvalidInput
        If it is not above zero, or too loose.
    """
    if as_positive("rtol", rtol) > _LOOSEST:
        raise InvalidInput(f"expected rtol as a relative tolerance of at most {_LOOSEST:g}, got {rtol:g}")
    return float(rtol)


class RunInstant(NamedTuple):
    """A time in s, whether the run is recorded there, and whether the controller is called."""

    time: float
    sample: bool = False
    control: bool = False


def _among(times: FloatArray, chosen: FloatArray) -> np.ndarray:
    """Whether each of some times is one of the chosen, which ascend."""
    padded = np.concatenate([[-np.inf], chosen, [np.inf]])
    place = np.searchsorted(padded, times)
    return np.minimum(padded[place] - times, times - padded[place - 1]) <= SAME
