"""Discrete twins: other devices that have the same lengths in all measured poses; devices from the joints of limbs.

With u = Q_Tᵀ a and v = Q_S b (joints seen from the shoulder's centre, in the frames of the sensors) and S the measured
orientation, a limb has

    (l + o)² = |u|² + |v|² - 2 u vᵀ : S.

On the rotation group 1 and the nine S_jk are linearly independent (characters of its representations), and l is no
linear function of them. Poses in general position therefore determine o, |u|² + |v|² and u vᵀ of each limb, and nothing
else. These are the same for the four

    (u, v),   (-u, -v),   (r u, v / r),   (-r u, -v / r)   with r = |v| / |u|,

a group Z2 × Z2 for each limb. A choice of one of the four for each limb is a device if the rings can be matched:

* points of a ring unknown: any choice. With both rings unknown there are 4ⁿ devices;
* points known, mounting and offset of the ring unknown: the points u_i must be those of the ring, turned and shifted.
  The mirrored ones (-u) are so wherever the ring is flat, as each ring of three joints is: turned by π about the ring's
  normal, and shifted along it by twice the ring's distance from the centre;
* points and mounting known, offset unknown: shifted alone; points and offset known: turned alone. Both are possible for
  special rings only, such as a flat one around the centre.

Poses that leave all ends S v of a limb in one plane (turns about one axis) allow the mirror image of u in this plane,
too, and in the same way that of v. All of this is enumerated; what it gives is then tested against the lengths.
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
#: Twins nearer than this part of the joints' distance from the centre are one.
_SAME = 1e-4
#: A mirror image is tried where lengths change by less than this part of that distance.
_NEARLY = 0.05


def limb_options(model: LengthModel, minima: FloatArray, measured: FloatArray) -> list[FloatArray]:
    """Of each limb u, v and o, shape (k_i, 7), that give its lengths in minima (m, p), nearly or exactly.

    The first is that of the first minimum. Where both rings are unknown, limbs of different minima may be combined.
    """
    u, v = in_sensors(model, minima)
    offsets, found = model.length_offsets(minima), []
    for i in range(model.limb_count):
        options = np.zeros((0, 7))
        for own, to, offset in zip(u[:, i], v[:, i], offsets[:, i], strict=True):
            for pair in _pairs(model.reach, own, to, measured):
                option = np.append(pair, offset)
                if np.abs(options - option).max(axis=1).min(initial=np.inf) > _SAME * model.reach:
                    options = np.concatenate([options, option[None]])
        found.append(options)
    return found


def combined(model: LengthModel, options: list[FloatArray], most: int) -> FloatArray:
    """Devices of one option a limb, (K, p), the nearest to the nominal one; their rings may not be the known ones."""
    chosen = best_combinations(model, [each[:, :3] for each in options], [each[:, 3:6] for each in options], most)
    return devices_of(model, np.stack([each[k] for each, k in zip(options, chosen.T, strict=True)], axis=1))


def devices_of(model: LengthModel, limbs: FloatArray) -> FloatArray:
    """Unknowns (K, p) of u, v and o of all limbs, shape (K, n, 7), nearest to the nominal design."""
    return placed(model, limbs[..., :3], limbs[..., 3:6], limbs[..., 6])[0]


def _pairs(reach: float, u: FloatArray, v: FloatArray, measured: FloatArray) -> FloatArray:
    """The four of a limb, and mirror images, (k, 6)."""
    ends, starts = measured @ v, u @ measured
    r = np.linalg.norm(v) / np.linalg.norm(u)
    pairs = [(s * u, v / s) for s in (1.0, -1.0, r, -r)]
    for points, mirror in ((ends, 0), (starts, 1)):
        middle = points.mean(axis=0)
        normal = np.linalg.svd(points - middle, full_matrices=False)[2][-1]
        away = (v if mirror else u) - middle
        image = middle + away - 2.0 * (away @ normal) * normal
        lengths, before = (np.linalg.norm(points - x, axis=1) for x in (image, middle + away))
        if np.sqrt(((lengths - before) ** 2).mean()) < _NEARLY * reach:
            pairs.append((u, image) if mirror else (image, v))
    return np.array(pairs).reshape(-1, 6)


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
