"""The shortest bounded least squares by trying all sets of bounds."""

import itertools

import numpy as np


def by_enumeration(c, G, low, high):
    """|c + G z|, |z| and z, shape (m,), of the shortest minimiser, by all sets of bounds; c (3,), G (3, m)."""
    best = []
    for pattern in itertools.product((-1, 0, 1), repeat=len(low)):
        side = np.array(pattern)
        z = np.where(side < 0, low, np.where(side > 0, high, 0.0))
        if not np.isfinite(z).all():
            continue
        free = side == 0
        z[free] = -np.linalg.pinv(G[:, free], rcond=1e-11) @ (c + G @ z)
        if (z >= low - 1e-12).all() and (z <= high + 1e-12).all():
            best.append((np.linalg.norm(c + G @ z), np.linalg.norm(z), z))
    least = min(each[0] for each in best)
    return min((each for each in best if each[0] < least + 1e-12), key=lambda each: each[1])
