"""State of the plant, what sensors report of it, and what a controller is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_single_rotation

__all__ = ["Controller", "Measurement", "PlantState", "Sensor"]


class Measurement(NamedTuple):
    """What sensors report at one instant; exact, until a sensor of one's own spoils it.

    Attributes
    ----------
    orientation : Rotation
        Of the arm, {O_B} to {O_A}.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame.
    pressures : ndarray
        Shape (n,), gauge, Pa.
    supply_pressure : float
        Of the manifold, gauge, Pa.
    lengths : ndarray
        Shape (n,), of the limbs between joint centres, m.
    contraction_ratios : ndarray
        Shape (n,), (L_0 - muscle length)/L_0 (5-4), where the muscle length is the limb's less its end fitting. A
        muscle that hangs in a bow is longer than this says. With a tackle or a motor: by how much the limb is shorter
        than at its longest, over the nominal length of its muscle times the ratio, or of its stroke.
    drive_positions, drive_speeds : ndarray or None
        Shape (n,), length that each motor drive lets out, m, and its rate, m/s, as an encoder of the motor reports
        them; zero for muscles. None where they are not measured.
    lost : bool
        Whether the pose is an old one, because its sensor has no reading now.
    """

    orientation: Rotation
    angular_velocity: FloatArray
    pressures: FloatArray
    supply_pressure: float
    lengths: FloatArray
    contraction_ratios: FloatArray
    drive_positions: FloatArray | None = None
    drive_speeds: FloatArray | None = None
    lost: bool = False


#: From time in s and measurement to commands of the drives, shape (n,), -1 to 1.
Controller = Callable[[float, Measurement], ArrayLike]
#: From time in s and exact measurement to the one that the controller gets.
Sensor = Callable[[float, Measurement], Measurement]


@dataclass(frozen=True, eq=False)
class PlantState(Record):
    """State of the plant at one instant.

    Attributes
    ----------
    orientation : Rotation
        Single, {O_B} to {O_A}.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame.
    pressures : ndarray
        Shape (n,), gauge, Pa; zero for limbs with a motor.
    drive_positions, drive_speeds : ndarray
        Shape (n,), length that each motor drive lets out, m, and its rate, m/s; zero for muscles.
    """

    orientation: Rotation
    angular_velocity: FloatArray
    pressures: FloatArray
    drive_positions: FloatArray | None = None
    drive_speeds: FloatArray | None = None

    def __post_init__(self) -> None:
        as_single_rotation("orientation", self.orientation)
        object.__setattr__(self, "angular_velocity", as_finite("angular_velocity", self.angular_velocity, (3,)))
        pressures = as_finite("pressures", self.pressures, (None,))
        if (pressures < 0.0).any():
            raise InvalidInput(f"expected gauge pressures of zero or more, in Pa, got {pressures}")
        object.__setattr__(self, "pressures", pressures)
        for name in ("drive_positions", "drive_speeds"):
            given = np.zeros(len(pressures)) if getattr(self, name) is None else getattr(self, name)
            object.__setattr__(self, name, as_finite(name, given, (len(pressures),)))
