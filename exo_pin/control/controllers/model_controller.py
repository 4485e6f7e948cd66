"""A controller that knows arm, muscles and valves: wanted motion -> moment -> tensions -> pressures -> duties.

With the error e = log(R_r Rᵀ), a rotation vector in the base frame, the limbs shall put on the arm the moment

    M = I η_r + ω × I ω - C × m g - M_load + K e + D (ω_r - ω) + i         i' = K e / T_i - (M - M_given) / T_t

feed-forward of the reference's motion, of the weight and of the plant's constant load, and feedback by a spring K, a
damper D and an integral, which the moment that the muscles cannot give draws back (back-calculation with T_t = T_i).
Why moments and not accelerations: an arm has so little inertia about its own axis that any friction there would beat a
wanted acceleration.

The tensions for it are those nearest to the moment within what the muscles can pull at their lengths, and among these
the ones of least shoulder force (:mod:`exo_pin.control.controllers.tension_program`). The static muscle law turns them
into pressures, a muscle that shall not pull into the pressure at which it would begin to. The valve is then pulsed with
the share of time that holds the wanted pressure, from the flows of its two paths, plus a share proportional to the
pressure's error.

Without a reading of the inertial sensor the arm is taken to be where the reference is: feed-forward and the last
integral alone.

Assumptions: the controller's own plant is true; muscle friction and the lag of the air are left to the feedback; limbs
carry no side force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_positive
from ...load_case import Load, Motion
from ...muscle.valve.flow import ATMOSPHERE, mass_flow
from ..plant.equations.plant_tables import supply_of
from ..plant.plant import Plant
from .contraction import Contractions
from .pressure_kernels import pressures_for, static_tensions
from .tension_program import Tensions, tensions_for_motion

__all__ = ["FeedbackGains", "ModelController"]


@dataclass(frozen=True)
class FeedbackGains:
    """Gains of the feedback.

    Attributes
    ----------
    stiffness : float
        K, N m/rad.
    damping : float
        D, N m s/rad.
    integral_time : float
        T_i, s; infinite for none.
    pressure : float
        Share of time by which a valve is opened or closed more for a pressure that is 1 bar off.
    """

    stiffness: float = 1.5
    damping: float = 0.1
    integral_time: float = 2.0
    pressure: float = 1.0

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping", "pressure"):
            object.__setattr__(self, name, as_positive(name, getattr(self, name), zero=True))
        if self.integral_time != np.inf:
            object.__setattr__(self, "integral_time", as_positive("integral_time", self.integral_time))


class ModelController:
    """Feed-forward of tensions and pressures with feedback; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true; the plant that is simulated may be another.
    reference : callable
        ``reference(t)`` has ``orientation``, ``angular_velocity`` and ``angular_acceleration``.
    gains : FeedbackGains, optional
        Of the feedback.
    rate : float
        Samples a second, Hz.

    Attributes
    ----------
    planned : Tensions or None
        Of the last sample.
    """

    def __init__(
        self, plant: Plant, reference: Callable[[float], Any], gains: FeedbackGains | None = None, rate: float = 100.0
    ) -> None:
        if not isinstance(plant, Plant):
            raise InvalidInput(f"expected plant to be a Plant, got {type(plant).__name__}")
        if gains is not None and not isinstance(gains, FeedbackGains):
            raise InvalidInput(f"expected gains to be FeedbackGains, got {type(gains).__name__}")
        if not callable(reference):
            raise InvalidInput(f"expected a reference that can be called, got {type(reference).__name__}")
        self.plant, self.reference = plant, reference
        self.gains = FeedbackGains() if gains is None else gains
        self._interval = 1.0 / as_positive("rate", rate)
        self._contractions = Contractions(plant.mechanism)
        self._units, self._supply = plant.units, supply_of(plant.mechanism, plant.options)
        self.reset()

    def reset(self) -> None:
        """Integral to zero."""
        self._integral = np.zeros(3)
        self.planned: Tensions | None = None

    def __call__(self, t: float, measurement: Any) -> FloatArray:
        """Commands at a sample; see :class:`Controller`."""
        wanted = self.reference(t)
        if getattr(measurement, "lost", False):
            pose, velocity, error = wanted.orientation, wanted.angular_velocity, np.zeros(3)
        else:
            pose, velocity = measurement.orientation, measurement.angular_velocity
            error = (wanted.orientation * pose.inv()).as_rotvec()
        lengths = self._contractions.lengths(pose)
        self.planned = self._tensions(wanted, pose, velocity, error, lengths)
        g = self.gains
        self._integral += self._interval / g.integral_time * (g.stiffness * error + self.planned.missing_moment)
        return self._commands(self._pressures(self.planned.tensions, lengths), measurement.pressures)

    def _tensions(
        self, wanted: Any, pose: Rotation, velocity: FloatArray, error: FloatArray, lengths: FloatArray
    ) -> Tensions:
        g = self.gains
        feedback = g.stiffness * error + g.damping * (wanted.angular_velocity - velocity) + self._integral
        tables = self.plant.tables
        least, greatest = np.empty(len(lengths)), np.empty(len(lengths))
        static_tensions(tables.law, tables.muscles, lengths, 0.0, least)
        static_tensions(tables.law, tables.muscles, lengths, self._supply.pressure, greatest)
        motion = Motion(velocity, wanted.angular_acceleration)
        # The limbs carry what a load of the opposite moment would be, beside the plant's own.
        load = Load(tables.force, -feedback, tables.point)
        return tensions_for_motion(self.plant.mechanism, pose, motion, np.maximum(greatest, least), least, load)

    def _pressures(self, tensions: FloatArray, lengths: FloatArray) -> FloatArray:
        tables, pressures = self.plant.tables, np.empty(len(lengths))
        pressures_for(tables.law, tables.muscles, lengths, tensions, self._supply.pressure, pressures)
        return pressures

    def _commands(self, wanted: FloatArray, measured: FloatArray) -> FloatArray:
        """Valve commands that hold the wanted pressures and correct the measured ones."""
        commands = np.empty(len(wanted))
        for i, valves in enumerate(self._units):
            correction = self.gains.pressure * (wanted[i] - measured[i]) / 1e5
            if valves.layout == "3/2":
                fill, vent = valves.paths
                p = wanted[i] + ATMOSPHERE
                inflow = mass_flow(self._supply.absolute, p, fill.conductance, fill.critical_ratio)
                outflow = mass_flow(p, ATMOSPHERE, vent.conductance, vent.critical_ratio)
                total = inflow + outflow
                correction = 2.0 * (correction + (outflow / total if total > 0.0 else 0.0)) - 1.0
            commands[i] = min(max(correction, -1.0), 1.0)
        return commands
