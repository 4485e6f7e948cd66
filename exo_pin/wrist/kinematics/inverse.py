"""Inverse kinematics: limb lengths, directions and the angles of both universal joints from the pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.results import Result
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ..limbs import limb_stack


@dataclass(frozen=True, eq=False)
class LimbState(Result):
    """Limbs of a wrist in a pose or a stack of poses of shape (...).

    Attributes
    ----------
    lengths : ndarray
        l_i = |A_i B_i|, shape (..., n), m.
    directions : ndarray
        s_i, unit vectors from A_i to B_i, shape (..., n, 3), base frame.
    platform_points : ndarray
        b_i = R B_i, shape (..., n, 3), m, base frame.
    normals : ndarray
        X_i of (D-11), shape (..., n, 3), base frame; NaN for a limb that is folded (on a line through O).
    reach : ndarray
        h_i, distance from O to the limb's line, shape (..., n), m.
    base_theta_x, base_theta_y : ndarray
        Angles of the universal joint at A_i, shape (..., n), rad: in {A_i} the direction s_i is
        (cos θx sin θy, -sin θx, cos θx cos θy), (4-25).
    platform_theta_x, platform_theta_y : ndarray
        The same for the joint at B_i: the direction -s_i in {B_i}.
    """

    lengths: FloatArray
    directions: FloatArray
    platform_points: FloatArray
    normals: FloatArray
    reach: FloatArray
    base_theta_x: FloatArray
    base_theta_y: FloatArray
    platform_theta_x: FloatArray
    platform_theta_y: FloatArray


def universal_angles(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Angles (θx, θy) with direction = Ry(θy) Rx(θx) e_z = (cos θx sin θy, -sin θx, cos θx cos θy).

    Parameters
    ----------
    direction : ndarray
        Shape (..., 3), in the joint's frame; need not be a unit vector.

    Returns
    -------
    theta_x, theta_y : ndarray
        Shape (...), rad; θx within ±90°, θy within ±180°.

    Notes
    -----
    Source: thesis (4-10), (4-13), (4-24), (4-25).
    """
    x, y, z = np.moveaxis(direction, -1, 0)
    return np.arctan2(-y, np.hypot(x, z)), np.arctan2(x, z)


def inverse_kinematics(geometry: WristGeometry, poses: Rotation) -> LimbState:
    """Lengths, directions and joint angles of every limb, Section 4.2.1.

    The angles follow (4-25), which the printed figures of the Scenario One example confirm; (4-10) and (4-13)
    contradict it.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres and frames.
    poses : Rotation
        Pose of the arm, single or a stack of shape (...).

    Returns
    -------
    LimbState

    Raises
    ------
    InvalidInput
        If ``poses`` is not a finite Rotation.

    Notes
    -----
    Source: thesis (4-1), (4-9), (4-11), (4-12), (4-14), (4-16), (4-23).
    """
    shape, matrices = pose_matrices(poses)
    count, n = len(matrices), geometry.limb_count
    b, s, X = np.empty((count, n, 3)), np.empty((count, n, 3)), np.empty((count, n, 3))
    length, reach = np.empty((count, n)), np.empty((count, n))
    limb_stack(matrices, geometry.base_points, geometry.platform_points, b, s, X, length, reach)
    base = universal_angles(np.einsum("nji,knj->kni", geometry.base_frames, s))
    in_arm = np.einsum("kji,knj->kni", matrices, -s)
    platform = universal_angles(np.einsum("nji,knj->kni", geometry.platform_frames, in_arm))
    X[reach == 0.0] = np.nan

    parts = (length, s, b, X, reach, *base, *platform)
    return LimbState(*(part.reshape((*shape, *part.shape[1:])) for part in parts))
