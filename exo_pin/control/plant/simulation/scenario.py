"""What is simulated, and what a run in minimal coordinates and one of the closed chain have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ....core.errors import InvalidInput
from ....core.fields import set_positive
from ....core.validation import FloatArray, as_finite, as_positive, frozen
from ....muscle.valve.flow import ATMOSPHERE
from ..equations.plant_kernels import state_size
from ..faults import Fault
from ..run import Run, recorded
from ..state import Controller, Measurement, PlantState, Sensor
from .drive_schedule import SAME, DriveSchedule

if TYPE_CHECKING:
    from ..plant import Plant

__all__ = ["Clock", "Instant", "Loop", "Scenario", "as_tolerance", "first_state"]

#: A run with more instants than this is a slip in duration or rate.
_MOST_INSTANTS = 10_000_000
#: Beyond this tolerance a run would end with a motion that is off by degrees, and not say so.
_LOOSEST = 1e-3


@dataclass(frozen=True)
class Clock:
    """Duration in s, and control and sample rate in Hz."""

    duration: float
    control_rate: float
    sample_rate: float

    def __post_init__(self) -> None:
        set_positive(self, "duration", "control_rate", "sample_rate")
        for name in ("control_rate", "sample_rate"):
            if self.duration * getattr(self, name) > _MOST_INSTANTS:
                raise InvalidInput(
                    f"expected {name} in Hz for at most {_MOST_INSTANTS} instants in {self.duration:g} s, got "
                    f"{getattr(self, name):g}"
                )

    def ticks(self, rate: float) -> FloatArray:
        """Times from 0 to the duration, s."""
        count = int(np.floor(self.duration * rate + SAME * rate))
        return np.append(np.arange(count + 1) / rate, [] if count / rate > self.duration - SAME else self.duration)


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
    clock: Clock
    start: PlantState
    faults: tuple[Fault, ...]
    sensor: Sensor | None
    rtol: float
    progress: bool

    def instants(self) -> list[Instant]:
        """Those that are known beforehand."""
        clock = self.clock
        samples, controls = clock.ticks(clock.sample_rate), clock.ticks(clock.control_rate)
        events = np.array([t for f in self.faults for t in (f.start, f.end) if 0.0 < t < clock.duration])
        fixed = np.unique(np.concatenate([samples, controls, events]))
        fixed = fixed[np.append(True, np.diff(fixed) > SAME)]
        sampled = _among(fixed, samples)
        controlled = _among(fixed, controls) & (fixed < clock.duration - SAME)
        return [Instant(*each) for each in zip(fixed.tolist(), sampled.tolist(), controlled.tolist(), strict=True)]


class Instant(NamedTuple):
    """A time in s, whether the run is recorded there, and whether the controller is called."""

    time: float
    sample: bool = False
    control: bool = False


def _among(times: FloatArray, chosen: FloatArray) -> np.ndarray:
    place = np.clip(np.searchsorted(chosen, times), 1, len(chosen)) if len(chosen) else np.zeros(len(times), dtype=int)
    padded = np.concatenate([chosen, [np.inf]])
    return np.minimum(np.abs(padded[place] - times), np.abs(padded[place - 1] - times)) <= SAME


def first_state(plant: Plant, start: PlantState) -> FloatArray:
    """The state of the equations at the start, with ξ = 0."""
    n, y = plant.count, np.zeros(state_size(plant.count))
    y[3:6], y[9 + 2 * n] = start.angular_velocity, plant.tables.air[1]
    y[6 : 6 + n] = np.where(plant.motors, np.asarray(start.drive_positions), start.pressures + ATMOSPHERE)
    y[13 + 5 * n : 13 + 6 * n] = np.where(plant.motors, np.asarray(start.drive_speeds), 0.0)
    return y


class Loop:
    """Controller, drives and record of a run, from instant to instant."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario, self.plant = scenario, scenario.plant
        self.schedule = DriveSchedule(self.plant.units, scenario.faults)
        self._rows: list[FloatArray] = []

    def at(self, instant: Instant, q: FloatArray, y: FloatArray) -> FloatArray:
        """Call the controller and record the state (with ξ = 0) where that is due; return what acts from then on."""
        time, schedule = instant.time, self.schedule
        if instant.control:
            seen = self._measured(q, y)
            if self.scenario.sensor is not None:
                seen = self.scenario.sensor(time, seen)
            commands = as_finite("the controller's commands", self.scenario.controller(time, seen), (self.plant.count,))
            schedule.commands = frozen(np.clip(commands, -1.0, 1.0))
        schedule.start(time)
        flows = schedule.flows(time)
        if instant.sample:
            self._rows.append(np.concatenate([[time], q, y, schedule.commands, flows[:, 6:].ravel()]))
        return flows

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
            plant.contraction_ratios(lengths),
            np.where(motors, y[6 : 6 + n], 0.0),
            y[13 + 5 * n : 13 + 6 * n].copy(),
        )

    def run(self, status: str, steps: int) -> Run:
        """What was recorded."""
        return recorded(self.plant, np.array(self._rows), status, steps)
