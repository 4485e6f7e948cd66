"""What acts on the drives in time: paths of the valves, at exact switching times, and forces of the motors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ....core.records import Record
from ....core.validation import FloatArray
from ....muscle.valve.flow import ValveUnit
from ..drives import MotorDrive
from ..equations.drive_kernels import FLOWS
from ..faults import Fault

#: Two instants nearer than this, s, are one.
SAME = 1e-9
_INTACT, _EFFORT, _POWERED, _BRAKE = (FLOWS.index(name) for name in ("intact", "effort", "powered", "brake"))


class Piece(NamedTuple):
    """A time in which no valve switches: its ends, s, and the flows, as the equations read them."""

    start: float
    end: float
    flows: FloatArray


@dataclass
class DriveSchedule(Record):
    """Valves and motors of n limbs, driven by commands.

    Attributes
    ----------
    units : tuple of ValveUnit or MotorDrive
        One a limb.
    faults : tuple of Fault
    commands : ndarray
        Shape (n,), the last commands, -1 to 1.
    """

    units: tuple[ValveUnit | MotorDrive, ...]
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
        """Take over the commands where a period of the pulses begins at ``time``, or pulses do not matter."""
        for i, unit in self._valves():
            period = int(np.floor((time + SAME) * unit.frequency))
            stuck = self._stuck(i, time)
            if unit.modulation == "averaged" or period != self._period[i] or stuck is not None:
                self._shares[i] = unit.shares(float(self.commands[i]) if stuck is None else stuck.command)
            self._period[i] = period

    def next_switch(self, time: float) -> float:
        """The next instant after ``time`` at which a valve opens or closes or a period begins, s."""
        following = np.inf
        for i, unit in self._valves():
            if unit.modulation == "averaged":
                continue
            begin = self._period[i] / unit.frequency
            for place in (self._switch(i), 1.0):
                instant = begin + place / unit.frequency
                if instant > time + SAME:
                    following = min(following, instant)
                    break
        return following

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
            if isinstance(unit, MotorDrive):
                table[i, _EFFORT] = unit.force_limit * self.commands[i]
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
        elif isinstance(unit, MotorDrive):
            row[_POWERED] = 0.0
            row[_BRAKE] = unit.parameters.brake_force if fault.brake_force is None else fault.brake_force

    def _open(self, i: int, unit: ValveUnit, time: float) -> tuple[float, float]:
        """How far fill and vent path are open, 0 to 1 each."""
        fill, vent = self._shares[i]
        if unit.modulation == "averaged":
            return float(fill), float(vent)
        place = (time + SAME) * unit.frequency - self._period[i]
        before = place < self._switch(i)
        if unit.layout == "3/2":
            filling = fill > 0.0 and (before or fill >= 1.0)
            return float(filling), float(not filling)
        return float(fill > 0.0 and before), float(vent > 0.0 and before)
