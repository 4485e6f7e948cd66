"""From the joints of each limb, as the lengths give them, to a device, and how far that is from the nominal one.

Lengths depend on u_i = Q_Tᵀ a_i and v_i = Q_S b_i, the joints in the frames of the two sensors, and on o_i alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray
from ..length_model import LengthModel

#: Missing the place of a known joint counts as much as moving an unknown one by a distance larger by one over this.
_MISSED = 0.01


def in_sensors(model: LengthModel, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """u_i and v_i of vectors of unknowns (..., p), shape (..., n, 3) each."""
    a, b = model.joints(values)
    torso, arm = (mounting.as_matrix() for mounting in model.mountings(values))
    return a @ torso, b @ np.swapaxes(arm, -1, -2)


def placed(model: LengthModel, u: FloatArray, v: FloatArray, offsets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unknowns, nearest to the nominal design, that have their joints there.

    Parameters
    ----------
    u, v : ndarray
        Shape (K, m, 3), of the first m limbs.
    offsets : ndarray
        Shape (K, n), o_i.

    Returns
    -------
    values : ndarray
        Shape (K, p); joints of limbs beyond m are nominal.
    missed : ndarray
        Shape (K, 2, m, 3), m: how far joints of base and platform stay from their places; where these are unknown
        instead, how far they have moved.
    """
    values, missed, m = np.zeros((len(u), model.size)), list[FloatArray](), u.shape[1]
    rings = (
        (u, model.base, model.torso, "torso_mounting", "base_offset", "base_points"),
        (v, model.platform, model.arm.inv(), "arm_mounting", "cuff_offset", "platform_points"),
    )
    for seen, nominal, start, mounting, offset, points in rings:
        turn = np.broadcast_to(start.as_matrix(), (len(u), 3, 3))
        if mounting in model.places:
            turn = _turned(seen, nominal[:m], offset in model.places)
            # Q_T = exp(θ) Q_T0; Q_S = Q_S0 exp(θ), so that Q_Sᵀ = exp(-θ) Q_S0ᵀ.
            own = (Rotation.from_matrix(turn) * start.inv()).as_rotvec()
            values[:, model.places[mounting]] = own if mounting == "torso_mounting" else -own
        moved = seen @ np.swapaxes(turn, 1, 2) - nominal[:m]
        if offset in model.places:
            values[:, model.places[offset]] = moved.mean(axis=1)
            moved = moved - moved.mean(axis=1, keepdims=True)
        if points in model.places:
            values[:, model.places[points]][:, : 3 * m] = moved.reshape(len(u), -1)
        missed.append(moved)
    if "length_offsets" in model.places:
        values[:, model.places["length_offsets"]] = offsets - model.offsets
    return values, np.stack(missed, axis=1)


def _turned(points: FloatArray, onto: FloatArray, shifted: bool) -> FloatArray:
    """Rotation matrices (K, 3, 3) that turn points (K, m, 3) onto others; after a shift, if so (Kabsch's algorithm)."""
    if shifted:
        points, onto = points - points.mean(axis=1, keepdims=True), onto - onto.mean(axis=0)
    left, _, right = np.linalg.svd(np.einsum("mi,kmj->kij", onto, points))
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    return np.asarray(left @ right)


def distances(model: LengthModel, values: FloatArray) -> FloatArray:
    """How far devices (..., p) are from the nominal one: root of the mean square over their joints, m, shape (...).

    Joints are seen from the shoulder's centre. Mountings do not count: where sensors sit says little of the device.
    """
    a, b = model.joints(values)
    moved = np.concatenate([a - model.base, b - model.platform], axis=-2)
    return np.asarray(np.sqrt((moved**2).sum(axis=-1).mean(axis=-1)))


def best_combinations(
    model: LengthModel, u: Sequence[FloatArray], v: Sequence[FloatArray], most: int
) -> NDArray[np.intp]:
    """One choice for each limb from lists of (k_i, 3): those whose rings are nearest to the nominal ones, (K, n).

    Limbs are added one by one, and the best choices kept. For rings that are unknown point by point, and not with their
    frame, the sum over limbs is the criterion, and the best are exactly those.
    """
    chosen = np.zeros((1, 0), dtype=np.intp)
    known = np.array([name not in model.places for name in ("base_points", "platform_points")])
    weights = np.where(known, 1.0 / _MISSED**2, 1.0)
    for i in range(len(u)):
        own = np.tile(np.arange(len(u[i])), len(chosen))[:, None]
        chosen = np.concatenate([np.repeat(chosen, len(u[i]), axis=0), own], axis=1)
        at, to = (np.stack([x[k][chosen[:, k]] for k in range(i + 1)], axis=1) for x in (u, v))
        values, missed = placed(model, at, to, model.offsets)
        score = ((missed**2).sum(axis=(2, 3)) * weights).sum(axis=1)
        for name in ("base_offset", "cuff_offset"):
            score = score + (i + 1) * (model.group(name, values) ** 2).sum(axis=1)
        chosen = chosen[np.argsort(score, kind="stable")[:most]]
    return chosen
