"""Commands of valves: the air that a tension needs, and how to bring it in time."""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray
from ...muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, ValveUnit, mass_flow
from ..plant.equations.muscle_kernels import air_volume, tension
from ..plant.plant import Plant


class ValveLoop:
    """The valves of a plant's muscles; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true.
    gain : float
        Share of time by which a valve is opened or closed more for a pressure that is 1 bar off.
    """

    def __init__(self, plant: Plant, gain: float) -> None:
        self._plant, self._gain, self._units = plant, gain, plant.units

    def air(self, tensions: FloatArray, lengths: FloatArray) -> FloatArray:
        """Air in one muscle of each limb that holds tensions in N at limb lengths in m, shape (n,), kg.

        Zero for motors.
        """
        tables, mass = self._plant.tables, np.zeros(len(lengths))
        pressures = self._plant.drive_states(lengths, tensions).pressures
        for i, unit in enumerate(self._units):
            if isinstance(unit, ValveUnit):
                row, gauge = tables.muscles[i], float(pressures[i])
                bladder = tension(tables.law, row, i, float(lengths[i]), 0.0, gauge, 0.0)[2]
                volume = air_volume(row, bladder)[0]
                mass[i] = (gauge + ATMOSPHERE) * volume / (GAS_CONSTANT * REFERENCE_TEMPERATURE)
        return mass

    def commands(
        self, tensions: FloatArray, lengths: FloatArray, measured: FloatArray, flows: FloatArray | None = None
    ) -> FloatArray:
        """Commands, shape (n,), zero for motors.

        Parameters
        ----------
        tensions, lengths : ndarray
            Wanted, N, and of the limbs, m, shape (n,).
        measured : ndarray
            Gauge pressures, shape (n,), Pa.
        flows : ndarray, optional
            That each muscle is going to need, shape (n,), kg/s.
        """
        commands, supply = np.zeros(len(lengths)), self._plant.supply
        if supply is None:
            return commands
        wanted = self._plant.drive_states(lengths, tensions).pressures
        for i, valves in enumerate(self._units):
            if not isinstance(valves, ValveUnit):
                continue
            commands[i] = self._gain * (wanted[i] - measured[i]) / 1e5
            need = 0.0 if flows is None else float(flows[i])
            inflow, outflow = _flows(valves, supply.absolute, wanted[i] + ATMOSPHERE)
            if valves.layout == "3/2":
                total = inflow + outflow
                commands[i] = 2.0 * (commands[i] + ((need + outflow) / total if total > 0.0 else 0.0)) - 1.0
            elif need > 0.0 < inflow:
                commands[i] += need / inflow
            elif need < 0.0 < outflow:
                commands[i] += need / outflow
        return commands


def _flows(valves: ValveUnit, supply: float, p: float) -> tuple[float, float]:
    """Flows of the open fill path and the open vent path at an absolute pressure of the muscle, kg/s."""
    fill, vent = valves.paths
    return (
        mass_flow(supply, p, fill.conductance, fill.critical_ratio),
        mass_flow(p, ATMOSPHERE, vent.conductance, vent.critical_ratio),
    )
