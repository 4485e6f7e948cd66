"""Joint angles of the wrist's chain in closed form, so that a query starts from closed loops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.compiled import kernel
from ..core.validation import FloatArray
from ..design import WristGeometry
from ..wrist import inverse_kinematics

__all__ = ["NeutralLimbs", "joint_angles", "side_couples"]


class NeutralLimbs:
    """The limbs in the neutral pose, where every joint of the chain is zero, in the axes of the arm.

    Attributes
    ----------
    axes : ndarray
        X_i, shape (n, 3), in {O_B}; for a folded limb some axis across it.
    directions : ndarray
        s_i, shape (n, 3), in {O_B}.
    lengths : ndarray
        Shape (n,), m.
    base_axes : ndarray
        Axis from A_i to O, shape (n, 3), in {O_B}.
    matrix : ndarray
        Shape (3, 3), the neutral pose.
    """

    def __init__(self, geometry: WristGeometry) -> None:
        state = inverse_kinematics(geometry, geometry.neutral)
        self.matrix: FloatArray = geometry.neutral.as_matrix()
        self.axes: FloatArray = state.normals @ self.matrix
        for i in np.flatnonzero(state.reach == 0.0):
            self.axes[i] = across(geometry.platform_points[i])
        self.directions: FloatArray = state.directions @ self.matrix
        self.lengths: FloatArray = state.lengths
        towards_centre = -geometry.base_points / np.linalg.norm(geometry.base_points, axis=-1, keepdims=True)
        self.base_axes: FloatArray = towards_centre @ self.matrix


def across(vector: FloatArray) -> FloatArray:
    """Unit vector at right angles to ``vector``: its cross product with the coordinate axis it is farthest from."""
    axis = np.cross(vector, np.eye(3)[np.abs(vector).argmin()])
    return np.asarray(axis / np.linalg.norm(axis))


@kernel
def _turn(axis: Any, angle: float, v: Any, out: Any) -> None:
    """Rodrigues: ``v`` turned about the unit vector ``axis``."""
    cos, sin = math.cos(angle), math.sin(angle)
    dot = (axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]) * (1.0 - cos)
    out[0] = v[0] * cos + (axis[1] * v[2] - axis[2] * v[1]) * sin + axis[0] * dot
    out[1] = v[1] * cos + (axis[2] * v[0] - axis[0] * v[2]) * sin + axis[1] * dot
    out[2] = v[2] * cos + (axis[0] * v[1] - axis[1] * v[0]) * sin + axis[2] * dot


@kernel
def _angle(axis: Any, u: Any, v: Any) -> float:
    """Angle about ``axis`` that takes ``u`` to ``v``, both at right angles to it."""
    sine = (
        axis[0] * (u[1] * v[2] - u[2] * v[1])
        + axis[1] * (u[2] * v[0] - u[0] * v[2])
        + axis[2] * (u[0] * v[1] - u[1] * v[0])
    )
    return math.atan2(sine, u[0] * v[0] + u[1] * v[1] + u[2] * v[2])


@kernel
def side_couples(b: Any, X: Any, out: Any) -> None:
    """Fill the rows that give the couple in the universal joint at B_i from a wrench about O.

    Of a wrench (F, M) about O the couple at B along n = b/|b| × X is n·(M - b × F) = n·M - |b| X·F.

    Parameters
    ----------
    b, X : ndarray
        Shape (n, 3), the vectors from O to B_i and the limbs' axes.
    out : ndarray
        Shape (n, 6), filled.

    Notes
    -----
    Source: thesis (D-13), (D-18).
    """
    for i in range(len(b)):
        size = np.sqrt(b[i, 0] ** 2 + b[i, 1] ** 2 + b[i, 2] ** 2)
        for k in range(3):
            out[i, k] = -size * X[i, k]
        out[i, 3] = (b[i, 1] * X[i, 2] - b[i, 2] * X[i, 1]) / size
        out[i, 4] = (b[i, 2] * X[i, 0] - b[i, 0] * X[i, 2]) / size
        out[i, 5] = (b[i, 0] * X[i, 1] - b[i, 1] * X[i, 0]) / size


@kernel
def joint_angles(
    R: Any,
    platform: Any,
    base_axes: Any,
    s: Any,
    X: Any,
    length: Any,
    reach: Any,
    neutral_axes: Any,
    neutral_directions: Any,
    neutral_lengths: Any,
    neutral_base_axes: Any,
    neutral_matrix: Any,
    out: Any,
) -> None:
    """Angles of platform_y, platform_x, slide, base_x and base_y of every limb in a pose.

    Parameters
    ----------
    R : ndarray
        Pose, shape (3, 3).
    platform, base_axes : ndarray
        B_i in {O_B} and the axes from A_i to O in {O_A}, shape (n, 3).
    s, X, length, reach : ndarray
        Of the limbs in this pose, base frame (:func:`exo_pin.wrist.kernels.limb_vectors`).
    neutral_axes, neutral_directions, neutral_lengths, neutral_base_axes, neutral_matrix : ndarray
        The attributes of :class:`NeutralLimbs`.
    out : ndarray
        Shape (n, 5), written; rad, and m for the slide.
    """
    axis, s_arm, X_arm, y_arm, moved = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    half, X_neutral = np.empty(3), np.empty(3)
    for i in range(platform.shape[0]):
        size = math.sqrt(platform[i, 0] ** 2 + platform[i, 1] ** 2 + platform[i, 2] ** 2)
        for j in range(3):
            axis[j] = -platform[i, j] / size
            s_arm[j] = R[0, j] * s[i, 0] + R[1, j] * s[i, 1] + R[2, j] * s[i, 2]
            X_arm[j] = R[0, j] * X[i, 0] + R[1, j] * X[i, 1] + R[2, j] * X[i, 2]
            y_arm[j] = R[0, j] * base_axes[i, 0] + R[1, j] * base_axes[i, 1] + R[2, j] * base_axes[i, 2]
            X_neutral[j] = (
                neutral_matrix[j, 0] * neutral_axes[i, 0]
                + neutral_matrix[j, 1] * neutral_axes[i, 1]
                + neutral_matrix[j, 2] * neutral_axes[i, 2]
            )
        if reach[i] == 0.0:
            # A folded limb has no plane of its own: leave the first joint where it is.
            X_arm[:] = neutral_axes[i]
        out[i, 0] = _angle(axis, neutral_axes[i], X_arm)
        _turn(axis, out[i, 0], neutral_directions[i], moved)
        out[i, 1] = _angle(X_arm, moved, s_arm)
        out[i, 2] = length[i] - neutral_lengths[i]
        _turn(axis, out[i, 0], neutral_base_axes[i], half)
        _turn(X_arm, out[i, 1], half, moved)
        out[i, 3] = _angle(X_arm, moved, y_arm)
        for j in range(3):
            moved[j] = R[j, 0] * X_arm[0] + R[j, 1] * X_arm[1] + R[j, 2] * X_arm[2]
        out[i, 4] = _angle(base_axes[i], moved, X_neutral)
