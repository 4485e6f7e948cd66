"""Lengths of the limbs of a wrist, and their first two derivatives, in a motion of the arm."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.validation import FloatArray
from ...design import WristGeometry


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
