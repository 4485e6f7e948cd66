"""Force commands of motor drives: feed-forward of tension, inertia and friction, and a loop on the drive's own length.

A winch or a linear actuator moves by m s'' = T - F - c s' - friction (see
:mod:`exo_pin.control.plant.equations.drive_kernels`). For a wanted tension f and a wanted length l of the limb the
drive's length is s_w = l - f/k, and the motor gets

    F = f - m l'' - c l' - (F_c + μ |f|) sat(l'/v_s) + m Ω² (s - s_w) + 2 m Ω (s' - l')

s and s' come from the encoder of the motor; no force sensor is needed. Compensation of friction in place of a load cell
is common for cable-driven suits (E. Bardi et al., Sensorless model-based tension control for a cable-driven exosuit,
2024, arXiv 2406.18412). The loop is soft on purpose: it holds m Ω² newton a metre, a tenth of a cable's own stiffness,
so that an error of the geometry does not become a large tension.

:class:`LengthController` is the simple one: PI control of the lengths l that inverse kinematics makes of the wanted
pose. The motor gets

    F = K (e + (1/T_i) ∫ e dt) + D (s' - l')        e = s - (l - f_0/k)

with s and s' of the motor's encoder, l' the wanted rate, and f_0 the tension by whose stretch a cable is kept shorter
than its limb. K = m Ω² and D = 2 m Ω with m the drive's mass along the limb. It knows nothing of the arm: the weight is
left to the integral. The integral has back-calculation with T_t = T_i.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core.errors import InvalidInput, MissingData
from ...core.validation import FloatArray, as_positive, require_type
from ..plant.drives import DirectDrive, LimbDrive, MotorDrive
from ..plant.plant import Plant
from .planning import LengthMotion, planner_of

#: Speed within which the compensated friction changes its sign, m/s.
_SMOOTH = 0.005


class MotorLoop:
    """The loop of every motor drive of a plant; see the module.

    Parameters
    ----------
    drives : sequence of LimbDrive
        Of the plant that the controller takes for true.
    bandwidth : float
        Ω, rad/s.
    masses : ndarray, optional
        Shape (n,), what moves with each drive that acts on its joint without a spring between, kg or kg m². Without
        them such drives have no loop of their own: the controller plans for all that moves.

    Attributes
    ----------
    motors : list of int
        Limbs that have a motor.
    sign : ndarray
        1 where the effort pulls in, -1 where it is positive towards larger coordinates, as of a motor in a joint.
    """

    def __init__(self, drives: Sequence[LimbDrive], bandwidth: float, masses: FloatArray | None = None) -> None:
        chosen = [(i, d) for i, d in enumerate(drives) if isinstance(d, MotorDrive | DirectDrive)]
        self.motors = [i for i, _ in chosen]
        own = [drive for _, drive in chosen]
        self.sign = np.array([-1.0 if drive.of_joint else 1.0 for drive in own])
        none = np.zeros(len(drives)) if masses is None else masses
        # Of a motor in a joint all that moves with it counts.
        own_mass = [d.parameters.mass if isinstance(d, MotorDrive) else 0.0 for d in own]
        self.mass = np.array(
            [m + (0.0 if m and not d.of_joint else none[i]) for m, (i, d) in zip(own_mass, chosen, strict=True)]
        )
        # The motor of a cable pays out with force, too.
        ends = [d.limits if isinstance(d, DirectDrive) else (-d.force_limit, d.force_limit) for d in own]
        self._low, self._high = np.array(ends).reshape(-1, 2).T
        self.stiffness = np.array([drive.stiffness for drive in own])
        self._viscous = np.array([drive.parameters.viscous for drive in own])
        self._coulomb = np.array([drive.parameters.coulomb for drive in own])
        self._share = np.array([drive.parameters.load_friction for drive in own])
        self._bandwidth = bandwidth

    def clipped(self, force: FloatArray) -> FloatArray:
        """Forces that pull in, within the motors' limits, N or N m."""
        return np.asarray(self.sign * np.clip(self.sign * force, self._low, self._high))

    def shares(self, force: FloatArray) -> FloatArray:
        """Commands for forces that pull in."""
        effort = self.sign * force
        limit = np.where((effort < 0.0) & (self._low < 0.0), -self._low, self._high)
        return np.divide(effort, limit, out=np.zeros(len(effort)), where=limit > 0.0)

    def feed_forward(self, tensions: FloatArray, rates: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Motor forces in N for tensions in N, with limbs that move at given rates; shape (m,), of the motors alone."""
        friction = (self._coulomb + self._share * np.abs(tensions)) * np.clip(rates / _SMOOTH, -1.0, 1.0)
        return np.asarray(tensions - self.mass * accelerations - self._viscous * rates - friction)

    def commands(
        self, tensions: FloatArray, wanted: LengthMotion, measurement: Any, rubbing: bool = True
    ) -> FloatArray:
        """Commands, shape (m,), of the motors alone, for wanted tensions of all limbs in N.

        Friction is compensated if ``rubbing``: not where the wanted motion is the arm's own, which it would drive on.

        Raises
        ------
        MissingData
            If the drives' positions and speeds are not measured.
        """
        f, lengths, rates, accelerations = (part[self.motors] for part in (tensions, *wanted))
        f = self.sign * f
        positions, speeds = measured_drives(measurement)
        force = self.feed_forward(f, rates, accelerations) if rubbing else f
        off = positions[self.motors] - (lengths - f / self.stiffness)
        force += self.mass * self._bandwidth * (self._bandwidth * off + 2.0 * (speeds[self.motors] - rates))
        return self.shares(force)


def measured_drives(measurement: Any) -> tuple[FloatArray, FloatArray]:
    """Positions and speeds of the drives in a measurement, m and m/s.

    Raises
    ------
    MissingData
        If they are not measured.
    """
    positions, speeds = measurement.drive_positions, measurement.drive_speeds
    if positions is None or speeds is None:
        raise MissingData(["drive_positions", "drive_speeds"], "a controller of motor drives")
    return np.asarray(positions), np.asarray(speeds)


#: Ω of the loop of lengths, rad/s, at 100 samples a second not much above this; T_i, s; f_0 of cables, N.
_BANDWIDTH, _INTEGRAL_TIME, _TENSION = 35.0, 0.3, 20.0


class LengthController:
    """PI control of the lengths of motor drives, winches and linear actuators; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true, with motors in all limbs.
    reference : callable
        ``reference(t)`` has ``orientation``, ``angular_velocity`` and ``angular_acceleration``.
    rate : float
        Samples a second, Hz.

    Raises
    ------
    InvalidInput
        If a limb has no motor, the reference cannot be called, or the plant has a wrong type.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo = ep.load("three-linear-actuators")
    >>> plant, reference = ep.Plant(exo), control.flexion()
    >>> start = plant.held(exo.pose(), exo.reaction(exo.pose(), limits="none").actuator_forces)
    >>> run = plant.simulate(control.LengthController(plant, reference), 0.2, start)
    >>> off = (run.rotations * reference(run.times).orientation.inv()).magnitude()
    >>> round(float(np.rad2deg(off.max())), 1)  # degrees
    1.5
    """

    def __init__(self, plant: Plant, reference: Callable[[float], Any], rate: float = 100.0) -> None:
        require_type("plant", plant, Plant, "a Plant")
        require_type("reference", reference, Callable, "a function of time")
        if not plant.motors.all():
            raise InvalidInput("expected a motor in every limb; muscles have the controller of contraction ratios")
        self.plant, self.reference = plant, reference
        self._interval = 1.0 / as_positive("rate", rate)
        self._plans = planner_of(plant)
        self._attained = self._plans.attained(reference)
        masses = self._plans.masses(reference(0.0).orientation)
        self._loop = MotorLoop(plant.drives, _BANDWIDTH, masses)
        taut = np.array([drive.least_tension > 0.0 for drive in plant.drives])
        self._shorter = np.where(taut, _TENSION / self._loop.stiffness, 0.0)
        self.reset()

    def reset(self) -> None:
        """Integrals to zero; at the first sample they take what the drives hold.

        Examples
        --------
        >>> from exo_pin import control
        >>> exo = ep.load("three-linear-actuators")
        >>> plant, controller = ep.Plant(exo), control.LengthController(ep.Plant(exo), control.flexion())
        >>> start = plant.held(exo.pose(), exo.reaction(exo.pose(), limits="none").actuator_forces)
        >>> first = plant.simulate(controller, 0.02, start).commands
        >>> controller.reset()
        >>> bool((plant.simulate(controller, 0.02, start).commands == first).all())
        True
        """
        self._integral: FloatArray | None = None

    def __call__(self, t: float, measurement: Any) -> FloatArray:
        """Commands at a sample; see :class:`Controller`."""
        wanted = self._plans.motion(self._attained(t))
        positions, speeds = measured_drives(measurement)
        mass = self._loop.mass
        error = positions - (wanted.lengths - self._shorter)
        proportional = mass * _BANDWIDTH**2 * error
        if self._integral is None:
            # A device is switched on with its brakes closed: the first force is what they held.
            stretch = np.asarray(measurement.lengths) - positions
            held = np.where(np.isfinite(self._loop.stiffness), self._loop.stiffness, 0.0) * stretch
            self._integral = held - proportional
        force = proportional + self._integral + 2.0 * mass * _BANDWIDTH * (speeds - wanted.rates)
        given = self._loop.clipped(force)
        self._integral = self._integral + self._interval / _INTEGRAL_TIME * (proportional + given - force)
        return self._loop.shares(given)
