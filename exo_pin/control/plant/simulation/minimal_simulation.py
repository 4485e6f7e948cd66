"""The plant in time: from instant to instant at which a valve, the controller, a fault or a sample asks for a stop."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ....core.errors import InvalidInput
from ....core.progress import track
from ....core.validation import FloatArray, as_finite, as_positive, frozen
from ....muscle.valve.flow import ATMOSPHERE
from ..equations.integrator import DONE, TOO_SMALL, advance
from ..equations.plant_kernels import Tables, state_size
from ..faults import Fault
from ..run import Run, recorded
from ..state import Controller, Measurement, PlantState, Sensor
from .drive_schedule import DriveSchedule

if TYPE_CHECKING:
    from ..plant import Plant

__all__ = ["Clock", "as_commands", "as_tolerance", "first_state", "fixed_instants", "measured", "simulate_minimal"]

#: Units of the state in which its tolerances are equal: rad, rad/s, Pa, 1, J, kg, m, m/s.
_UNITS = {
    "turn": 1.0, "speed": 1.0, "pressure": 1e4, "bristle": 1.0, "energy": 1.0, "air": 1e-5, "position": 0.1,
    "drive speed": 0.1,
}  # fmt: skip
_FIRST_STEP, _SAME = 1e-5, 1e-9
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
        for name in ("duration", "control_rate", "sample_rate"):
            object.__setattr__(self, name, as_positive(name, getattr(self, name)))
        for name in ("control_rate", "sample_rate"):
            if self.duration * getattr(self, name) > _MOST_INSTANTS:
                raise InvalidInput(
                    f"expected {name} in Hz for at most {_MOST_INSTANTS} instants in {self.duration:g} s, got "
                    f"{getattr(self, name):g}"
                )

    def ticks(self, rate: float) -> FloatArray:
        """Times from 0 to the duration, s."""
        count = int(np.floor(self.duration * rate + _SAME * rate))
        return np.append(np.arange(count + 1) / rate, [] if count / rate > self.duration - _SAME else self.duration)


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


def tolerances(tables: Tables, rtol: float) -> FloatArray:
    """Absolute tolerances of the state, shape (size,)."""
    u, n, motors = _UNITS, len(tables.base), tables.motors[:, 0]
    parts = [(3, "turn"), (3, "speed"), (n, "pressure"), (n + 3, "bristle"), (1, "pressure"), (3 * n + 1, "energy")]
    parts += [(2, "air"), (n, "drive speed"), (n, "energy")]
    atol = rtol * np.concatenate([np.full(count, u[name]) for count, name in parts])
    atol[6 : 6 + n][motors > 0.0] = rtol * u["position"]
    return atol


def measured(plant: Plant, q: FloatArray, y: FloatArray) -> Measurement:
    """What exact sensors report of a state with ξ = 0."""
    tables, n = plant.tables, plant.count
    orientation, motors = Rotation.from_quat(q), tables.motors[:, 0] > 0.0
    lengths = np.linalg.norm(orientation.apply(tables.platform) - tables.base, axis=1)
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


def first_state(plant: Plant, start: PlantState) -> FloatArray:
    """The state of the equations at the start, with ξ = 0."""
    n, y = plant.count, np.zeros(state_size(plant.count))
    motors = plant.tables.motors[:, 0] > 0.0
    y[3:6], y[9 + 2 * n] = start.angular_velocity, plant.tables.air[1]
    y[6 : 6 + n] = np.where(motors, np.asarray(start.drive_positions), start.pressures + ATMOSPHERE)
    y[13 + 5 * n : 13 + 6 * n] = np.where(motors, np.asarray(start.drive_speeds), 0.0)
    return y


def simulate_minimal(
    plant: Plant,
    controller: Controller,
    clock: Clock,
    start: PlantState,
    faults: tuple[Fault, ...],
    sensor: Sensor | None,
    rtol: float,
    progress: bool,
) -> Run:
    """See :meth:`exo_pin.control.plant.plant.Plant.simulate`."""
    if not plant.mechanism.limbs_are_massless:
        raise InvalidInput('minimal coordinates are for massless limbs, and these have mass: use method="chain"')
    tables, n = plant.tables, plant.count
    q, y = start.orientation.as_quat(), first_state(plant, start)
    atol = tolerances(tables, as_tolerance(rtol))
    schedule = DriveSchedule(plant.units, faults)
    rows, status, step = [], "completed", _FIRST_STEP
    instants = _instants(clock, faults, schedule)
    steps, before, flows = 0, 0.0, schedule.flows(0.0)
    for time, sample, control in track(instants, "simulating", progress):
        if time > 0.0:
            ended, taken, step, left = advance(tables, flows, q, y, time - before, step, rtol, atol)
            steps += taken
            if ended != DONE:
                reason = "steps would have to be too small" if ended == TOO_SMALL else "the motion is not finite"
                status = f"stopped at {time - left:.6g} s: {reason}"
                break
        before = time
        if control:
            exact = measured(plant, q, y)
            seen = exact if sensor is None else sensor(time, exact)
            schedule.commands = as_commands(controller(time, seen), n)
        schedule.start(time)
        flows = schedule.flows(time)
        if sample:
            rows.append(np.concatenate([[time], q, y, schedule.commands, flows[:, 6:].ravel()]))
    return recorded(plant, np.array(rows), status, steps)


def fixed_instants(clock: Clock, faults: tuple[Fault, ...]) -> list[tuple[float, bool, bool]]:
    """Times in s known beforehand, whether the run is recorded there, and whether the controller is called."""
    samples, controls = clock.ticks(clock.sample_rate), clock.ticks(clock.control_rate)
    events = np.array([t for f in faults for t in (f.start, f.end) if 0.0 < t < clock.duration])
    fixed = np.unique(np.concatenate([samples, controls, events]))
    fixed = fixed[np.append(True, np.diff(fixed) > _SAME)]
    sampled = _among(fixed, samples)
    controlled = _among(fixed, controls) & (fixed < clock.duration - _SAME)
    return list(zip(fixed.tolist(), sampled.tolist(), controlled.tolist(), strict=True))


def _instants(clock: Clock, faults: tuple[Fault, ...], schedule: DriveSchedule) -> Iterator[tuple[float, bool, bool]]:
    """As :func:`fixed_instants`, and those at which a valve switches."""
    time = 0.0
    for instant, sample, control in fixed_instants(clock, faults):
        while instant > 0.0 and (switch := schedule.next_switch(time)) < instant - _SAME:
            time = switch
            yield time, False, False
        time = instant
        yield instant, sample, control


def _among(times: FloatArray, chosen: FloatArray) -> np.ndarray:
    place = np.clip(np.searchsorted(chosen, times), 1, len(chosen)) if len(chosen) else np.zeros(len(times), dtype=int)
    padded = np.concatenate([chosen, [np.inf]])
    return np.minimum(np.abs(padded[place] - times), np.abs(padded[place - 1] - times)) <= _SAME


def as_commands(given: object, n: int) -> FloatArray:
    """What a controller returned as commands, shape (n,), cut at ±1.

    Raises
    ------
    InvalidInput
        If it is not n finite numbers.
    """
    commands = as_finite("the controller's commands", given, (n,))  # type: ignore[arg-type]
    return frozen(np.clip(commands, -1.0, 1.0))
