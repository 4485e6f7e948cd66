"""The plant in time: from instant to instant at which the controller, a fault or a sample asks for a stop.

Between two stops a schedule says what acts on the drives: paths of the valves, at exact switching times, and forces of
the motors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from traceback import format_exception_only
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, SolverFailed
from ...core.errors.base import shown
from ...core.progress import track
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive, frozen
from ...muscle.valve.flow import ValveUnit
from .any_device.device_motion import DeviceMotion, Piece, observed
from .drives import DirectDrive, MotorDrive
from .equations.drive_kernels import FLOWS
from .equations.plant_kernels import DONE, TOO_SMALL, advance, observe, tolerances
from .faults import Fault
from .run import Run
from .state import Controller, Measurement, PlantState, Sensor, Snapshot, equations_state, state_values

if TYPE_CHECKING:
    from .plant import Plant

#: Two instants nearer than this, s, are one.
SAME = 1e-9
#: What a jammed drive withstands, over its own limit.
_JAMMED = 5.0
_INTACT, _EFFORT, _POWERED, _BRAKE = (FLOWS.index(name) for name in ("intact", "effort", "powered", "brake"))


@dataclass
class DriveSchedule(Record):
    """Valves and motors of n limbs, driven by commands.

    Attributes
    ----------
    units : tuple of ValveUnit, MotorDrive or DirectDrive
        One a limb.
    faults : tuple of Fault
    commands : ndarray
        Shape (n,), the last commands, -1 to 1.
    """

    units: tuple[ValveUnit | MotorDrive | DirectDrive, ...]
    faults: tuple[Fault, ...] = ()
    commands: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.units)
        self.commands = np.array([-1.0 if isinstance(unit, ValveUnit) else 0.0 for unit in self.units])
        self._period = np.full(count, -1)
        self._shares = np.zeros((count, 2))

    @property
    def pulses(self) -> FloatArray:
        """Number of the period that runs and its shares of filling and venting, shape (n, 3)."""
        return np.column_stack([self._period, self._shares])

    def resume(self, commands: FloatArray, pulses: FloatArray) -> None:
        """Go on with commands, shape (n,), and :attr:`pulses`."""
        self.commands, self._period, self._shares = commands, pulses[:, 0].astype(int), pulses[:, 1:].copy()

    def _valves(self) -> Iterator[tuple[int, ValveUnit]]:
        return ((i, unit) for i, unit in enumerate(self.units) if isinstance(unit, ValveUnit))

    def _stuck(self, i: int, time: float) -> Fault | None:
        """What keeps the valve of a limb from obeying, if something does."""
        stuck = (fault for fault in self.faults if fault.limb == i and fault.kind == "stuck valve")
        return next((fault for fault in stuck if fault.acts(time + SAME)), None)

    def start(self, time: float) -> None:
        """Take over the commands where a period of the pulses begins at ``time``."""
        for i, unit in self._valves():
            period = int(np.floor((time + SAME) * unit.frequency))
            stuck = self._stuck(i, time)
            if period != self._period[i] or stuck is not None:
                self._shares[i] = unit.shares(float(self.commands[i]) if stuck is None else stuck.command)
            self._period[i] = period

    def next_switch(self, time: float) -> float:
        """The next instant after ``time`` at which a valve opens or closes or a period begins, s."""
        valves = [(self._period[i] / unit.frequency, self._switch(i), unit.frequency) for i, unit in self._valves()]
        instants = (begin + place / rate for begin, switch, rate in valves for place in (switch, 1.0))
        return min((instant for instant in instants if instant > time + SAME), default=np.inf)

    def _switch(self, i: int) -> float:
        """Share of the period at which the valve that opened at its start closes."""
        fill, vent = self._shares[i]
        return float(fill if fill > 0.0 else vent)

    def pieces(self, start: float, end: float) -> list[Piece]:
        """The time between two instants, cut where valves switch."""
        found: list[Piece] = []
        time = start
        while True:
            flows = self.flows(time)
            switch = min(self.next_switch(time), end)
            if end - switch < SAME:
                return [*found, Piece(time, end, flows)]
            found.append(Piece(time, switch, flows))
            self.start(switch)
            time = switch

    def flows(self, time: float) -> FloatArray:
        """What acts just after ``time``, shape (n, len(FLOWS)), as the equations read it."""
        table = np.zeros((len(self.units), len(FLOWS)))
        table[:, _INTACT] = table[:, _POWERED] = 1.0
        for i, unit in enumerate(self.units):
            if not isinstance(unit, ValveUnit):
                command = float(self.commands[i])
                table[i, _EFFORT], table[i, _BRAKE] = unit.demand(command), unit.holding(command)
                continue
            fill, vent = unit.paths
            table[i, :4] = fill.conductance, fill.critical_ratio, vent.conductance, vent.critical_ratio
            table[i, [0, 2]] *= self._open(i, unit, time)
        for fault in self.faults:
            if fault.acts(time + SAME):
                self._spoil(table[fault.limb], fault)
        return table

    def _spoil(self, row: FloatArray, fault: Fault) -> None:
        """Put a fault into the row of its limb."""
        unit, hole = self.units[fault.limb], fault.hole
        if hole is not None:
            row[4:6] = hole.conductance, hole.critical_ratio
        if fault.kind == "torn":
            row[_INTACT] = 0.0
        elif isinstance(unit, ValveUnit) or fault.kind == "encoder loss":
            return
        elif fault.kind == "supply drop":
            row[_EFFORT] *= fault.share
        elif fault.kind == "jam":
            row[_BRAKE] = _JAMMED * max(unit.force_limit, unit.brake_force)
        else:
            row[_POWERED] = 0.0
            row[_BRAKE] = unit.brake_force if fault.brake_force is None else fault.brake_force

    def _open(self, i: int, unit: ValveUnit, time: float) -> tuple[float, float]:
        """How far fill and vent path are open, 0 to 1 each."""
        fill, vent = self._shares[i]
        place = (time + SAME) * unit.frequency - self._period[i]
        before = place < self._switch(i)
        fills = fill > 0.0 and (before or fill >= 1.0)
        return float(fills), float(not fills if unit.layout == "3/2" else vent > 0.0 and before)


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


def run_instants(
    start: float, end: float, control_rate: float, sample_rate: float, sudden: Sequence[Any]
) -> list[RunInstant]:
    """Those that are known beforehand, from a start to an end, s, at rates in Hz.

    They are those of controller and samples, and those at which something, such as a fault, begins or ends.
    """
    for name, rate in (("control_rate", control_rate), ("sample_rate", sample_rate)):
        if (end - start) * rate > _MOST_INSTANTS:
            raise InvalidInput(
                f"expected {name} in Hz for at most {_MOST_INSTANTS} instants in {end - start:g} s, got {rate:g}"
            )
    # Multiples of each period.
    controls, samples = (
        np.arange(int(np.ceil((start - SAME) * rate)), int(np.floor((end + SAME) * rate)) + 1) / rate
        for rate in (control_rate, sample_rate)
    )
    events = [t for t in events_of(sudden) if start < t < end]
    # Start and end are samples; the controller is not called at the end any more.
    samples = np.concatenate([[start], samples, [end]])
    fixed = np.unique(np.concatenate([controls, samples, events]))
    fixed = fixed[np.append(True, np.diff(fixed) > SAME)]
    controlled = _among(fixed, controls) & (fixed < end - SAME)
    each = zip(fixed.tolist(), _among(fixed, samples).tolist(), controlled.tolist(), strict=True)
    return [RunInstant(*one) for one in each]


def events_of(sudden: Sequence[Any]) -> list[float]:
    """When faults, payloads and pushes begin and end, s; a wearer's moment without these goes on smoothly."""
    ends = (getattr(each, name, np.inf) for each in sudden for name in ("start", "end"))
    return [float(time) for time in ends if np.isfinite(time)]


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


