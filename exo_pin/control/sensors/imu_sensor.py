"""The inertial sensor in the loop: between the plant's exact measurement and the controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..plant.contraction import Contractions
from .imu import Imu, ImuSignal

if TYPE_CHECKING:
    from ...design import Mechanism
    from ..plant.state import Measurement


class ImuSensor(ImuSignal):
    """From time and exact measurement to the one that the controller gets.

    Parameters
    ----------
    imu : Imu
        The sensor and its errors.
    mechanism : Mechanism
        Whose lengths follow from the pose; strokes and end fittings known.
    """

    def __init__(self, imu: Imu, mechanism: Mechanism) -> None:
        super().__init__(imu)
        self._contractions = Contractions(mechanism)

    def __call__(self, t: float, measurement: Measurement) -> Measurement:
        """The measurement at a sample: pose as read and calibrated, and lengths that follow from it (Figure 5-8)."""
        reading = self.read(t, measurement.orientation, np.asarray(measurement.angular_velocity))
        lengths = self._contractions.lengths(reading.orientation)
        return measurement._replace(
            orientation=reading.orientation,
            angular_velocity=reading.angular_velocity,
            lengths=lengths,
            contraction_ratios=self._contractions.ratios(lengths),
            lost=reading.lost,
        )
