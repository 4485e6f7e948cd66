"""Orientation of the upper arm as the three angles of the anatomical model, and back.

**Rest.** At the identity the model is in its zero posture: elevation and axial rotation zero, elbow straight. The
vertical of {O_A} is the model's axis of axial rotation in that posture. It leans 2.4° to the side against the y axis of
the model's thorax, so that the arm hangs straight down and not 2.4° inwards. The x axis of {O_A} is the thorax's
forward axis, made perpendicular to that vertical (0.3°). The elbow's centre is 1.5° in front of the -z axis of {O_B},
and its axis of flexion 2.8° off the y axis.

**Angles.** With K = [e1 e2 e3], e3 the vertical and e1 the axis of elevation,

    R = K Rz(plane) Rx(elevation) Rz(rotation - plane) Kᵀ,

so that the elevation of the model is that of :func:`exo_pin.load_case.motion_and_load.elevation_angle`. For a hanging
arm the plane has no meaning and is set to zero; the bones and the muscles do not depend on it there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite
from .myoarm import MyoArm

#: Below this elevation, rad, the limits of the plane of elevation do not count: the plane is hardly defined there, and
#: a little adduction or extension lies outside of them.
_HANGING = np.radians(10.0)
#: What rounding may add to an angle at its limit, rad.
_ROUNDING = 1e-9
#: Names of the angles that have limits, in the order of :attr:`MyoArm.limits`.
LIMIT_NAMES = ("plane of elevation", "elevation", "axial rotation", "elbow flexion", "forearm rotation")
#: Where the joints below the shoulder go, degrees.
_RANGES = {"elbow_flexion": (0.0, 130.0), "forearm_rotation": (-90.0, 90.0)}


def as_joint_angle(name: str, value: Any, degrees: bool) -> float:
    """An angle of elbow or forearm in rad, given in rad or degrees; InvalidInput where the joint does not go there."""
    angle = float(as_finite(name, value, ()))
    angle = float(np.radians(angle)) if degrees else angle
    low, high = _RANGES[name]
    if not np.radians(low) - _ROUNDING <= angle <= np.radians(high) + _ROUNDING:
        raise InvalidInput(
            f"expected {name} of {low:g} to {high:g}°, where the model's joint goes, got "
            f"{np.degrees(angle):g}°{'' if degrees else ' (give degrees=True for degrees)'}"
        )
    return angle


def thorax_to_base(limb: MyoArm) -> FloatArray:
    """Rotation from the model's thorax frame to {O_A} of a right shoulder, shape (3, 3)."""
    up = limb.vertical
    forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
    forward /= np.linalg.norm(forward)
    return np.stack([forward, np.cross(up, forward), up])


def model_axes(limb: MyoArm) -> FloatArray:
    """Axes K = [e1 e2 e3] of the angles, as columns in {O_A} of a right shoulder, shape (3, 3)."""
    to_base = thorax_to_base(limb)
    e1, e3 = to_base @ limb.elevation_axis, to_base @ limb.vertical
    return np.stack([e1, np.cross(e3, e1), e3], axis=1)


def angles_of(limb: MyoArm, matrices: FloatArray) -> FloatArray:
    """Angles of right upper arms.

    Parameters
    ----------
    limb : MyoArm
        The model.
    matrices : ndarray
        Orientations of {O_B} in {O_A}, shape (N, 3, 3).

    Returns
    -------
    ndarray
        Shape (N, 3), rad: plane of elevation (0 outwards, positive forwards), elevation, axial rotation (positive
        inwards).
    """
    K = model_axes(limb)
    G = K.T @ matrices @ K
    level = np.hypot(G[:, 0, 2], G[:, 1, 2])
    elevation = np.arctan2(level, G[:, 2, 2])
    # Below this the direction of so small a tilt is rounding.
    plane = np.where(level > 1e-12, np.arctan2(G[:, 0, 2], -G[:, 1, 2]), 0.0)
    # Turn about the arm's own axis: first row of Rx(-elevation) Rz(-plane) G.
    cos, sin = np.cos(plane), np.sin(plane)
    first = cos[:, None] * G[:, 0] + sin[:, None] * G[:, 1]
    turn = np.arctan2(-first[:, 1], first[:, 0])
    rotation = np.mod(turn + plane + np.pi, 2.0 * np.pi) - np.pi
    return np.stack([plane, elevation, rotation], axis=1)


def beyond(limb: MyoArm, angles: FloatArray) -> NDArray[np.bool_]:
    """Which poses lie outside the model's range of motion.

    Parameters
    ----------
    limb : MyoArm
        The model.
    angles : ndarray
        Of :func:`angles_of`, shape (N, 3).

    Returns
    -------
    ndarray of bool
        Shape (N, 3): which angle is outside.
    """
    limits = limb.limits[:3]
    outside: Any = (angles < limits[:, 0] - _ROUNDING) | (angles > limits[:, 1] + _ROUNDING)
    outside[:, 0] &= angles[:, 1] > _HANGING
    return outside
