"""Drives at rest: what they can pull at given lengths, and the states in which they hold given tensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ....core.validation import FloatArray, as_finite
from ..equations.pressure_kernels import pressures_for, static_tensions
from .motor_drive import MotorDrive

if TYPE_CHECKING:
    from ..plant_at_rest import PlantAtRest

__all__ = ["DriveStates", "drive_states", "force_limits"]


class DriveStates(NamedTuple):
    """States of n drives at rest.

    Attributes
    ----------
    pressures : ndarray
        Shape (n,), gauge, Pa; zero for motors.
    positions : ndarray
        Shape (n,), length that a motor drive lets out, m; zero for muscles.
    """

    pressures: FloatArray
    positions: FloatArray


def force_limits(plant: PlantAtRest, lengths: ArrayLike, slack: bool = False) -> tuple[FloatArray, FloatArray]:
    """Least and greatest tension at rest, shape (n,) each, N, at limb lengths (n,) in m.

    Of muscles those without air and at the supply's pressure; of motors those of the design. Cables are kept taut by
    the least tension of their drives if they can be, unless ``slack`` allows them to be without. Strokes do not count.
    """
    least, greatest, given = np.zeros(plant.count), np.zeros(plant.count), _each(plant, "lengths", lengths)
    if plant.supply is not None:
        static_tensions(plant.tables.law, plant.tables.muscles, given, 0.0, least)
        static_tensions(plant.tables.law, plant.tables.muscles, given, plant.supply.pressure, greatest)
    for i, drive in enumerate(plant.drives):
        if isinstance(drive, MotorDrive):
            least[i], greatest[i] = -drive.push_limit, drive.pull_limit
        greatest[i] = max(greatest[i], least[i])
        if drive.least_tension > 0.0 and not slack:
            least[i] = max(least[i], min(drive.least_tension, greatest[i]))
    return least, greatest


def drive_states(plant: PlantAtRest, lengths: ArrayLike, tensions: ArrayLike) -> DriveStates:
    """The states in which drives hold tensions (n,) in N at limb lengths (n,) in m, or pull no more than that."""
    pressures, positions = np.zeros(plant.count), np.zeros(plant.count)
    given, held = _each(plant, "lengths", lengths), _each(plant, "tensions", tensions)
    if plant.supply is not None:
        pressures_for(plant.tables.law, plant.tables.muscles, given, held, plant.supply.pressure, pressures)
    for i, drive in enumerate(plant.drives):
        if isinstance(drive, MotorDrive):
            pressures[i], positions[i] = 0.0, given[i] - held[i] / drive.stiffness
    return DriveStates(pressures, positions)


def _each(plant: PlantAtRest, name: str, values: ArrayLike) -> FloatArray:
    """One finite number a limb, as the kernels take them."""
    return np.array(as_finite(name, values, (plant.count,)))
