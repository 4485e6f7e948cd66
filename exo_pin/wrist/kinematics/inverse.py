"""Inverse kinematics: limb lengths, directions and the angles of both universal joints from the pose, and their rates.

Rates are compiled, one limb at a time. With ω the arm's angular velocity, s the limb's direction, X the normal of its
plane and q_A = |a × b|/|a|, q_B = |a × b|/|b| the distances of B from the line O A and of A from the line O B:

    length       dl/dt    = (b × s) · ω           = -h X · ω
    base θx      dθ_xA/dt = (b·s)/l  X · ω        base θy      dθ_yA/dt = (b × X)/q_A · ω
    platform θx  dθ_xB/dt = -(a·s)/l X · ω        platform θy  dθ_yB/dt = (a × X)/q_B · ω

They follow from s = Ry(θy) Rx(θx) e_z in {A_i}: ∂s/∂θy = cos θx X and ∂s/∂θx = X × s, both at right angles to s, and
ds/dt = (ω × b - s dl/dt)/l. For the joint on the arm the two ends change places, and with them ω and X their signs.

Rates of limbs and universal joints from the angular velocity of the arm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.results import Result
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ...numerics.vectors import cross, dot, matrix
from ..limbs import fill_limbs, limb_stack

#: Quantities of the rows of a limb, in their order.
QUANTITIES = ("lengths", "base_theta_x", "base_theta_y", "platform_theta_x", "platform_theta_y")
__all__ = ["QUANTITIES", "JointRows", "joint_jacobians", "limb_jacobian"]


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
        The same for the joint at B_i, rad: the direction -s_i in {B_i}.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> state = exo.inverse_kinematics(exo.pose(40, 10))
    >>> ends = exo.geometry.base_points + state.lengths[:, None] * state.directions
    >>> round(float(np.abs(ends - state.platform_points).max()), 12)  # m; a_i + l_i s_i = b_i
    0.0
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

    @property
    def positions(self) -> FloatArray:
        """Positions of the drives, which are the lengths."""
        return self.lengths


@checked
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

    Examples
    --------
    >>> from exo_pin import wrist
    >>> x, y = np.radians([20.0, 50.0])
    >>> direction = np.array([np.cos(x) * np.sin(y), -np.sin(x), np.cos(x) * np.cos(y)])  # (4-25)
    >>> np.degrees(wrist.universal_angles(direction)).round(6)
    array([20., 50.])
    """
    if np.shape(direction)[-1:] != (3,):
        raise InvalidInput(f"expected direction to have shape (..., 3), got {np.shape(direction)}")
    x, y, z = np.moveaxis(direction, -1, 0)
    return np.arctan2(-y, np.hypot(x, z)), np.arctan2(x, z)


@checked
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

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("four-cables")
    >>> wrist.inverse_kinematics(exo.geometry, exo.pose(90)).lengths.round(3)  # m
    array([0.302, 0.339, 0.206, 0.404])
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


@kernel
def joint_rows(a: Any, b: Any, s: Any, X: Any, length: float, reach: float, rows: Any) -> None:
    """Write the five rows of a limb, shape (5, 3), in the order of :data:`QUANTITIES`, m/rad and rad/rad.

    A folded limb, and one without length, has no X: its angles have no rate, NaN; the rate of its length is zero.
    """
    moment = cross(b, s)
    for j in range(3):
        rows[0, j] = moment[j]
    if reach == 0.0:
        rows[1:] = np.nan
        return
    area = reach * length
    size_a, size_b = math.sqrt(dot(a, a)), math.sqrt(dot(b, b))
    b_X, a_X = cross(b, X), cross(a, X)
    along_b, along_a = dot(b, s) / length, -dot(a, s) / length
    for j in range(3):
        rows[1, j] = along_b * X[j]
        rows[2, j] = b_X[j] * size_a / area
        rows[3, j] = along_a * X[j]
        rows[4, j] = a_X[j] * size_b / area


@kernel(stack=True)
def rate_stack(R: Any, base: Any, platform: Any, rows: Any) -> None:
    """Rows of all limbs over a stack of poses, R of shape (N, 3, 3), points (n, 3), written into (N, 5, n, 3)."""
    n = base.shape[0]
    b, s, X = np.empty_like(base), np.empty_like(base), np.empty_like(base)
    length, reach = np.empty(n), np.empty(n)
    for k in range(R.shape[0]):
        fill_limbs(matrix(R[k]), base, platform, b, s, X, length, reach)
        for i in range(n):
            joint_rows(base[i], b[i], s[i], X[i], length[i], reach[i], rows[k, :, i])


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
