"""Wrists whose joints lie in special places, exactly or nearly: parallel, equal, opposite, in one plane, in pairs."""

import numpy as np

from exo_pin import ExoPinError
from exo_pin.design import WristGeometry

#: Where the joints lie. "A" and "B" are joints of the base and of the platform; opposite ones lie on one line with O.
FAMILIES = (
    "generic", "A equal", "B equal", "A parallel", "B parallel", "A opposite", "B opposite", "A in a plane",
    "B in a plane", "both in a plane", "B of one pair, A of another", "A and B of one pair", "B in pairs",
    "same on both", "axes",
)  # fmt: skip


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def joints(family, n, rng):
    """Joint centres A and B, shapes (n, 3), m; a family is met exactly, or to 1e-12 to 1e-3 of the size."""
    A = unit(rng.normal(size=(n, 3))) * rng.uniform(0.08, 0.2, (n, 1))
    B = unit(rng.normal(size=(n, 3))) * rng.uniform(0.08, 0.3, (n, 1))
    nearly = 0.0 if rng.random() < 0.3 else 10.0 ** rng.uniform(-12, -3)
    i, j, *others = rng.permutation(n)
    off = 0.1 * nearly * unit(rng.normal(size=3))
    own, _, kind = family.partition(" ")
    if own in ("A", "B", "both") and kind == "in a plane":
        for points in {"A": [A], "B": [B], "both": [A, B]}[own]:
            points[:, 2] *= nearly
    elif kind in ("equal", "parallel", "opposite"):
        points = A if own == "A" else B
        factor = {"equal": 1.0, "parallel": rng.uniform(0.5, 2.0), "opposite": -rng.uniform(0.5, 2.0)}[kind]
        points[j] = factor * points[i] + off
    elif family == "B of one pair, A of another":
        B[j], A[others[0]] = B[i] + off, 1.2 * A[i] + off
    elif family == "A and B of one pair":
        # Two limbs in one plane through O; with three limbs that is singular in every pose.
        A[j], B[j] = -1.2 * A[i], 1.3 * B[i] + off
    elif family == "B in pairs":
        for k in range(2, n):
            B[k] = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 1.5) * B[k % 2] + 0.1 * nearly * rng.normal(size=3)
    elif family == "same on both":
        B = A + 0.1 * nearly * rng.normal(size=(n, 3))
    elif family == "axes":
        A = np.resize(0.1 * np.eye(3), (n, 3)) * rng.uniform(0.8, 1.2, (n, 1))
        B = np.resize(0.12 * np.eye(3), (n, 3)) * rng.uniform(0.8, 1.2, (n, 1)) + 0.1 * nearly * rng.normal(size=(n, 3))
    return A, B


def wrist_of(family, n, rng):
    """A geometry of the family that the package accepts; None after many that it does not."""
    for _ in range(20):
        try:
            return WristGeometry(*joints(family, n, rng))
        except ExoPinError:
            continue
    return None


def smallest_singular_value(geometry, rotations, of_planes=False):
    """Of the equations' gradients in some poses, shape (N,): zero where solutions meet.

    Of planes times the sine of the angle between a and b: the plane of a limb that is nearly folded is known no better.
    """
    a, b = unit(geometry.base_points), unit(geometry.platform_points @ np.swapaxes(rotations.as_matrix(), 1, 2))
    normals = np.cross(a, b)
    if not of_planes:
        return np.linalg.svd(normals, compute_uv=False)[:, -1]
    sine = np.linalg.norm(normals, axis=-1).min(axis=1)
    return sine * np.linalg.svd(np.cross(b, unit(normals)), compute_uv=False)[:, -1]
