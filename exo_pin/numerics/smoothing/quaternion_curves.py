"""Curves of quaternions: sign, unit length, angular velocity and acceleration.

A curve q(t) in four dimensions, brought to unit length, u = q/|q|, is a movement. ω = 2 vec(u̇ ū) and η = 2 vec(ü ū) are
exact wherever q is twice differentiable.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray


def continuous_quaternions(poses: Rotation) -> FloatArray:
    """Quaternions x, y, z, w of a stack of shape (N,), each of the sign that is nearer to the one before.

    After half a turn neither is nearer; the sign stays as it is.
    """
    q = poses.as_quat()
    q[1:] *= np.cumprod(np.where(np.einsum("ij,ij->i", q[1:], q[:-1]) < 0.0, -1.0, 1.0))[:, None]
    return q


def motion_of_quaternions(values: FloatArray, unit: float = 1.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit quaternions, ω and η from quaternions of any length and their derivatives.

    Parameters
    ----------
    values : ndarray
        Shape (3, N, 4): q and its first two derivatives by t/unit.
    unit : float
        s.

    Returns
    -------
    u, velocity, acceleration : ndarray
        Shapes (N, 4), (N, 3) in rad/s and (N, 3) in rad/s²; base frame.
    """
    q, dq, ddq = values[0], values[1] / unit, values[2] / unit**2
    size = np.sqrt(_dot(q, q))
    u = q / size
    # Up to a multiple of u, of which vec(u ū) is zero: du, and with it ddu.
    du = dq / size
    ddu = (ddq - 2.0 * du * _dot(u, dq)) / size
    return u, 2.0 * _vector_part(du, u), 2.0 * _vector_part(ddu, u)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.einsum("ij,ij->i", a, b)[:, None]


def _vector_part(p: FloatArray, u: FloatArray) -> FloatArray:
    """vec(p ū) of quaternions xyzw."""
    v, w = p[..., :3], p[..., 3:]
    a, b = -u[..., :3], u[..., 3:]
    return np.asarray(w * a + b * v + np.cross(v, a))