#: What :func:`observe` reports of limbs and shoulder, in its order.
_OF_LIMBS = ("lengths", "length_rates", "tensions", "bladder_contractions", "motor_forces", "stored_energy")
_OF_SHOULDER = ("angular_acceleration", "friction_moment", "stop_moment")


class MinimalMotion:
    """A plant at one instant, which can be moved on, by closed forms; limbs are massless.

    Attributes
    ----------
    chain : ndarray
        Empty; see :attr:`.PlantState.chain`.
    q, y : ndarray
        Quaternion (4,), and state of the equations with ξ = 0.
    step, steps : float, int
        The step tried next, s, and the steps taken.
    """

    def __init__(self, plant: Plant, start: PlantState, rtol: float) -> None:
        self._tables, self._rtol, self._atol = plant.tables, rtol, tolerances(plant.tables, rtol)
        self.q, self.y, self.step = start.quaternion.copy(), equations_state(start, plant.motors), start.step
        self.steps, self.chain, self._lengths = 0, np.zeros(0), plant.contractions.lengths

    def kinematics(self) -> tuple[FloatArray, FloatArray]:
        """Quaternion and state of the equations, with ξ = 0."""
        return self.q, self.y

    def lengths(self) -> FloatArray:
        """Of the limbs, shape (n,), m."""
        return self._lengths(Rotation.from_quat(self.q))

    def advance(self, pieces: list[Piece]) -> str:
        """Move on through some pieces of time; return when and why that did not succeed, or nothing."""
        for piece in pieces:
            ended, taken, self.step, left = advance(
                self._tables, piece.flows, self.q, self.y, piece.end - piece.start, self.step, self._rtol, self._atol
            )
            self.steps += taken
            if ended != DONE:
                reason = "steps would have to be too small" if ended == TOO_SMALL else "the motion is not finite"
                return f"stopped at {piece.end - left:.6g} s: {reason}"
        return ""


