"""States of the plant as the equations have them, and to and from :class:`PlantState`, bit for bit.

An absolute pressure p above half the atmosphere A is a multiple of its own rounding unit, and so is A, a whole number
of pascals: p - A and its way back are exact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.validation import FloatArray
from ...muscle.valve.flow import ATMOSPHERE
from .equations.plant_kernels import state_size
from .state import PlantState

if TYPE_CHECKING:
    from .plant_at_rest import PlantAtRest


class Snapshot(NamedTuple):
    """A state at a time in s: quaternion (4,), state of the equations with ξ = 0, and the rest as :class:`PlantState`.

    A run keeps one a sample: cheaper by far than the validated state.
    """

    time: float
    q: FloatArray
    y: FloatArray
    commands: FloatArray
    pulses: FloatArray
    step: float
    sensor: Any

    def state(self, motors: np.ndarray) -> PlantState:
        """The same as a state of a plant whose limbs have motors or not."""
        y, n = self.y, len(motors)
        drives = y[6 : 6 + n]
        return PlantState(
            time=self.time, quaternion=self.q, angular_velocity=y[3:6],
            pressures=np.where(motors, 0.0, drives - ATMOSPHERE), drive_positions=np.where(motors, drives, 0.0),
            drive_speeds=y[13 + 5 * n : 13 + 6 * n], drive_friction=y[6 + n : 6 + 2 * n],
            shoulder_friction=y[6 + 2 * n : 9 + 2 * n], supply_pressure=y[9 + 2 * n] - ATMOSPHERE,
            commands=self.commands, pulses=self.pulses,
            integrals=np.concatenate([y[10 + 2 * n : 13 + 5 * n], y[13 + 6 * n :]]), step=self.step,
            sensor=self.sensor,
        )  # fmt: skip


def equations_state(plant: PlantAtRest, state: PlantState) -> FloatArray:
    """The state of the equations, with ξ = 0."""
    n, y = plant.count, np.zeros(state_size(plant.count))
    y[3:6] = state.angular_velocity
    y[6 : 6 + n] = np.where(plant.motors, state.drive_positions, state.pressures + ATMOSPHERE)
    y[6 + n : 6 + 2 * n], y[6 + 2 * n : 9 + 2 * n] = state.drive_friction, state.shoulder_friction
    y[9 + 2 * n] = state.supply_pressure + ATMOSPHERE
    y[10 + 2 * n : 13 + 5 * n], y[13 + 6 * n :] = np.split(state.integrals, [3 * n + 3])
    y[13 + 5 * n : 13 + 6 * n] = np.where(plant.motors, state.drive_speeds, 0.0)
    return y
