"""Force commands of motor drives: feed-forward of tension, inertia and friction, and a loop on the drive's own length.

A winch or a linear actuator moves by m s'' = T - F - c s' - friction (see
:mod:`exo_pin.control.plant.equations.motor_kernels`). For a wanted tension f and a wanted length l of the limb the
drive's length is s_w = l - f/k, and the motor gets

    F = f - m l'' - c l' - (F_c + μ |f|) sat(l'/v_s) + m Ω² (s - s_w) + 2 m Ω (s' - l')

s and s' come from the encoder of the motor; no force sensor is needed. Compensation of friction in place of a load cell
is common for cable-driven suits (E. Bardi et al., Sensorless model-based tension control for a cable-driven exosuit,
2024, arXiv 2406.18412). The loop is soft on purpose: it holds m Ω² newton a metre, a tenth of a cable's own stiffness,
so that an error of the geometry does not become a large tension.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import MissingData
from ...core.validation import FloatArray
from ...design import WristGeometry
from ..plant.drives import Drive, MotorDrive

#: Speed within which the compensated friction changes its sign, m/s.
_SMOOTH = 0.005


class LengthMotion(NamedTuple):
    """Lengths of n limbs in a motion of the arm.

    Attributes
    ----------
    lengths, rates, accelerations : ndarray
        Shape (n,): l in m, l' in m/s, l'' in m/s².
    """

    lengths: FloatArray
    rates: FloatArray
    accelerations: FloatArray


def length_motion(geometry: WristGeometry, state: Any) -> LengthMotion:
    """Lengths of the limbs, and their first two derivatives, of a motion of the arm about O.

    With b = B_i - O in the base frame, b' = ω × b: l' = s · b', l'' = s · b'' + (|b'|² - l'²)/l.

    Parameters
    ----------
    geometry : WristGeometry
    state : ReferenceState
        ``orientation``, ``angular_velocity`` and ``angular_acceleration``, single.
    """
    b = geometry.platform_points @ state.orientation.as_matrix().T
    w, e = np.asarray(state.angular_velocity), np.asarray(state.angular_acceleration)
    span = b - geometry.base_points
    lengths = np.linalg.norm(span, axis=1)
    s = span / lengths[:, None]
    velocity = np.cross(w, b)
    acceleration = np.cross(e, b) + np.cross(w, velocity)
    rates = np.einsum("ij,ij->i", s, velocity)
    across = np.einsum("ij,ij->i", velocity, velocity) - rates**2
    return LengthMotion(lengths, rates, np.einsum("ij,ij->i", s, acceleration) + across / lengths)


class MotorLoop:
    """The loop of every motor drive of a plant; see the module.

    Parameters
    ----------
    drives : sequence of Drive
        Of the plant that the controller takes for true.
    bandwidth : float
        Ω, rad/s.

    Attributes
    ----------
    motors : list of int
        Limbs that have a motor.
    """

    def __init__(self, drives: Sequence[Drive], bandwidth: float) -> None:
        chosen = [(i, drive) for i, drive in enumerate(drives) if isinstance(drive, MotorDrive)]
        self.motors = [i for i, _ in chosen]
        own = [drive for _, drive in chosen]
        self.mass = np.array([drive.parameters.mass for drive in own])
        self.limit = np.array([drive.force_limit for drive in own])
        self.stiffness = np.array([drive.stiffness for drive in own])
        self._viscous = np.array([drive.parameters.viscous for drive in own])
        self._coulomb = np.array([drive.parameters.coulomb for drive in own])
        self._share = np.array([drive.parameters.load_friction for drive in own])
        self._bandwidth = bandwidth

    def feed_forward(self, tensions: FloatArray, rates: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Motor forces in N for tensions in N, with limbs that move at given rates; shape (m,), of the motors alone."""
        friction = (self._coulomb + self._share * np.abs(tensions)) * np.clip(rates / _SMOOTH, -1.0, 1.0)
        return np.asarray(tensions - self.mass * accelerations - self._viscous * rates - friction)

    def commands(self, tensions: FloatArray, wanted: LengthMotion, measurement: Any) -> FloatArray:
        """Commands, shape (m,), of the motors alone, for wanted tensions of all limbs in N.

        Raises
        ------
        MissingData
            If the drives' positions and speeds are not measured.
        """
        f, lengths, rates, accelerations = (part[self.motors] for part in (tensions, *wanted))
        positions, speeds = measured_drives(measurement)
        force = self.feed_forward(f, rates, accelerations)
        off = positions[self.motors] - (lengths - f / self.stiffness)
        force += self.mass * self._bandwidth * (self._bandwidth * off + 2.0 * (speeds[self.motors] - rates))
        return np.asarray(force / self.limit)


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
