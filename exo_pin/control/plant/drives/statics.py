"""Drives at rest: what they can pull at given lengths, and the states in which they hold given tensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ....core.validation import FloatArray, as_finite
from ....muscle.valve.supply import Supply
from ..equations.plant_kernels import Tables
from ..equations.pressure_kernels import pressures_for, static_tensions
from .drive import Drive
from .motor_drive import MotorDrive

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


def force_limits(
    drives: Sequence[Drive], tables: Tables, supply: Supply | None, lengths: ArrayLike, slack: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Least and greatest tension at rest, shape (n,) each, N, at limb lengths (n,) in m.

    Of muscles those without air and at the supply's pressure; of motors those of the design. Cables are kept taut by
    the least tension of their drives if they can be, unless ``slack`` allows them to be without. Strokes do not count.
    """
    least, greatest, given = np.zeros(len(drives)), np.zeros(len(drives)), _each(drives, "lengths", lengths)
    if supply is not None:
        static_tensions(tables.law, tables.muscles, given, 0.0, least)
        static_tensions(tables.law, tables.muscles, given, supply.pressure, greatest)
    for i, drive in enumerate(drives):
        if isinstance(drive, MotorDrive):
            least[i], greatest[i] = -drive.push_limit, drive.pull_limit
        greatest[i] = max(greatest[i], least[i])
        if drive.least_tension > 0.0 and not slack:
            least[i] = max(least[i], min(drive.least_tension, greatest[i]))
    return least, greatest


def drive_states(
    drives: Sequence[Drive], tables: Tables, supply: Supply | None, lengths: ArrayLike, tensions: ArrayLike
) -> DriveStates:
    """The states in which drives hold tensions (n,) in N at limb lengths (n,) in m, or pull no more than that."""
    pressures, positions = np.zeros(len(drives)), np.zeros(len(drives))
    given, held = _each(drives, "lengths", lengths), _each(drives, "tensions", tensions)
    if supply is not None:
        pressures_for(tables.law, tables.muscles, given, held, supply.pressure, pressures)
    for i, drive in enumerate(drives):
        if isinstance(drive, MotorDrive):
            pressures[i], positions[i] = 0.0, given[i] - held[i] / drive.stiffness
    return DriveStates(pressures, positions)


def _each(drives: Sequence[Drive], name: str, values: ArrayLike) -> FloatArray:
    """One finite number a limb, as the kernels take them."""
    return np.array(as_finite(name, values, (len(drives),)))
