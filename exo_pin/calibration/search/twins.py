"""Discrete twins: other devices that have the same lengths in all measured poses.

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

import numpy as np

from ...core.validation import FloatArray
from ..length_model import LengthModel
from .placement import best_combinations, in_sensors, placed

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
