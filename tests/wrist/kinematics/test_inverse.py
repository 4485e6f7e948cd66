"""Lengths, directions and joint angles against printed figures and against one another."""

import numpy as np
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin import thesis_rotation, wrist
from exo_pin.design import preset

DEGREES = {"degrees": True}


def test_scenario_one_angles_and_lengths():
    state = wrist.inverse_kinematics(preset("scenario-one").geometry, thesis_rotation(0, 45, 45, **DEGREES))
    np.testing.assert_allclose(np.degrees(state.base_theta_y), [-64.716, -88.425, 75.7441], atol=6e-4)
    np.testing.assert_allclose(np.degrees(state.base_theta_x), [-41.179, 76.885, -23.8481], atol=1.2e-3)
    np.testing.assert_allclose(state.lengths * 1e3, [159.5270, 41.6830, 108.7461], atol=1e-4)


def test_lengths_of_a_published_pose():
    lengths = wrist.inverse_kinematics(preset("prototype").geometry, thesis_rotation(20, -30, 10, **DEGREES)).lengths
    np.testing.assert_allclose(lengths * 1e3, [262.958325, 330.503366, 384.212449], atol=5e-7)


def test_universal_angles_rebuild_both_limb_directions():
    geometry = random_mechanism(np.random.default_rng(0), 4).geometry
    poses = Rotation.random(50, np.random.default_rng(1))
    state = wrist.inverse_kinematics(geometry, poses)

    def direction(x, y):
        return np.stack([np.cos(x) * np.sin(y), -np.sin(x), np.cos(x) * np.cos(y)], axis=-1)

    base = np.einsum("nij,knj->kni", geometry.base_frames, direction(state.base_theta_x, state.base_theta_y))
    np.testing.assert_allclose(base, state.directions, atol=1e-14)
    on_arm = np.einsum(
        "nij,knj->kni", geometry.platform_frames, direction(state.platform_theta_x, state.platform_theta_y)
    )
    back = np.einsum("kij,knj->kni", poses.as_matrix(), on_arm)
    np.testing.assert_allclose(back, -state.directions, atol=1e-14)


def test_joint_frames_are_right_handed_and_point_to_the_centre():
    for mechanism in (
        preset("prototype"),
        preset("prototype").mirrored(),
        random_mechanism(np.random.default_rng(2), 5),
    ):
        geometry = mechanism.geometry
        for frames, points in (
            (geometry.base_frames, geometry.base_points),
            (geometry.platform_frames, geometry.platform_points),
        ):
            np.testing.assert_allclose(np.linalg.det(frames), 1.0, atol=1e-14)
            towards = -points / np.linalg.norm(points, axis=-1, keepdims=True)
            np.testing.assert_allclose(frames[..., 1], towards, atol=1e-15)


def test_base_frames_of_circles_are_the_printed_matrix():
    # (4-15), entry by entry.
    geometry = preset("prototype").geometry
    circles = geometry.circles
    beta = np.arctan2(circles.r_A, circles.h_A)
    for alpha, frame in zip(circles.alpha_A, geometry.base_frames, strict=True):
        ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
        printed = [[sa, -ca * sb, ca * cb], [0, cb, sb], [-ca, -sa * sb, sa * cb]]
        np.testing.assert_allclose(frame, printed, atol=1e-15)


def test_moment_arm_is_minus_reach_times_normal():
    geometry = random_mechanism(np.random.default_rng(4), 3).geometry
    state = wrist.inverse_kinematics(geometry, Rotation.random(100, np.random.default_rng(5)))
    arm = np.cross(state.platform_points, state.directions)
    np.testing.assert_allclose(arm, -state.reach[..., None] * state.normals, atol=1e-14)
    # ... so the determinants of actuation and constraint are tied.
    product = -np.prod(state.reach, axis=-1) * np.linalg.det(state.normals)
    np.testing.assert_allclose(np.linalg.det(arm), product, rtol=1e-9)
