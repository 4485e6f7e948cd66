"""Velocities and accelerations of limbs and universal joints from those of the arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors.checked import checked
from ...core.results import Result
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...load_case import Motion
from ...load_case.pose_stacks import as_query, pose_matrices
from ..kinematics.inverse import QUANTITIES, inverse_kinematics, rate_stack

__all__ = ["QUANTITIES", "JointMotion", "JointRows", "joint_jacobians", "joint_motion", "limb_jacobian"]


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


@dataclass(frozen=True, eq=False)
class JointMotion(Result):
    """Rates and accelerations of all limbs and universal joints, by the names in :data:`QUANTITIES`.

    Attributes
    ----------
    velocities, accelerations : dict of str to ndarray
        Each of shape (..., n), m/s and m/s² for lengths, rad/s and rad/s² for angles.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> motion = exo.joint_motion(exo.pose(30, 30), ep.Motion([0.0, -2.0, 0.0], [0.0, 0.0, 0.0]))
    >>> motion.accelerations["lengths"].round(2)  # m/s², of limbs whose arm turns steadily at 2 rad/s
    array([ 0.12, -0.05, -0.18])
    """

    velocities: dict[str, FloatArray]
    accelerations: dict[str, FloatArray]


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


def _rows(
    geometry: WristGeometry, poses: Rotation, omega: FloatArray | None
) -> tuple[tuple[int, ...], FloatArray, FloatArray]:
    """Stack shape, rows and their derivatives, shape (N, 5, n, 3)."""
    shape, matrices = pose_matrices(poses)
    rows = np.empty((len(matrices), len(QUANTITIES), geometry.limb_count, 3))
    derivatives = np.empty_like(rows) if omega is not None else np.empty((0, len(QUANTITIES), 0, 3))
    velocity = np.empty((0, 3)) if omega is None else omega
    rate_stack(matrices, geometry.base_points, geometry.platform_points, velocity, rows, derivatives)
    return shape, rows, derivatives


def _named(rows: FloatArray, shape: tuple[int, ...]) -> dict[str, FloatArray]:
    """Arrays by the names of their quantities."""
    return {name: rows[:, k].reshape(*shape, *rows.shape[2:]) for k, name in enumerate(QUANTITIES)}


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
    shape, rows, _ = _rows(geometry, poses, None)
    return JointRows(**_named(rows, shape))


@checked
def joint_motion(geometry: WristGeometry, poses: Rotation, motion: Motion) -> JointMotion:
    """Rates and accelerations of limbs and universal joints of a moving arm, J ω and J η + (dJ/dt) ω.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    poses : Rotation
        Pose, single or a stack of shape (...).
    motion : Motion
        ω and η, broadcasting to (..., 3), base frame.

    Returns
    -------
    JointMotion

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo, omega = ep.load("four-cables"), np.array([0.5, -1.0, 0.2])
    >>> found = wrist.joint_motion(exo.geometry, exo.pose(60), ep.Motion(omega, np.zeros(3)))
    >>> rates = exo.jacobian(exo.pose(60)) @ omega
    >>> round(float(np.abs(found.velocities["lengths"] - rates).max()), 12)  # J ω
    0.0
    """
    query = as_query(poses, motion)
    shape, rows, derivatives = _rows(geometry, poses, query.velocity)
    velocities = np.einsum("kqnj,kj->kqn", rows, query.velocity)
    accelerations = np.einsum("kqnj,kj->kqn", rows, query.acceleration)
    accelerations += np.einsum("kqnj,kj->kqn", derivatives, query.velocity)
    return JointMotion(_named(velocities, shape), _named(accelerations, shape))
