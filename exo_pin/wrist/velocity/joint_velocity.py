"""Rates of limbs and universal joints from the angular velocity of the arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors.checked import checked
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ..kinematics.inverse import QUANTITIES, inverse_kinematics, rate_stack

__all__ = ["QUANTITIES", "JointRows", "joint_jacobians", "limb_jacobian"]


@dataclass(frozen=True, eq=False)
class JointRows:
    """Matrices that multiply the angular velocity ω of the arm (base frame) to give rates.

    Each is of shape (..., n, 3). NaN for the angles of a folded limb, which has no plane.

    Attributes
    ----------
    lengths : ndarray
        m/rad, rows b_i × s_i.
    base_theta_x, base_theta_y : ndarray
        Of the universal joint at A_i, rad/rad.
    platform_theta_x, platform_theta_y : ndarray
        Of the universal joint at B_i, rad/rad.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("scenario-one")
    >>> state = exo.inverse_kinematics(exo.pose(25))
    >>> rows = wrist.joint_jacobians(exo.geometry, exo.pose(25))
    >>> moments = np.cross(state.platform_points, state.directions)  # b_i × s_i
    >>> round(float(np.abs(rows.lengths - moments).max()), 12)
    0.0
    """

    lengths: FloatArray
    base_theta_x: FloatArray
    base_theta_y: FloatArray
    platform_theta_x: FloatArray
    platform_theta_y: FloatArray


@checked
def limb_jacobian(geometry: WristGeometry, poses: Rotation) -> FloatArray:
    """Jacobian of the limb lengths, d(lengths)/dt = J ω.

    From l² = |R B - A|²: dl/dt = (b × s) · ω. By virtual work its transpose maps tensions to minus the moment
    that the limbs put on the arm about O.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    poses : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    ndarray
        Shape (..., n, 3), m/rad, rows b_i × s_i; ω in the base frame.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("four-linear-actuators")
    >>> wrist.limb_jacobian(exo.geometry, exo.pose(45)).round(3)[0]  # m/rad
    array([ 0.005, -0.112,  0.002])
    """
    state = inverse_kinematics(geometry, poses)
    return np.cross(state.platform_points, state.directions)


@checked
def joint_jacobians(geometry: WristGeometry, poses: Rotation) -> JointRows:
    """Jacobians of limb lengths and of all universal-joint angles.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    poses : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    JointRows
        d(lengths)/dt = rows.lengths ω and so on.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo, step = ep.load("prototype"), 1e-4  # degrees
    >>> rows = wrist.joint_jacobians(exo.geometry, exo.pose(30))
    >>> near = exo.inverse_kinematics(exo.pose([30 - step, 30 + step])).base_theta_x
    >>> difference = (near[1] - near[0]) / np.radians(2 * step)  # flexion turns about -y
    >>> (rows.base_theta_x @ [0.0, -1.0, 0.0] - difference).round(6) + 0.0
    array([0., 0., 0.])
    """
    shape, matrices = pose_matrices(poses)
    rows = np.empty((len(matrices), len(QUANTITIES), geometry.limb_count, 3))
    rate_stack(matrices, geometry.base_points, geometry.platform_points, rows)
    return JointRows(*(rows[:, k].reshape(*shape, *rows.shape[2:]) for k in range(len(QUANTITIES))))
