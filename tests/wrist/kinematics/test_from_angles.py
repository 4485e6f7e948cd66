"""Forward kinematics from base angles: brute force, published example, least squares."""

import itertools

import numpy as np
import pytest
from forward_oracle import all_solutions, length_equations
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import thesis_angles, thesis_rotation, wrist
from exo_pin.design import preset

DEGREES = {"degrees": True}
GEOMETRIES = ("prototype", "appendix-d", "scenario-one", "optimised-table-5-3", "optimised-table-c-2")


@pytest.mark.parametrize("poses", [3, pytest.param(10, marks=pytest.mark.full)])
def test_theta_y_alone_against_brute_force(poses):
    rng = np.random.default_rng(4)
    starts = Rotation.random(400, rng).as_matrix()
    counts = set()
    for name in GEOMETRIES:
        geometry = preset(name).geometry
        v = geometry.platform_points / np.linalg.norm(geometry.platform_points, axis=1)[:, None]
        for pose in Rotation.random(poses, rng):
            angles = wrist.inverse_kinematics(geometry, pose).base_theta_y
            modes = wrist.forward_kinematics_from_base_angles(geometry, theta_y=angles)
            normals = np.einsum(
                "nij,nj->ni",
                geometry.base_frames,
                np.stack([np.cos(angles), np.zeros(3), -np.sin(angles)], axis=-1),
            )
            planes = all_solutions(normals, v, np.zeros(3), starts)
            again = wrist.inverse_kinematics(geometry, Rotation.from_matrix(planes)).base_theta_y
            right_side = np.abs(np.angle(np.exp(1j * (again - angles)))).max(axis=1) < 1e-6
            assert modes.count == right_side.sum()
            assert len(planes) <= 8
            counts.add(int(modes.count))
    assert {1, 2} <= counts


def test_theta_x_alone_against_brute_force_over_all_length_combinations():
    # With |b| < |a| a limb's angle may stand for two lengths, and there may be more than eight poses.
    geometry = preset("appendix-d").geometry
    rng = np.random.default_rng(5)
    starts = Rotation.random(300, rng).as_matrix()
    a, b = np.linalg.norm(geometry.base_points, axis=1), np.linalg.norm(geometry.platform_points, axis=1)
    poses = Rotation.random(300, rng)
    state = wrist.inverse_kinematics(geometry, poses)
    modes = wrist.forward_kinematics_from_base_angles(geometry, theta_x=state.base_theta_x)
    most = int(modes.count.argmax())
    assert modes.count[most] > 8
    assert modes.rotations.shape == (300, modes.count[most])
    for k in (0, 1, most):
        lengths = [
            [r for r in np.roots([1, 2 * a[i] * np.sin(x), a[i] ** 2 - b[i] ** 2]) if np.isreal(r) and r.real > 0]
            for i, x in enumerate(state.base_theta_x[k])
        ]
        total = sum(
            len(all_solutions(*length_equations(geometry, np.real(combination)), starts))
            for combination in itertools.product(*lengths)
        )
        assert modes.count[k] == total


def test_scenario_one_example_comes_back_exactly():
    exo = ep.load("scenario-one")
    pose = thesis_rotation(0, 45, 45, **DEGREES)
    state = exo.inverse_kinematics(pose)
    modes = exo.forward_kinematics_from_base_angles(state.base_theta_x, state.base_theta_y)
    assert modes.count == 1
    np.testing.assert_allclose(thesis_angles(modes.rotations[0], **DEGREES), [0, 45, 45], atol=1e-12)
    printed = exo.forward_kinematics_from_base_angles(
        np.radians([-41.179, 76.885, -23.8481]), np.radians([-64.716, -88.425, 75.7441])
    )
    # Three printed decimals, 5e-4°, times the sensitivity of this pose (about 1.5).
    np.testing.assert_allclose(thesis_angles(printed.rotations[0], **DEGREES), [0, 45, 45], atol=1.5e-3)
    assert np.degrees(printed.residual[0]) < 1e-3


def test_six_noisy_angles_are_fitted_with_least_squares():
    rng = np.random.default_rng(7)
    geometry = preset("prototype").geometry
    poses = Rotation.random(200, rng)
    state = wrist.inverse_kinematics(geometry, poses)
    exact = wrist.joint_jacobians(geometry, poses)
    gain = np.linalg.pinv(np.concatenate([exact.base_theta_x, exact.base_theta_y], axis=1))
    noise = rng.normal(size=(2, 200, 3)) * 1e-4
    modes = wrist.forward_kinematics_from_base_angles(
        geometry, state.base_theta_x + noise[0], state.base_theta_y + noise[1], near=poses
    )
    found = modes.nearest_rotations
    error = (found * poses.inv()).as_rotvec()
    predicted = np.einsum("kij,kj->ki", gain, np.concatenate(noise, axis=-1))
    # First order in errors of 1e-4: what is left is of second order, larger where a joint is near its lock.
    calm = np.linalg.norm(gain, ord=2, axis=(1, 2)) < 3
    assert calm.sum() > 50
    np.testing.assert_allclose(error[calm], predicted[calm], atol=5e-6)
    # The gradient of the sum of squares is zero: it is a minimum, not just a fit.
    again = wrist.inverse_kinematics(geometry, found)
    rows = wrist.joint_jacobians(geometry, found)
    gap_x = state.base_theta_x + noise[0] - again.base_theta_x
    gap_y = np.angle(np.exp(1j * (state.base_theta_y + noise[1] - again.base_theta_y)))
    gradient = np.einsum("kn,knj->kj", gap_x, rows.base_theta_x) + np.einsum("kn,knj->kj", gap_y, rows.base_theta_y)
    size = np.abs(rows.base_theta_y).max(axis=(1, 2))
    np.testing.assert_allclose(gradient / size[:, None], 0, atol=1e-10)
    largest = np.maximum(np.abs(gap_x).max(axis=1), np.abs(gap_y).max(axis=1))
    np.testing.assert_allclose(np.take_along_axis(modes.residual, modes.nearest[:, None], 1)[:, 0], largest, atol=1e-11)
