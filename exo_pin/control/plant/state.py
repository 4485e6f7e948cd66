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
from ...core.validation import FloatArray, as_finite, as_rotation

__all__ = ["Controller", "Measurement", "PlantState", "Sensor", "as_orientation", "require_functions"]


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
    """

    orientation: Rotation
    angular_velocity: FloatArray
    pressures: FloatArray
    supply_pressure: float
    lengths: FloatArray
    contraction_ratios: FloatArray
    drive_positions: FloatArray | None = None
    drive_speeds: FloatArray | None = None


#: From time in s and measurement to commands of the drives, shape (n,), -1 to 1.
Controller = Callable[[float, Measurement], ArrayLike]
#: From time in s and exact measurement to the one that the controller gets.
Sensor = Callable[[float, Measurement], Measurement]


def as_orientation(given: Rotation) -> Rotation:
    """A single orientation.

    Raises
    ------
    InvalidInput
        If it is none, or a stack.
    """
    if as_rotation("orientation", given).shape != ():
        raise InvalidInput(f"expected a single orientation, got a stack of shape {given.shape}")
    return given


def require_functions(controller: object, sensor: object) -> None:
    """Check that controller and sensor, if there is one, can be called.

    Raises
    ------
    InvalidInput
        If one cannot.
    """
    if not callable(controller):
        raise InvalidInput(f"expected a controller, a function (t, measurement) -> commands, got {controller!r:.60}")
    if sensor is not None and not callable(sensor):
        raise InvalidInput(f"expected a sensor, a function (t, measurement) -> measurement, got {sensor!r:.60}")


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
        as_orientation(self.orientation)
        object.__setattr__(self, "angular_velocity", as_finite("angular_velocity", self.angular_velocity, (3,)))
        pressures = as_finite("pressures", self.pressures, (None,))
        if (pressures < 0.0).any():
            raise InvalidInput(f"expected gauge pressures of zero or more, in Pa, got {pressures}")
        object.__setattr__(self, "pressures", pressures)
        for name in ("drive_positions", "drive_speeds"):
            given = np.zeros(len(pressures)) if getattr(self, name) is None else getattr(self, name)
            object.__setattr__(self, name, as_finite(name, given, (len(pressures),)))
