"""PI control of the lengths of motor drives: the simple controller of winches and linear actuators.

Wanted pose -> inverse kinematics -> wanted length l of each limb. The motor gets

    F = K (e + (1/T_i) ∫ e dt) + D (s' - l')        e = s - (l - f_0/k)

with s and s' of the motor's encoder, l' the wanted rate, and f_0 the tension by whose stretch a cable is kept shorter
than its limb. K = m Ω² and D = 2 m Ω with m the drive's mass along the limb. It knows nothing of the arm: the weight is
left to the integral. The integral has back-calculation with T_t = T_i.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.fields import set_positive
from ...core.validation import FloatArray, as_positive, require_type
from ..arguments import require_callable
from ..plant.plant import Plant
from .motor_loop import MotorLoop, length_motion, measured_drives


@dataclass(frozen=True)
class LengthGains:
    """Gains of the PI control of lengths.

    Attributes
    ----------
    bandwidth : float
        Ω, rad/s; at 100 samples a second not much above the default.
    integral_time : float
        T_i, s.
    tension : float
        f_0 of cables, N.
    """

    bandwidth: float = 35.0
    integral_time: float = 0.3
    tension: float = 20.0

    def __post_init__(self) -> None:
        set_positive(self, "bandwidth", "integral_time")
        set_positive(self, "tension", zero=True)


class LengthController:
    """PI control of lengths; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true, with motors in all limbs.
    reference : callable
        ``reference(t)`` has ``orientation``, ``angular_velocity`` and ``angular_acceleration``.
    gains : LengthGains, optional
        Of all drives.
    rate : float
        Samples a second, Hz.

    Raises
    ------
    InvalidInput
        If a limb has no motor, the reference cannot be called, or plant or gains have a wrong type.
    """

    def __init__(
        self, plant: Plant, reference: Callable[[float], Any], gains: LengthGains | None = None, rate: float = 100.0
    ) -> None:
        require_type("plant", plant, Plant, "a Plant")
        require_type("gains", gains, LengthGains | None, "LengthGains")
        require_callable(reference, "a reference that can be called")
        if not plant.motors.all():
            raise InvalidInput("expected a motor in every limb; muscles have the controller of contraction ratios")
        self.plant, self.reference = plant, reference
        self.gains = LengthGains() if gains is None else gains
        self._interval = 1.0 / as_positive("rate", rate)
        self._loop = MotorLoop(plant.drives, self.gains.bandwidth)
        taut = np.array([drive.least_tension > 0.0 for drive in plant.drives])
        self._shorter = np.where(taut, self.gains.tension / self._loop.stiffness, 0.0)
        self.reset()

    def reset(self) -> None:
        """Integrals to zero; at the first sample they take what the drives hold."""
        self._integral: FloatArray | None = None

    def __call__(self, t: float, measurement: Any) -> FloatArray:
        """Commands at a sample; see :class:`Controller`."""
        wanted = length_motion(self.plant.mechanism.geometry, self.reference(t))
        positions, speeds = measured_drives(measurement)
        g, mass = self.gains, self._loop.mass
        error = positions - (wanted.lengths - self._shorter)
        proportional = mass * g.bandwidth**2 * error
        if self._integral is None:
            # A device is switched on with its brakes closed: the first force is what they held.
            held = self._loop.stiffness * (np.asarray(measurement.lengths) - positions)
            self._integral = held - proportional
        force = proportional + self._integral + 2.0 * mass * g.bandwidth * (speeds - wanted.rates)
        given = np.clip(force, -self._loop.limit, self._loop.limit)
        self._integral = self._integral + self._interval / g.integral_time * (proportional + given - force)
        return np.asarray(given / self._loop.limit)
