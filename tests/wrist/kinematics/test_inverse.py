"""Lengths, directions and joint angles against printed figures and against one another."""

import numpy as np
import pytest
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


def test_base_frames_of_circles_are_the_printed_matrix():
    # (4-15), entry by entry.
    geometry = preset("prototype").geometry
    circles = geometry.circles
    beta = np.arctan2(circles.r_A, circles.h_A)
    for alpha, frame in zip(circles.alpha_A, geometry.base_frames, strict=True):
        ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
        printed = [[sa, -ca * sb, ca * cb], [0, cb, sb], [-ca, -sa * sb, sa * cb]]
        np.testing.assert_allclose(frame, printed, atol=1e-15)


#: Central differences: truncation ~ step², rounding ~ eps/step; equal at the cube root of eps.
STEP = np.finfo(float).eps ** (1 / 3)


def calm_poses(geometry, rng, count):
    """Poses in which no joint is near its lock (a folded limb), where angles have unbounded derivatives."""
    poses = Rotation.random(20 * count, rng)
    state = wrist.inverse_kinematics(geometry, poses)
    radius = np.linalg.norm(geometry.platform_points, axis=1)
    short = state.lengths.min(axis=1) > 0.3 * radius.min()
    calm = short & ((state.reach / radius).min(axis=1) > 0.3) & (np.abs(state.base_theta_x).max(axis=1) < 1.2)
    calm &= np.abs(state.platform_theta_x).max(axis=1) < 1.2
    return poses[np.flatnonzero(calm)[:count]]


def geometries():
    rng = np.random.default_rng(0)
    return [preset("prototype").geometry, preset("scenario-one").geometry, random_mechanism(rng, 5).geometry]


def difference(ahead, behind, name):
    gap = getattr(ahead, name) - getattr(behind, name)
    return gap if name == "lengths" else np.angle(np.exp(1j * gap))


@pytest.mark.parametrize("geometry", geometries(), ids=["prototype", "scenario-one", "random-5"])
def test_rates_of_joints(geometry):
    rng = np.random.default_rng(1)
    poses = calm_poses(geometry, rng, 30)
    assert len(poses) >= 10
    omega = rng.normal(size=(len(poses), 3))
    rows = wrist.joint_jacobians(geometry, poses)
    ahead, behind = (wrist.inverse_kinematics(geometry, Rotation.from_rotvec(omega * t) * poses) for t in (STEP, -STEP))
    for name in wrist.QUANTITIES:
        # With every joint 20° from its lock third derivatives of the angles stay below some hundred.
        velocity = difference(ahead, behind, name) / (2 * STEP)
        found = np.einsum("kij,kj->ki", getattr(rows, name), omega)
        np.testing.assert_allclose(found, velocity, atol=500 * STEP**2)


def test_lengths_are_the_limb_jacobian():
    geometry = preset("prototype").geometry
    poses = Rotation.random(20, np.random.default_rng(2))
    np.testing.assert_allclose(
        wrist.joint_jacobians(geometry, poses).lengths, wrist.limb_jacobian(geometry, poses), atol=1e-15
    )
