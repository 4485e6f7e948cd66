"""Rotational stiffness of the arm held by limbs of given tension and spring rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_real, broadcast_to, require_type
from ...design import Mechanism
from ...load_case import Load
from ...load_case.pose_stacks import pose_matrices, require_massless
from ...numerics.analytic_vectors import cross_matrix
from ..kinematics.inverse import inverse_kinematics


@checked
def rotational_stiffness(
    mechanism: Mechanism, poses: Rotation, tensions: ArrayLike, axial_stiffness: ArrayLike, load: Load | None = None
) -> FloatArray:
    """Restoring moment on the arm about O per rad of small turns.

    With j_i = b_i × s_i, the change of the tension and the rotation of the limb's line give

        K = Σ_i (k_i j_i j_iᵀ + f_i ([s_i][b_i] - [b_i] (1 - s_i s_iᵀ) [b_i] / l_i)) - [W][C] - ...

    where [v] is the matrix of v × and the last terms are those of the weight and of the load. Where the moments
    balance and all forces have a potential, K is symmetric; the pose is stable if its symmetric part is positive
    definite.

    Parameters
    ----------
    mechanism : Mechanism
        With an arm, and massless limbs.
    poses : Rotation
        Pose, single or a stack of shape (...).
    tensions : array_like
        f_i, N, broadcasting to (..., n).
    axial_stiffness : array_like
        k_i = df_i/dl_i, N/m, broadcasting to (..., n): of muscles, at constant pressure.
    load : Load, optional
        On the arm, besides its weight; with frame "arm" it turns with the arm.

    Returns
    -------
    ndarray
        K, shape (..., 3, 3), N m/rad, base frame: a turn by the small rotation vector φ (base frame) adds the
        moment -K φ on the arm.

    Raises
    ------
    InvalidInput
        If a limb has mass, or the arrays do not fit.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("prototype").replace(arm=ep.Arm(3.7, [0.0, 0.0, -0.3]))
    >>> K = wrist.rotational_stiffness(exo.mechanism, exo.pose(), tensions=0.0, axial_stiffness=0.0)
    >>> (np.diag(K) + 0.0).round(3)  # N m/rad; a pendulum: 3.7 × 9.81 × 0.3
    array([10.889, 10.889,  0.   ])
    """
    require_massless(mechanism)
    arm = mechanism.require_arm("weight")
    shape, matrices = pose_matrices(poses)
    size = (*shape, mechanism.limb_count)
    given = {"tensions": tensions, "axial_stiffness": axial_stiffness}
    f, k = (broadcast_to(name, as_real(name, value), size) for name, value in given.items())
    state = inverse_kinematics(mechanism.geometry, poses)
    b, s, length = state.platform_points, state.directions, state.lengths
    j = np.cross(b, s)
    B, S = cross_matrix(b), cross_matrix(s)
    across = np.eye(3) - s[..., :, None] * s[..., None, :]
    geometric = S @ B - B @ across @ B / length[..., None, None]
    stiffness = (k[..., None, None] * j[..., :, None] * j[..., None, :] + f[..., None, None] * geometric).sum(axis=-3)
    R = matrices.reshape((*shape, 3, 3))
    weight = arm.mass * mechanism.gravity
    stiffness = stiffness - cross_matrix(weight) @ cross_matrix(R @ arm.centre_of_mass)
    if load is not None:
        require_type("load", load, Load)
        point = np.einsum("...ij,...j->...i", R, np.asarray(load.at))
        force, couple = np.asarray(load.force), np.asarray(load.moment)
        if load.frame == "base":
            stiffness = stiffness - cross_matrix(force) @ cross_matrix(point)
        else:
            moment = np.einsum("...ij,...j->...i", R, couple + np.cross(np.asarray(load.at), force))
            stiffness = stiffness + cross_matrix(moment)
    return np.asarray(stiffness)
