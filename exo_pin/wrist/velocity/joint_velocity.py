"""Velocities and accelerations of limbs and universal joints from those of the arm, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, UnknownName
from ...core.validation import FloatArray, as_finite
from ...design import WristGeometry
from ...load_case import Motion
from ...load_case.pose_stacks import as_query, pose_matrices
from ...numerics.vectors import SINGULAR_MARGIN
from ..kinematics.inverse import inverse_kinematics
from .joint_rates import QUANTITIES, rate_stack

__all__ = [
    "QUANTITIES",
    "ArmMotion",
    "JointMotion",
    "JointRows",
    "arm_motion",
    "joint_jacobian_derivatives",
    "joint_jacobians",
    "joint_motion",
    "limb_jacobian",
]


@dataclass(frozen=True, eq=False)
class JointRows:
    """What turns an angular velocity ω of the arm (base frame) into rates, or the time derivative of that.

    Each is of shape (..., n, 3). NaN for the angles of a folded limb, which has no plane.

    Attributes
    ----------
    lengths : ndarray
        m/rad, rows b_i × s_i.
    base_theta_x, base_theta_y : ndarray
        Of the universal joint at A_i, rad/rad.
    platform_theta_x, platform_theta_y : ndarray
        Of the universal joint at B_i, rad/rad.
    """

    lengths: FloatArray
    base_theta_x: FloatArray
    base_theta_y: FloatArray
    platform_theta_x: FloatArray
    platform_theta_y: FloatArray


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Rates and accelerations of all limbs and universal joints, by the names in :data:`QUANTITIES`.

    Attributes
    ----------
    velocities, accelerations : dict of str to ndarray
        Each of shape (..., n), m/s and m/s² for lengths, rad/s and rad/s² for angles.
    """

    velocities: dict[str, FloatArray]
    accelerations: dict[str, FloatArray]


@dataclass(frozen=True, eq=False)
class ArmMotion:
    """Motion of the arm that fits measured rates, in the sense of least squares.

    Attributes
    ----------
    angular_velocity : ndarray
        ω, shape (..., 3), rad/s, base frame; NaN where the measured quantities do not determine it.
    angular_acceleration : ndarray or None
        η, shape (..., 3), rad/s²; None if no accelerations were given.
    residual : ndarray
        Shape (...), largest rate left unexplained, in m/s and rad/s; zero but for rounding with three measurements.
    condition : ndarray
        Shape (...), largest over smallest singular value of the rows, lengths divided by the largest |B_i|; inf where
        the motion is not determined.
    """

    angular_velocity: FloatArray
    angular_acceleration: FloatArray | None
    residual: FloatArray
    condition: FloatArray


def limb_jacobian(geometry: WristGeometry, orientation: Rotation) -> FloatArray:
    """Jacobian of the limb lengths, d(lengths)/dt = J ω.

    From l² = |R B - A|²: dl/dt = (b × s) · ω. By virtual work its transpose maps tensions to minus the moment
    that the limbs put on the arm about O.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    ndarray
        Shape (..., n, 3), m/rad, rows b_i × s_i; ω in the base frame.
    """
    state = inverse_kinematics(geometry, orientation)
    return np.cross(state.platform_points, state.directions)


def _rows(
    geometry: WristGeometry, orientation: Rotation, omega: FloatArray | None
) -> tuple[tuple[int, ...], FloatArray, FloatArray]:
    """Stack shape, rows and their derivatives, shape (N, 5, n, 3)."""
    shape, matrices = pose_matrices(orientation)
    rows = np.empty((len(matrices), len(QUANTITIES), geometry.limb_count, 3))
    derivatives = np.empty_like(rows) if omega is not None else np.empty((0, len(QUANTITIES), 0, 3))
    velocity = np.empty((0, 3)) if omega is None else omega
    rate_stack(matrices, geometry.base_points, geometry.platform_points, velocity, rows, derivatives)
    return shape, rows, derivatives


def _named(rows: FloatArray, shape: tuple[int, ...]) -> dict[str, FloatArray]:
    return {name: rows[:, k].reshape(*shape, *rows.shape[2:]) for k, name in enumerate(QUANTITIES)}


def joint_jacobians(geometry: WristGeometry, orientation: Rotation) -> JointRows:
    """Jacobians of limb lengths and of all universal-joint angles.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    JointRows
        d(lengths)/dt = rows.lengths ω and so on.
    """
    shape, rows, _ = _rows(geometry, orientation, None)
    return JointRows(**_named(rows, shape))


def joint_jacobian_derivatives(geometry: WristGeometry, orientation: Rotation, motion: Motion) -> JointRows:
    """Time derivatives of :func:`joint_jacobians` for a moving arm.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).
    motion : Motion
        Its ω is used; broadcasts to (..., 3).

    Returns
    -------
    JointRows
        Per second.
    """
    query = as_query(orientation, motion)
    shape, _, derivatives = _rows(geometry, orientation, query.velocity)
    return JointRows(**_named(derivatives, shape))


