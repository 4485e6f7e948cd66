"""The inertial sensor in the loop: between the plant's exact measurement and the controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray
from ..controllers.contraction import Contractions
from .imu import Imu, ImuSignal

if TYPE_CHECKING:
    from ...design import Mechanism
    from ..plant.state import Measurement

__all__ = ["ImuSensor", "SensedPose"]


class SensedPose(NamedTuple):
    """A measurement whose pose comes from an inertial sensor; the fields of :class:`exo_pin.control.Measurement`.

    Attributes
    ----------
    orientation : Rotation
        Single, {O_B} to {O_A}, as read and calibrated.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame, as read.
    pressures : ndarray
        Shape (n,), gauge, Pa.
    supply_pressure : float
        Gauge, Pa.
    lengths : ndarray
        Shape (n,), m: by inverse kinematics from the pose that was read, as in Figure 5-8.
    contraction_ratios : ndarray
        Shape (n,), (5-4), of these lengths.
    drive_positions, drive_speeds : ndarray or None
        Shape (n,), m and m/s, of motor drives, from their own encoders: as in the exact measurement.
    lost : bool
        Whether there is no reading and the pose is an old one.
    """

    orientation: Rotation
    angular_velocity: FloatArray
    pressures: FloatArray
    supply_pressure: float
    lengths: FloatArray
    contraction_ratios: FloatArray
    drive_positions: FloatArray | None
    drive_speeds: FloatArray | None
    lost: bool


class ImuSensor:
    """From time and exact measurement to the one that the controller gets.

    Parameters
    ----------
    imu : Imu
        The sensor and its errors.
    mechanism : Mechanism
        Whose lengths follow from the pose; strokes and end fittings known.
    """

    def __init__(self, imu: Imu, mechanism: Mechanism) -> None:
        self._signal, self._contractions = ImuSignal(imu), Contractions(mechanism)

    def reset(self) -> None:
        """Start again, with the same noise."""
        self._signal.reset()

    def __call__(self, t: float, measurement: Measurement) -> SensedPose:
        """The measurement at a sample."""
        reading = self._signal.read(t, measurement.orientation, np.asarray(measurement.angular_velocity))
        lengths = self._contractions.lengths(reading.orientation)
        return SensedPose(
            reading.orientation,
            reading.angular_velocity,
            measurement.pressures,
            measurement.supply_pressure,
            lengths,
            self._contractions.ratios(lengths),
            measurement.drive_positions,
            measurement.drive_speeds,
            reading.lost,
        )