class PlantSimulation:
    """A plant under a controller from a start on: its motion, its drives, and their record.

    Attributes
    ----------
    motion : MinimalMotion or DeviceMotion
        What moves the plant on; any object with its methods does.
    """

    def __init__(
        self,
        plant: Plant,
        controller: Controller,
        instants: Sequence[RunInstant],
        start: PlantState,
        faults: tuple[Fault, ...],
        sensor: Sensor | None,
        rtol: float,
    ) -> None:
        if as_positive("rtol", rtol) > _LOOSEST:
            raise InvalidInput(f"expected rtol as a relative tolerance of at most {_LOOSEST:g}, got {rtol:g}")
        kind = MinimalMotion if plant.equations is None else DeviceMotion
        self.motion: MinimalMotion | DeviceMotion = kind(plant, start, float(rtol))
        self._plant, self._controller, self._instants, self._sensor = plant, controller, instants, sensor
        self._schedule = DriveSchedule(plant.units, faults)
        self._schedule.resume(start.commands, start.pulses)
        recall = getattr(sensor, "recall", None)
        if start.sensor is not None and recall is not None:
            recall(start.sensor)
        self._record: list[tuple[Snapshot, FloatArray, FloatArray]] = []

    def go(self, progress: bool = False) -> str:
        """Move from the first instant to the last, and return the status."""
        before = None
        for instant in track(self._instants, "simulating", progress):
            if before is not None:
                stopped = self.motion.advance(self._schedule.pieces(before, instant.time))
                if stopped:
                    return stopped
            wrong = self._at(instant)
            if wrong and before is None:
                raise InvalidInput(wrong)
            if wrong:
                return f"stopped at {instant.time:.6g} s: {wrong}"
            before = instant.time
        return "completed"

    def _at(self, instant: RunInstant) -> str:
        """Call the controller and record where that is due; return what was wrong with the controller, or nothing."""
        time, schedule = instant.time, self._schedule
        q, y = self.motion.kinematics()
        now = None
        if instant.sample or instant.control:
            memory = getattr(self._sensor, "memory", None)
            commands = schedule.commands.copy()
            now = Snapshot(time, q.copy(), y.copy(), commands, schedule.pulses, self.motion.step, self.motion.chain,
                           memory)  # fmt: skip
        wrong = self._command(time, q, y) if instant.control else ""
        schedule.start(time)
        if now is not None and (instant.sample or wrong):
            self._record.append((now, schedule.commands.copy(), schedule.flows(time)))
        return wrong

    def _command(self, time: float, q: FloatArray, y: FloatArray) -> str:
        """Call the controller; return what was wrong with it, or nothing."""
        seen = self._measured(time, q, y)
        who = "sensor"
        try:
            if self._sensor is not None:
                seen = self._sensor(time, seen)
            who = "controller"
            commands: ArrayLike = self._controller(time, seen)
        except Exception as error:
            # It copes with errors that cannot be printed.
            return shown(f"the {who} raised {format_exception_only(error)[-1].strip()}")
        try:
            valid = as_finite("the controller's commands", commands, (self._plant.count,))
        except InvalidInput as error:
            return str(error)
        self._schedule.commands = frozen(np.clip(valid, -1.0, 1.0))
        return ""

    def _measured(self, time: float, q: FloatArray, y: FloatArray) -> Measurement:
        """What exact sensors report; an encoder that is lost reads zero."""
        contractions, values = self._plant.contractions, state_values(y, self._plant.motors)
        lengths, positions, speeds = self.motion.lengths(), values["drive_positions"], values["drive_speeds"].copy()
        faulty = np.zeros(self._plant.count, dtype=bool)
        for fault in self._schedule.faults:
            faulty[fault.limb] |= fault.is_reported(time + SAME)
            if fault.kind == "encoder loss" and fault.acts(time + SAME):
                positions[fault.limb] = speeds[fault.limb] = 0.0
        return Measurement(
            Rotation.from_quat(q),
            values["angular_velocity"].copy(),
            values["pressures"],
            float(values["supply_pressure"]),
            lengths,
            contractions.ratios(lengths),
            positions,
            speeds,
            faulty=faulty,
        )

    def run(self, progress: bool = False) -> Run:
        """See :meth:`exo_pin.control.plant.plant.Plant.simulate`."""
        status = self.go(progress)
        return recorded(self._plant, self._record, status, self.motion.steps)

    def stepped(self) -> PlantState:
        """See :meth:`exo_pin.control.plant.plant.Plant.step`."""
        status = self.go()
        if status != "completed":
            raise SolverFailed("step of the plant", float("inf"), status)
        return self._record[-1][0].state(self._plant.motors)


