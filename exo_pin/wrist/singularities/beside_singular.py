"""How limb forces fall with the distance from a singular pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...design import WristGeometry
from .measures import singularity

#: Angles away from the pose, degrees.
_ANGLES = (2.0, 5.0, 10.0, 20.0)


def beside_singular(
    geometry: WristGeometry, pose: Rotation, is_upu: ArrayLike | None = None
) -> tuple[tuple[float, float], ...]:
    """Limb force (root of sum of squares) for a moment of 1 N m about the weakest axis, beside a single pose.

    Of turns by the same angle the one that leaves fastest counts, about the 26 axes to the corners, edges and faces of
    a cube.

    Returns
    -------
    tuple of (float, float)
        Angle, degrees, and force, N; angles without a bound of the force are left out.
    """
    grid = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])
    axes = grid / np.linalg.norm(grid, axis=1, keepdims=True)
    found = []
    for degrees in _ANGLES:
        poses = Rotation.from_rotvec(np.radians(degrees) * axes) * pose
        least = float(singularity(geometry, poses, is_upu).amplification.min())
        if np.isfinite(least):
            found.append((degrees, least))
    return tuple(found)
