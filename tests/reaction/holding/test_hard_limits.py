"""Answers within limits where earlier versions failed: six limbs, aligned side forces, cones of stacks."""

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep


def test_a_displaced_device_has_the_forces_of_least_sum_of_squares():
    rng = np.random.default_rng(4)
    for count, split in [(4, "minimal"), (5, "minimal"), (4, "standalone"), (6, "standalone")]:
        angles = rng.uniform(0.0, 5.0, count)
        geometry = ep.WristGeometry.from_circles(0.2, 0.1, 0.1, 0.15, angles, angles + rng.uniform(-1.0, 1.0, count))
        exo = ep.ShoulderExo(geometry, ep.Arm(3.0, [0.02, 0.0, -0.25]), limbs=[ep.Limb("UPU")] * count)
        found = exo.reaction(
            Rotation.random(random_state=count), split=split, centre_offset=rng.uniform(-0.02, 0.02, 3)
        )
        state = found.source.poses.state.row(0)
        balance = np.hstack([state.moment_of_f, state.moment_of_g])
        shoulder = np.hstack([state.shoulder_of_f, state.shoulder_of_g])
        # F_s = 0 can be reached in all of these: the shortest forces that balance arm and shoulder.
        rows, target = np.vstack([balance, shoulder]), np.concatenate([state.moment, -state.shoulder])
        shortest = np.linalg.lstsq(rows, target, rcond=1e-12)[0]
        forces = np.concatenate([found.actuator_forces, found.constraint_forces])
        np.testing.assert_allclose(forces, shortest, rtol=1e-8, atol=1e-8 * np.abs(shortest).max())
