"""The shoulder unit: the ends of its range, friction, the second flange; and where the plant rests."""

import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin.control.plant.equations.plant_kernels import stop_moment


def stop(orientation, side=1.0, w=(0.0, 0.0, 0.0), damping=0.0):
    rows = tuple(tuple(row) for row in orientation.as_matrix().tolist())
    return stop_moment(rows, w, np.pi / 2, np.radians(95.0), side, 100.0, damping)


def test_the_moment_is_minus_the_potential_s_gradient():
    rng, checked = np.random.default_rng(6), 0
    for turn in Rotation.random(300, rng=rng):
        moment, _, potential = stop(turn)
        if potential == 0.0 or abs(turn.as_matrix()[1, 2]) > 0.99:
            continue
        gradient = np.array(
            [
                (stop(Rotation.from_rotvec(h) * turn)[2] - stop(Rotation.from_rotvec(-h) * turn)[2]) / 2e-6
                for h in 1e-6 * np.eye(3)
            ]
        )
        if np.linalg.norm(gradient + moment) > 1e-4 * np.linalg.norm(gradient):
            # Where the two triples of angles are equally deep the potential has a ridge.
            assert abs(abs(turn.as_euler("YXZ")[2]) - np.pi / 2) < 0.6
            continue
        checked += 1
    assert checked > 50
