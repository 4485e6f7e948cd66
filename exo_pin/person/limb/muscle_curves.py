"""Force of a muscle over its length and velocity: a Hill muscle with a rigid tendon.

With the activation a, the normalised fibre length l and velocity v, the tendon force is

    T = F0 cos α [a active(l) velocity(v) + passive(l)],

with the angle α between fibres and tendon from a muscle of constant thickness. The tendon is rigid: it stretches by
3.3 % at most, and a static pose does not store its energy.

The curves are those of M. Millard et al., "Flexing computational muscle", J. Biomech. Eng. 135 (2013) 021005, with the
parameters of the MoBL-ARMS model: tables of OpenSim 4.6's ``ActiveForceLengthCurve``, ``FiberForceLengthCurve`` and
``ForceVelocityCurve`` in ``data/curves.csv``, interpolated monotonically (within 0.005 of the curves).
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
import scipy

from ...core.validation import FloatArray
from .muscle_table import MuscleTable, data_table

#: Shortening velocity at which a muscle has no force, optimal fibre lengths per second.
_FASTEST = 10.0
#: Slope of the passive curve beyond its last point, where it is a straight line.
_PASSIVE_SLOPE = 6.3163


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
def _interpolated(curve: str) -> Any:
    table = data_table("curves")
    chosen = [row[0] == curve for row in table.rows]
    return scipy.interpolate.PchipInterpolator(*table.numbers(("at", "force"))[chosen].T)


def active_curve(fibre: FloatArray) -> FloatArray:
    """Active force over the peak force at a normalised fibre length."""
    curve = _interpolated("active")
    return np.asarray(curve(np.clip(fibre, curve.x[0], curve.x[-1])))


def passive_curve(fibre: FloatArray) -> FloatArray:
    """Force of the fibres at rest over the peak force, at a normalised fibre length; zero below 1."""
    curve = _interpolated("passive")
    inside = curve(np.clip(fibre, curve.x[0], curve.x[-1]))
    return np.asarray(inside + _PASSIVE_SLOPE * np.maximum(fibre - curve.x[-1], 0.0))


def velocity_curve(velocity: FloatArray) -> FloatArray:
    """Factor of the active force at a normalised velocity: 0 at -1 (shortening at full speed), 1 at 0, 1.4 at 1."""
    return np.asarray(_interpolated("velocity")(np.clip(velocity, -1.0, 1.0)))


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
