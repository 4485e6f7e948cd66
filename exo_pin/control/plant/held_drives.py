"""Drives at rest: what they can hold at given lengths, and their states where they hold it. Methods of a plant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...core.validation import FloatArray, as_finite
from .drives import DirectDrive, MotorDrive
from .equations.drive_kernels import pressures_for, static_tensions
from .state import DriveStates

if TYPE_CHECKING:
    from .plant import Plant


def force_limits(self: Plant, lengths: ArrayLike, slack: bool = False) -> tuple[FloatArray, FloatArray]:
    """Least and greatest tension at rest at limb lengths in m, shape (n,) each, N; strokes do not count.

    Of muscles those without air and at the supply's pressure; of motors those of the design. Cables are kept taut
    by the least tension of their drives if they can be, unless ``slack`` allows them to be without.

    Parameters
    ----------
    lengths : array_like
        Shape (n,), m.
    slack : bool
        Whether cables may be without tension.

    Returns
    -------
    tuple of ndarray
        Least and greatest, shape (n,), N.

    Raises
    ------
    InvalidInput
        If lengths are not finite, or not one a limb.

    Examples
    --------
    >>> exo = ep.load("three-linear-actuators")
    >>> least, greatest = ep.Plant(exo).force_limits(exo.inverse_kinematics(exo.pose(flexion=45)).lengths)
    >>> least, greatest  # N: these push as well
    (array([-400., -400., -400.]), array([400., 400., 400.]))
    """
    least, greatest, given = np.zeros(self.count), np.zeros(self.count), _each(self, "lengths", lengths)
    if self.supply is not None:
        static_tensions(self.tables.law, self.tables.muscles, given, 0.0, least)
        static_tensions(self.tables.law, self.tables.muscles, given, self.supply.pressure, greatest)
    for i, drive in enumerate(self.drives):
        if isinstance(drive, MotorDrive | DirectDrive):
            least[i], greatest[i] = drive.limits
        greatest[i] = max(greatest[i], least[i])
        if drive.least_tension > 0.0 and not slack:
            least[i] = max(least[i], min(drive.least_tension, greatest[i]))
    return least, greatest


def drive_states(self: Plant, lengths: ArrayLike, tensions: ArrayLike) -> DriveStates:
    """Pressures and positions of the drives that hold tensions in N at limb lengths in m, shape (n,) each.

    Drives that cannot pull as much pull no more than they can.

    Parameters
    ----------
    lengths : array_like
        Shape (n,), m.
    tensions : array_like
        Shape (n,), N.

    Returns
    -------
    DriveStates

    Raises
    ------
    InvalidInput
        If lengths or tensions are not finite, or not one a limb.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> plant = ep.Plant(exo)
    >>> lengths = exo.inverse_kinematics(exo.pose(abduction=30)).lengths
    >>> stretch = lengths - plant.drive_states(lengths, np.full(4, 20.0)).positions
    >>> (1e3 * stretch).round(2)  # mm, by 20 N in each cable
    array([0.37, 0.31, 0.34, 0.35])
    """
    pressures, positions = np.zeros(self.count), np.zeros(self.count)
    given, held = _each(self, "lengths", lengths), _each(self, "tensions", tensions)
    if self.supply is not None:
        pressures_for(self.tables.law, self.tables.muscles, given, held, self.supply.pressure, pressures)
    for i, drive in enumerate(self.drives):
        if isinstance(drive, MotorDrive | DirectDrive):
            # The play lies on the side of the effort.
            apart = held[i] / drive.stiffness + 0.5 * getattr(drive, "play", 0.0) * np.sign(held[i])
            pressures[i], positions[i] = 0.0, given[i] + (apart if drive.of_joint else -apart)
    return DriveStates(pressures, positions)


def _each(plant: Plant, name: str, values: ArrayLike) -> FloatArray:
    """One finite number a limb, as the kernels take them."""
    return np.array(as_finite(name, values, (plant.count,)))
