"""Where the joints of the limbs stand in the tree that hangs from the arm, and from where their angles count.

The joint angles that close the loops are known in closed form. The plane O A_i B_i, across X_i, holds b_i, s_i and a_i:
two of the angles are those between them. The other two are turns of X_i about b_i and about a_i.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..core.validation import FloatArray
from ..design import Mechanism
from ..wrist.limbs import classify, joint_angles
from .wrist_urdf import across

#: Joints of a limb from the arm on. An SPS limb has the first three.
_NAMES = ("platform_y", "platform_x", "slide", "base_x", "base_y")
#: Their places among what :func:`exo_pin.wrist.limbs.joint_angles` fills.
_PLACES = np.array([0, 1, 4, 2, 3])


class LimbJoints(NamedTuple):
    """Joints and ends of n limbs in a model.

    Attributes
    ----------
    upu, sps : ndarray of int
        Indices of the UPU and of the other limbs.
    first : list of int
        The joint of each limb at the arm.
    q_index, angles : ndarray of int
        Places of all joints in q, and among the 5 n angles and slides.
    upu_columns, slides : ndarray of int
        Columns in v of the joints of the UPU limbs, shape (u, 5), and of all slides, shape (n,).
    ends : list of int
        Frames of the limbs' ends on the torso.
    targets, held : ndarray, tuple of ndarray
        Where the ends belong, shape (n, 4, 4), and the indices of what the closures hold of it.
    base_points, radii : ndarray
        A_i, shape (n, 3), and |B_i|, shape (n,), m.
    about_a, about_b : ndarray
        Shape (n, 2, 3): sine and cosine per unit of X of its turn about -a_i, base frame, and about -b_i, arm frame.
    neutral : ndarray
        Angles, rad, and slides, m, in the neutral pose, where those of the joints are zero, shape (5 n,).
    """

    upu: NDArray[np.intp]
    sps: NDArray[np.intp]
    first: list[int]
    q_index: NDArray[np.intp]
    angles: NDArray[np.intp]
    upu_columns: NDArray[np.intp]
    slides: NDArray[np.intp]
    ends: list[int]
    targets: FloatArray
    held: tuple[NDArray[np.intp], ...]
    base_points: FloatArray
    radii: FloatArray
    about_a: FloatArray
    about_b: FloatArray
    neutral: FloatArray


def limb_joints(mechanism: Mechanism, model: pin.Model, closures: Any) -> LimbJoints:
    """Find the joints of the limbs in the model of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    model : pinocchio.Model
        Its tree.
    closures : RobotDescription
        Closures and frames, of :func:`exo_pin.wrist_chain.wrist_urdf.mechanism_urdf`.
    """
    upu, sps = np.flatnonzero(mechanism.is_upu), np.flatnonzero(~mechanism.is_upu)
    ids = [
        [model.getJointId(f"limb_{i + 1}_{name}") for name in _NAMES[: 5 if i in upu else 3]]
        for i in range(mechanism.limb_count)
    ]
    columns = [[model.idx_vs[j] for j in own] for own in ids]
    places = [closure.placement_b for closure in closures.closures]
    targets = np.array(
        [pin.SE3(pin.Quaternion(np.array(p.quaternion)), np.array(p.translation)).homogeneous for p in places]
    )
    held = np.ones_like(targets, dtype=bool)
    held[sps, :, :3] = False
    # The kernels are compiled for arrays that can be written.
    base_points = np.array(mechanism.geometry.base_points)
    about_a, about_b, neutral = _neutral(mechanism, base_points)
    return LimbJoints(
        upu,
        sps,
        [own[0] for own in ids],
        np.concatenate([[model.idx_qs[j] for j in own] for own in ids]),
        np.concatenate([5 * i + _PLACES[: len(own)] for i, own in enumerate(ids)]),
        np.array([columns[i] for i in upu], dtype=int).reshape(-1, 5),
        np.array([own[2] for own in columns]),
        [model.getFrameId(closure.frame_a) for closure in closures.closures],
        targets,
        held.nonzero(),
        base_points,
        np.linalg.norm(mechanism.geometry.platform_points, axis=1),
        about_a,
        about_b,
        neutral,
    )


def _neutral(mechanism: Mechanism, base: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Turns of X and joint angles of the neutral pose, as of :class:`LimbJoints`."""
    R, platform = mechanism.geometry.neutral.as_matrix(), mechanism.geometry.platform_points
    limbs = classify(mechanism, R[None])
    X = limbs.X[0] @ R
    for i in np.flatnonzero(limbs.reach[0] == 0.0):
        X[i] = across(platform[i])
    about_b = np.stack([-np.cross(platform / np.linalg.norm(platform, axis=1)[:, None], X), X], axis=1)
    X = X @ R.T
    about_a = np.stack([np.cross(base / np.linalg.norm(base, axis=1)[:, None], X), X], axis=1)
    angles = np.empty((1, mechanism.limb_count, 5))
    joint_angles(R[None], base, limbs, about_a, about_b, angles)
    return about_a, about_b, angles.reshape(-1)
