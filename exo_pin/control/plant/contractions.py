"""Lengths of the limbs, contraction ratios of muscles (5-4), and drives at rest: what they hold at which lengths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import MissingData
from ...core.validation import FloatArray, as_finite, as_rotation, require_type
from ...design import Mechanism
from .drives import DirectDrive, MotorDrive
from .equations.drive_kernels import pressures_for, static_tensions
from .state import DriveStates

if TYPE_CHECKING:
    from .plant import Plant


def contractions_of(given: Any) -> Any:
    """Contractions of a plant as they are given, or those of a design."""
    return given if hasattr(given, "ratios") else Contractions(given)


class Contractions:
    """Contraction ratios of the muscles of a design.

    Parameters
    ----------
    mechanism : Mechanism
        Every limb with a stroke and its end fitting.

    Attributes
    ----------
    nominal, fittings : ndarray
        l_0 and e, shape (n,), m.

    Raises
    ------
    MissingData
        If a stroke or an end fitting is not known.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        require_type("mechanism", mechanism, Mechanism, "a Mechanism")
        spans, lacking = [], []
        for i, limb in enumerate(mechanism.limbs, 1):
            stroke, tackle = limb.stroke, None if limb.actuator is None else limb.actuator.tackle
            if stroke is None or stroke.end_fitting is None:
                lacking.append(f"stroke with end_fitting of limb {i}")
            elif tackle is None:
                spans.append((stroke.nominal_length + stroke.end_fitting, stroke.nominal_length))
            else:
                longest = stroke.nominal_length * stroke.longest + stroke.end_fitting
                spans.append((longest, tackle.ratio * tackle.muscle_length))
        if lacking:
            raise MissingData(lacking, "a contraction ratio", mechanism.name)
        self._uncontracted, self.nominal = np.array(spans).T
        self.fittings = self._uncontracted - self.nominal
        self._base = np.array(mechanism.geometry.base_points)
        self._platform = np.array(mechanism.geometry.platform_points)

    def lengths(self, poses: Rotation) -> FloatArray:
        """Limb lengths, shape (..., n), m, of poses of shape (...).

        Parameters
        ----------
        poses : Rotation
            Shape (...).

        Returns
        -------
        ndarray
            Shape (..., n), m.
        """
        matrices = as_rotation("poses", poses).as_matrix()
        turned = self._platform @ np.swapaxes(matrices, -1, -2)
        return np.asarray(np.linalg.norm(turned - self._base, axis=-1))

    def ratios(self, lengths: ArrayLike) -> FloatArray:
        """Contraction ratios, shape (..., n), of limb lengths in m; below zero where a muscle would be stretched.

        Parameters
        ----------
        lengths : array_like
            Shape (..., n), m.

        Returns
        -------
        ndarray
            Shape (..., n).
        """
        given = as_finite("lengths", lengths, (len(self.nominal),), stack=True)
        return np.asarray((self._uncontracted - given) / self.nominal)


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
