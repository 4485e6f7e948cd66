"""Rotational stiffness of the arm: input that is none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import heavy_limbs, random_mechanism

import exo_pin as ep
from exo_pin import wrist


@pytest.mark.parametrize("frame", [None, "base", "arm"])
@pytest.mark.parametrize("n", [3, 5])
def test_stiffness_is_the_change_of_the_moment_with_small_turns(n, frame):
    """Tensions f + k (l - l_0), the weight at its centre and a load at its point, all about O."""
    rng = np.random.default_rng(160 + n)
    mechanism = random_mechanism(rng, n)
    poses = Rotation.random(2, rng=rng)
    f, k = rng.uniform(-50.0, 50.0, (2, n)), rng.uniform(0.0, 2e3, n)
    load = None if frame is None else ep.Load(*rng.normal(size=(3, 3)) * [[20.0], [2.0], [0.2]], frame=frame)
    K = wrist.rotational_stiffness(mechanism, poses, f, k, load)
    start = wrist.inverse_kinematics(mechanism.geometry, poses).lengths
    gravity, centre = np.array(mechanism.gravity), np.array(mechanism.arm.centre_of_mass)

    def moment(row, pose):
        R = pose.as_matrix()
        b = mechanism.geometry.platform_points @ R.T
        span = b - mechanism.geometry.base_points
        length = np.linalg.norm(span, axis=1)
        pull = -(f[row] + k * (length - start[row])) / length
        total = (pull[:, None] * np.cross(b, span)).sum(axis=0) + np.cross(R @ centre, mechanism.arm.mass * gravity)
        if load is not None:
            force, couple = np.array(load.force), np.array(load.moment)
            if frame == "arm":
                force, couple = R @ force, R @ couple
            total += couple + np.cross(R @ np.array(load.at), force)
        return total

    h = 1e-4
    for row in range(2):
        for axis in range(3):
            ends = [moment(row, Rotation.from_rotvec(s * h * np.eye(3)[axis]) * poses[row]) for s in (1, -1, 2, -2)]
            slope = (8.0 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12.0 * h)
            np.testing.assert_allclose(K[row, :, axis], -slope, atol=1e-8 * np.abs(K).max())
    with pytest.raises(ep.InvalidInput, match="mass"):
        wrist.rotational_stiffness(heavy_limbs(mechanism, rng), poses, f, k)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("100", 1e4), "tensions"),
        ((True, 1e4), "tensions"),
        ((100.0, ["1", "2", "3"]), "axial_stiffness"),
        (([1.0, 2.0], 1e4), "broadcast"),
        ((100.0, 1e4, [0.0, 0.0, 1.0]), "Load"),
    ],
)
def test_what_is_no_number_is_refused(arguments, message):
    exo = ep.load("prototype")
    with pytest.raises(ep.InvalidInput, match=message):
        wrist.rotational_stiffness(exo.mechanism, exo.pose(30), *arguments)
