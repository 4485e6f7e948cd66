"""Placement of base ring and platform on an elastic harness and cuff, and displacement of these under a wrench.

Harness and cuff are springs with six degrees of freedom, linear in displacement t and rotation vector v:
(t, v) = K⁻¹ (F, J_lᵀ M), with the moment M about the displaced point. All operations are analytic, for complex steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.validation import FloatArray
from ...design import Interface, Interfaces
from ...numerics.analytic_vectors import left_jacobian, turn_matrix


class DevicePlacement(NamedTuple):
    """Placement of the parts of the device, N poses, seen from the displaced centre of the arm's joint.

    Attributes
    ----------
    base_points : ndarray
        A_i about the centre of the base ring, turned with it, shape (N, n, 3), m, base frame.
    matrices : ndarray
        Orientation of the platform, shape (N, 3, 3).
    base, cuff : ndarray
        Centre of the base ring, base frame, and of the platform, axes of the platform, shape (N, 3), m.
    """

    base_points: FloatArray
    matrices: FloatArray
    base: FloatArray
    cuff: FloatArray


def placed(
    points: FloatArray,
    arm: FloatArray,
    delta: FloatArray,
    base: FloatArray,
    cuff: FloatArray,
    interfaces: Interfaces,
    harness_displacement: FloatArray,
    cuff_displacement: FloatArray,
) -> DevicePlacement:
    """Placement of the parts, k poses.

    Parameters
    ----------
    points : ndarray
        A_i about the centre of the base ring, shape (n, 3), m.
    arm : ndarray
        Orientation of the arm, shape (k, 3, 3).
    delta, base, cuff : ndarray
        δ and the centre offsets, shape (k, 3), m.
    interfaces : Interfaces
        Harness and cuff.
    harness_displacement, cuff_displacement : ndarray
        (t, v) of those that are not rigid, shape (k, 6), else (k, 0).
    """
    base_points = np.repeat(points[None], len(arm), axis=0)
    platform = arm
    if interfaces.harness is not None:
        turn = turn_matrix(harness_displacement[:, 3:])
        base_points = base_points @ np.swapaxes(turn, 1, 2)
        base = _moved(interfaces.harness, harness_displacement, turn, base)
    if interfaces.cuff is not None:
        turn = turn_matrix(cuff_displacement[:, 3:])
        platform = arm @ turn
        cuff = turned(np.swapaxes(turn, 1, 2), _moved(interfaces.cuff, cuff_displacement, turn, cuff))
    return DevicePlacement(base_points, platform, base - delta, cuff)


def turned(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors of shape (k, 3), each turned by its own matrix."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def displacement_under(
    interface: Interface, displacement: FloatArray, wrench: FloatArray, centre: FloatArray
) -> FloatArray:
    """(t, v), shape (k, 6), under a wrench on the displaced part of the device, moment about ``centre``."""
    force = wrench[:, :3]
    moment = wrench[:, 3:] - np.cross(np.asarray(interface.at) + displacement[:, :3] - centre, force)
    generalised = turned(np.swapaxes(left_jacobian(displacement[:, 3:]), 1, 2), moment)
    return np.concatenate([force, generalised], axis=1) @ interface.compliance


def _moved(interface: Interface, displacement: FloatArray, turn: FloatArray, point: FloatArray) -> FloatArray:
    """Displaced position of a point of the device's part, shape (k, 3)."""
    at = np.asarray(interface.at)
    return np.asarray(at + displacement[:, :3] + turned(turn, point - at))
