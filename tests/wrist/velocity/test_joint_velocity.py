"""The limbs' Jacobian against finite differences."""

import numpy as np
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin import wrist
from exo_pin.design import preset


def test_jacobian_against_finite_differences():
    rng = np.random.default_rng(3)
    for mechanism in (preset("prototype"), random_mechanism(rng, 5)):
        for pose in Rotation.random(20, rng):
            J = wrist.limb_jacobian(mechanism.geometry, pose)
            # Central differences: error step² times the third derivative (of order 1) plus rounding eps / step.
            step = np.finfo(float).eps ** (1 / 3)
            for axis in np.eye(3):
                ahead, behind = (
                    wrist.inverse_kinematics(
                        mechanism.geometry, Rotation.from_rotvec(sign * step * axis) * pose
                    ).lengths
                    for sign in (1, -1)
                )
                np.testing.assert_allclose(J @ axis, (ahead - behind) / (2 * step), atol=20 * step**2)
