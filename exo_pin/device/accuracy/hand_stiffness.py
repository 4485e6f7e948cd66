"""How far the hand gives way while the drives stand: the arm turns in a soft cuff.

Locked limbs keep their lengths, shoulder joint, limbs and frame are rigid, and limbs carry no side force. The cuff with
stiffness K (6, 6) at p gives way by ξ against the arm, and the arm turns by θ about the shoulder's centre, so that
J θ + W ξ = 0 with the rows s_i, (B_i - p) × s_i of W. With limb forces f, K ξ = -Wᵀ f and the moment of a load is Jᵀ f:

    K_θ = Jᵀ (W K⁻¹ Wᵀ)⁻¹ J.

A force F at h turns the arm by K_θ⁻¹ (h × F) and moves h by that turn × h. Assumptions: small turns, cables stay
taut. Left out is what harness, frame and drives give way by, and what weight and tensions add or take.
"""

from __future__ import annotations

import numpy as np

from ...chain import ClosedChain
from ...core.validation import FloatArray
from ...design import Interface, Mechanism
from ..protocol import Device

#: Share of the largest stiffness of a turn below which it is rounding.
_NONE = 1e-12
#: More locked limbs hold the cuff's frame more than once.
_MOST_LIMBS = 6


def hand_stiffness(device: Device, limbs: Mechanism, matrices: FloatArray, J: FloatArray) -> FloatArray:
    """Least stiffness at the hand while the drives stand, shape (N,), N/m; NaN where nobody wears the device.

    Parameters
    ----------
    device : Device
        Whose cuff, where its stiffness is known; else it is :meth:`exo_pin.Interface.upper_arm_cuff`.
    limbs : Mechanism
        Its limbs.
    matrices, J : ndarray
        N poses, shape (N, 3, 3), and rates of the lengths there, shape (N, n, 3), base frame, m/rad.
    """
    wearer = None if device.arm is None else device.arm.wearer
    known = np.isfinite(J).all(axis=(1, 2))
    found = np.full(len(J), np.nan)
    if wearer is None or limbs.limb_count > _MOST_LIMBS:
        return found
    R, J = matrices[known], J[known]
    geometry, cuff = limbs.geometry, device.interfaces.cuff
    if cuff is None:
        cuff = Interface.upper_arm_cuff(-float(geometry.platform_points[:, 2].mean()))
    # Directions of the limbs seen from the arm.
    along = geometry.platform_points - geometry.base_points @ R
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    W = np.concatenate([along, np.cross(geometry.platform_points - np.asarray(cuff.at), along)], axis=-1)
    values, turns = np.linalg.eigh(J.mT @ np.linalg.solve(W @ cuff.compliance @ W.mT, J))
    bend, straight = wearer.elbow_flexion, np.array([0.0, 0.0, -1.0])
    hand = wearer.upper_arm_length * straight
    hand += wearer.forearm_length * np.array([np.sin(bend), 0.0, -np.cos(bend)])
    # Rows are what the hand moves by for a turn about each axis of the stiffness.
    moved = np.cross(turns.mT, (R @ hand)[:, None, :])
    gives = moved / np.sqrt(np.maximum(values, _NONE * values[:, -1:]))[..., None]
    found[known] = 1.0 / np.linalg.svd(gives, compute_uv=False)[:, 0] ** 2
    return found


def cuff_distance(chain: ClosedChain) -> float:
    """How far from the shoulder's centre along the hanging arm the cuff is, m; NaN where nothing is on the arm.

    It is that of the chain's cuff where its roles name one, else the mean of the joints and loops on the arm: of a
    wrist, of its joints B_i.
    """
    model, roles, frames = chain.model, chain.roles, chain.model.frames
    if roles.cuff is not None:
        return -float(frames[model.getFrameId(roles.cuff)].placement.translation[2])
    arm = int(frames[model.getFrameId(str(roles.arm))].parentJoint)
    heights = [
        float(model.jointPlacements[k].translation[2]) for k, parent in enumerate(model.parents) if parent == arm
    ]
    for closure in chain.closures:
        for name, place in ((closure.frame_a, closure.placement_a), (closure.frame_b, closure.placement_b)):
            if closure.polynomial is None and frames[model.getFrameId(name)].parentJoint == arm:
                end = frames[model.getFrameId(name)].placement.act(np.array(place.translation))
                heights.append(float(end[2]))
    return -float(np.mean(heights)) if heights else np.nan