def joint_motion(geometry: WristGeometry, orientation: Rotation, motion: Motion) -> JointMotion:
    """Rates and accelerations of limbs and universal joints of a moving arm, J ω and J η + (dJ/dt) ω.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).
    motion : Motion
        ω and η, broadcasting to (..., 3), base frame.

    Returns
    -------
    JointMotion
    """
    query = as_query(orientation, motion)
    shape, rows, derivatives = _rows(geometry, orientation, query.velocity)
    velocities = np.einsum("kqnj,kj->kqn", rows, query.velocity)
    accelerations = np.einsum("kqnj,kj->kqn", rows, query.acceleration)
    accelerations += np.einsum("kqnj,kj->kqn", derivatives, query.velocity)
    return JointMotion(_named(velocities, shape), _named(accelerations, shape))


def arm_motion(
    geometry: WristGeometry,
    orientation: Rotation,
    velocities: Mapping[str, ArrayLike],
    accelerations: Mapping[str, ArrayLike] | None = None,
) -> ArmMotion:
    """Angular velocity and acceleration of the arm from measured rates, the inverse of :func:`joint_motion`.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).
    velocities : mapping of str to array_like
        One or more of :data:`QUANTITIES`, each broadcasting to (..., n). More than three rates are fitted with least
        squares, lengths divided by the largest |B_i| to stand beside angles.
    accelerations : mapping of str to array_like, optional
        The same quantities' second derivatives.

    Returns
    -------
    ArmMotion
        Where the rows have a smallest singular value below 1e-9 the motion is not determined: NaN.

    Raises
    ------
    UnknownName
        If a quantity is not one of :data:`QUANTITIES`.
    InvalidInput
        If nothing is given, a value is not finite, its shape does not fit, or accelerations are given of other
        quantities than velocities.
    """
    if not velocities:
        raise InvalidInput("expected the rates of at least one quantity")
    for name in (*velocities, *(accelerations or ())):
        if name not in QUANTITIES:
            raise UnknownName("quantity", name, QUANTITIES)
    if accelerations is not None and set(accelerations) != set(velocities):
        raise InvalidInput(
            f"expected accelerations of {', '.join(sorted(velocities))}, got {', '.join(sorted(accelerations))}"
        )
    names = [name for name in QUANTITIES if name in velocities]
    shape, all_rows, _ = _rows(geometry, orientation, None)
    radius = float(np.linalg.norm(geometry.platform_points, axis=-1).max())
    scale = np.array([1.0 / radius if name == "lengths" else 1.0 for name in names])
    picked = [QUANTITIES.index(name) for name in names]
    n = geometry.limb_count

    def stacked(values: Mapping[str, ArrayLike]) -> FloatArray:
        parts = []
        for name, weight in zip(names, scale, strict=True):
            array = as_finite(name, values[name], (n,), stack=True)
            try:
                parts.append(np.broadcast_to(array, (*shape, n)).reshape(-1, n) * weight)
            except ValueError:
                raise InvalidInput(f"expected {name} to broadcast to {(*shape, n)}, got {array.shape}") from None
        return np.concatenate(parts, axis=-1)

    rows = (all_rows[:, picked] * scale[:, None, None]).reshape(len(all_rows), -1, 3)
    known = np.isfinite(rows).all(axis=(1, 2))
    safe = np.where(known[:, None, None], rows, 0.0)
    U, singular, Vt = np.linalg.svd(safe, full_matrices=False)
    determined = known & (singular[:, 2] > SINGULAR_MARGIN)
    inverse = np.divide(1.0, singular, out=np.zeros_like(singular), where=determined[:, None])

    def solve(right: FloatArray) -> FloatArray:
        answer = np.einsum("kji,kj->ki", Vt, inverse * np.einsum("kji,kj->ki", U, right))
        answer[~determined] = np.nan
        return answer

    rates = stacked(velocities)
    omega = solve(rates)
    left = np.abs(rates - np.einsum("kij,kj->ki", safe, omega)).reshape(len(rates), len(names), n) / scale[:, None]
    residual = left.max(axis=(1, 2)) if len(rates) else np.zeros(0)
    condition = np.full(len(rates), np.inf)
    np.divide(singular[:, 0], singular[:, 2], out=condition, where=determined)
    eta = None
    if accelerations is not None:
        _, _, derivatives = _rows(geometry, orientation, np.where(determined[:, None], omega, 0.0))
        moving = (derivatives[:, picked] * scale[:, None, None]).reshape(len(rates), -1, 3)
        drift = np.einsum("kij,kj->ki", np.where(determined[:, None, None], moving, 0.0), np.nan_to_num(omega))
        eta = solve(stacked(accelerations) - drift).reshape(*shape, 3)
    return ArmMotion(omega.reshape(*shape, 3), eta, residual.reshape(shape), condition.reshape(shape))
