"""The inertial sensor in the loop: between the plant's exact measurement and the controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..plant.contraction import Contractions
from .imu import Imu, ImuSignal

if TYPE_CHECKING:
    from ...design import Mechanism
    from ..plant.state import Measurement

__all__ = ["ImuSensor"]


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

    @property
    def memory(self) -> Any:
        """What later readings depend on, as a state of the plant holds it."""
        return self._signal.memory

    def recall(self, memory: Any) -> None:
        """Go on from a :attr:`memory`."""
        self._signal.recall(memory)

    def __call__(self, t: float, measurement: Measurement) -> Measurement:
        """The measurement at a sample: pose as read and calibrated, and lengths that follow from it (Figure 5-8)."""
        reading = self._signal.read(t, measurement.orientation, np.asarray(measurement.angular_velocity))
        lengths = self._contractions.lengths(reading.orientation)
        return measurement._replace(
            orientation=reading.orientation,
            angular_velocity=reading.angular_velocity,
            lengths=lengths,
            contraction_ratios=self._contractions.ratios(lengths),
            lost=reading.lost,
        )
