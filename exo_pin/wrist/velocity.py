"""How limb lengths change with the arm's angular velocity."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..design import WristGeometry
from ..validation import FloatArray
from .inverse import inverse_kinematics

__all__ = ["limb_jacobian"]


def limb_jacobian(geometry: WristGeometry, orientation: Rotation) -> FloatArray:
    """Jacobian of the limb lengths, d(lengths)/dt = J ω.

    From l² = |R B - A|²: dl/dt = (b × s) · ω. By virtual work its transpose maps tensions to minus the moment
    that the limbs put on the arm about O.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    orientation : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    ndarray
        Shape (..., n, 3), m/rad, rows b_i × s_i; ω in the base frame.
    """
    state = inverse_kinematics(geometry, orientation)
    return np.cross(state.platform_points, state.directions)
