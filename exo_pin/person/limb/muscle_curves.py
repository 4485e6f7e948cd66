"""Force of a muscle over its length and velocity: a Hill muscle with a rigid tendon.

With the activation a, the normalised fibre length l and velocity v, the tendon force is

    T = F0 cos α [a active(l) velocity(v) + passive(l)],

with the angle α between fibres and tendon from a muscle of constant thickness. The tendon is rigid: it stretches by
3.3 % at most, and a static pose does not store its energy.

The curves are those of M. Millard et al., "Flexing computational muscle", J. Biomech. Eng. 135 (2013) 021005, with the
parameters of the MoBL-ARMS model: tables of OpenSim 4.6's ``ActiveForceLengthCurve``, ``FiberForceLengthCurve`` and
``ForceVelocityCurve``, interpolated monotonically (within 0.005 of the curves).
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
import scipy

from ...core.validation import FloatArray
from .muscle_table import MuscleTable

__all__ = ["MuscleState", "active_curve", "muscle_state", "passive_curve", "velocity_curve"]

#: Shortening velocity at which a muscle has no force, optimal fibre lengths per second.
_FASTEST = 10.0
_ACTIVE = (
    (0.4327, 0.45, 0.475, 0.5, 0.525, 0.55, 0.575, 0.6, 0.625, 0.65, 0.675, 0.7, 0.725, 0.75, 0.775, 0.8, 0.825, 0.85,
     0.875, 0.9, 0.925, 0.95, 0.975, 1.0, 1.025, 1.05, 1.075, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4, 1.45, 1.5, 1.55,
     1.575, 1.595),
    (0.0, 0.002, 0.05398, 0.14461, 0.23873, 0.33351, 0.42847, 0.52342, 0.61794, 0.71065, 0.79678, 0.85934, 0.88874,
     0.90543, 0.91864, 0.93069, 0.94233, 0.95387, 0.96539, 0.97685, 0.98804, 0.99736, 0.99987, 1.0, 0.9997, 0.99621,
     0.97926, 0.94182, 0.84682, 0.74709, 0.64641, 0.54545, 0.44445, 0.34346, 0.24257, 0.14206, 0.0439, 0.00544, 0.0),
)  # fmt: skip
_PASSIVE = (
    (1.0, 1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4, 1.45, 1.5, 1.55, 1.6, 1.6405),
    (0.0, 0.00321, 0.00773, 0.01457, 0.02631, 0.04652, 0.07906, 0.1266, 0.1902, 0.27119, 0.37538, 0.52194, 0.75278,
     1.0),
)  # fmt: skip
#: Slope of the passive curve beyond its last point, where it is a straight line.
_PASSIVE_SLOPE = 6.3163
_VELOCITY = (
    (-1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.15, -0.1, -0.05, -0.025, -0.01, 0.0, 0.01, 0.025, 0.05,
     0.075, 0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1.0),
    (0.0, 0.0125, 0.0379, 0.06652, 0.10409, 0.15809, 0.23331, 0.33024, 0.4519, 0.52783, 0.62521, 0.77192, 0.87773,
     0.95016, 1.0, 1.04915, 1.11127, 1.17235, 1.20461, 1.22515, 1.25165, 1.26947, 1.29471, 1.33113, 1.36995, 1.4),
)  # fmt: skip


class MuscleState(NamedTuple):
    """What muscles can do at given lengths and velocities, shape (..., m) each.

    Attributes
    ----------
    fibre : ndarray
        Fibre length over the optimal one.
    active : ndarray
        Tendon force per activation, N.
    passive : ndarray
        Tendon force without activation, N.
    """

    fibre: FloatArray
    active: FloatArray
    passive: FloatArray


@functools.cache
def _interpolated(knots: tuple[Any, Any]) -> Any:
    return scipy.interpolate.PchipInterpolator(*knots)


def active_curve(fibre: FloatArray) -> FloatArray:
    """Active force over the peak force at a normalised fibre length."""
    return np.asarray(_interpolated(_ACTIVE)(np.clip(fibre, _ACTIVE[0][0], _ACTIVE[0][-1])))


def passive_curve(fibre: FloatArray) -> FloatArray:
    """Force of the fibres at rest over the peak force, at a normalised fibre length; zero below 1."""
    low, high = _PASSIVE[0][0], _PASSIVE[0][-1]
    inside = _interpolated(_PASSIVE)(np.clip(fibre, low, high))
    return np.asarray(inside + _PASSIVE_SLOPE * np.maximum(fibre - high, 0.0))


def velocity_curve(velocity: FloatArray) -> FloatArray:
    """Factor of the active force at a normalised velocity: 0 at -1 (shortening at full speed), 1 at 0, 1.4 at 1."""
    return np.asarray(_interpolated(_VELOCITY)(np.clip(velocity, -1.0, 1.0)))


def muscle_state(
    table: MuscleTable, length: FloatArray, velocity: FloatArray | None = None, passive: bool = True
) -> MuscleState:
    """State of muscles at given path lengths.

    Parameters
    ----------
    table : MuscleTable
        Properties of the muscles.
    length : ndarray
        Length of the whole path, muscle and tendon, shape (..., m), m.
    velocity : ndarray, optional
        Rate of that length, shape (..., m), m/s, positive where it grows. Zero if left out.
    passive : bool
        Whether stretched fibres pull without activation.

    Returns
    -------
    MuscleState
        A path shorter than its tendon is slack: no force.
    """
    height = table.fibre * np.sin(table.pennation)
    along = np.maximum(length - table.tendon, 0.0)
    fibre = np.hypot(along, height)
    cosine = along / np.maximum(fibre, 1e-12)
    normal = fibre / table.fibre
    strength = table.force * cosine
    active = strength * active_curve(normal)
    if velocity is not None:
        # Fibres of constant thickness: their rate is that of the path, times the cosine.
        active = active * velocity_curve(velocity * cosine / (table.fibre * _FASTEST))
    still = strength * passive_curve(normal) if passive else np.zeros_like(strength)
    return MuscleState(normal, active, still)
