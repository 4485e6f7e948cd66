"""The mirror image in the x-z plane by its definition S R S, S = diag(1, -1, 1), for what a right side must give."""

import numpy as np
from scipy.spatial.transform import Rotation

MIRROR = np.diag([1.0, -1.0, 1.0])


def mirrored(poses):
    """Mirror image of orientations, single or a stack."""
    return Rotation.from_matrix(MIRROR @ poses.as_matrix() @ MIRROR)