def recorded(plant: Plant, record: Sequence[tuple[Snapshot, FloatArray, FloatArray]], status: str, steps: int) -> Run:
    """The record of a motion, from a state at each instant, and the commands and flows from then on."""
    snapshots, commands, flows = zip(*record, strict=True)
    count, n = len(record), plant.count
    Q, Y = np.array([each.q for each in snapshots]), np.array([each.y for each in snapshots])
    motion, limbs, energy = np.zeros((count, 9)), np.zeros((count, n, 6)), np.zeros((count, 2))
    more, acts = np.zeros((count, 9)), np.array(flows)
    if plant.equations is None:
        observe(Q, Y, acts[..., 6:].copy(), plant.tables, motion, limbs, energy)
    else:
        more = observed(plant.equations, snapshots, acts, (motion, limbs, energy))
    values = state_values(Y, plant.motors)
    for name in ("turn", "drive_friction", "shoulder_friction"):
        del values[name]
    values |= {name: values[name][:, 0] for name in ("shoulder_loss", "air_used", "air_vented")}
    values |= zip(_OF_LIMBS, np.moveaxis(limbs, -1, 0), strict=True)
    values |= zip(_OF_SHOULDER, np.split(motion, 3, axis=1), strict=True)
    values |= {"kinetic_energy": energy[:, 0], "potential_energy": energy[:, 1], "commands": np.array(commands)}
    values |= {"wearer_force": more[:, :3], "wearer_moment": more[:, 3:6], "link_force": more[:, 6:],
               "chain": np.array([each.chain for each in snapshots])}  # fmt: skip
    own = {name: np.array(each) for name, each in values.items()}
    times, turns = np.array([each.time for each in snapshots]), Rotation.from_quat(Q)
    return Run(plant=plant, times=times, rotations=turns, status=status, steps=steps, snapshots=snapshots, **own)
