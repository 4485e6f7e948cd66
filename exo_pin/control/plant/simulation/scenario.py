"""What is simulated, and the controller, drives and record of a run, whatever integrates it."""

from __future__ import annotations

from dataclasses import dataclass
from traceback import format_exception_only
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ....core.errors import InvalidInput
from ....core.errors.base import shown
from ....core.fields import set_positive
from ....core.validation import FloatArray, as_finite, as_positive, frozen
from ....muscle.valve.flow import ATMOSPHERE
from ..faults import Fault
from ..run import Run, recorded
from ..snapshot import Snapshot
from ..state import Controller, Measurement, PlantState, Sensor
from .drive_schedule import SAME, DriveSchedule

if TYPE_CHECKING:
    from ..plant import Plant

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


class Scenario(NamedTuple):
    """What is simulated: a plant under a controller, from a start on."""

    plant: Plant
    controller: Controller
    instants: list[RunInstant]
    start: PlantState
    faults: tuple[Fault, ...]
    sensor: Sensor | None
    rtol: float
    progress: bool


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


class Loop:
    """Controller, drives and record of a run, from instant to instant."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario, self.plant, start = scenario, scenario.plant, scenario.start
        self.schedule = DriveSchedule(self.plant.units, scenario.faults)
        self.schedule.resume(start.commands, start.pulses)
        recall = getattr(scenario.sensor, "recall", None)
        if start.sensor is not None and recall is not None:
            recall(start.sensor)
        self._rows: list[FloatArray] = []
        self.snapshots: list[Snapshot] = []

    def snapshot(self, time: float, q: FloatArray, y: FloatArray, step: float) -> Snapshot:
        """Everything that the motion from now on depends on."""
        schedule, memory = self.schedule, getattr(self.scenario.sensor, "memory", None)
        return Snapshot(time, q.copy(), y.copy(), schedule.commands.copy(), schedule.pulses, step, memory)

    def command(self, time: float, q: FloatArray, y: FloatArray) -> str:
        """Call the controller; return what was wrong with it, or nothing."""
        seen = self._measured(q, y)
        who = "sensor"
        try:
            if self.scenario.sensor is not None:
                seen = self.scenario.sensor(time, seen)
            who = "controller"
            commands: ArrayLike = self.scenario.controller(time, seen)
        except Exception as error:
            # It copes with errors that cannot be printed.
            return shown(f"the {who} raised {format_exception_only(error)[-1].strip()}")
        try:
            valid = as_finite("the controller's commands", commands, (self.plant.count,))
        except InvalidInput as error:
            return str(error)
        self.schedule.commands = frozen(np.clip(valid, -1.0, 1.0))
        return ""

    def act(self, time: float) -> FloatArray:
        """What acts from now on, as the equations read it."""
        self.schedule.start(time)
        return self.schedule.flows(time)

    def record(self, snapshot: Snapshot, flows: FloatArray) -> None:
        """Record a state and what acts from then on."""
        self.snapshots.append(snapshot)
        now, commands = snapshot, self.schedule.commands
        self._rows.append(np.concatenate([[now.time], now.q, now.y, commands, flows[:, 6:].ravel()]))

    def _measured(self, q: FloatArray, y: FloatArray) -> Measurement:
        """What exact sensors report."""
        plant, n = self.plant, self.plant.count
        orientation, motors = Rotation.from_quat(q), plant.motors
        lengths = plant.contractions.lengths(orientation)
        return Measurement(
            orientation,
            y[3:6].copy(),
            np.where(motors, 0.0, y[6 : 6 + n] - ATMOSPHERE),
            float(y[9 + 2 * n]) - ATMOSPHERE,
            lengths,
            plant.contractions.ratios(lengths),
            np.where(motors, y[6 : 6 + n], 0.0),
            y[13 + 5 * n : 13 + 6 * n].copy(),
        )

    def run(self, status: str, steps: int) -> Run:
        """What was recorded."""
        return recorded(self.plant, np.array(self._rows), tuple(self.snapshots), status, steps)
