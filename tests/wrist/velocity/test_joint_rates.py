"""Rates and accelerations of limbs and universal joints against finite differences on the rotation group, and back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import wrist
from exo_pin.core.errors import InvalidInput, UnknownName
from exo_pin.design import preset
from exo_pin.load_case import Motion

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
def test_rates_and_their_derivatives(geometry):
    rng = np.random.default_rng(1)
    poses = calm_poses(geometry, rng, 30)
    count = len(poses)
    assert count >= 10
    omega, eta = rng.normal(size=(2, count, 3))
    motion = Motion(omega, eta)
    rows, derivatives = (
        wrist.joint_jacobians(geometry, poses),
        wrist.joint_jacobian_derivatives(geometry, poses, motion),
    )
    joints = wrist.joint_motion(geometry, poses, motion)

    def at(t):
        # Exact to second order: rotation vector ω t + η t²/2 (their cross product enters at third order).
        return Rotation.from_rotvec(omega * t + eta * t**2 / 2) * poses

    ahead, behind = wrist.inverse_kinematics(geometry, at(STEP)), wrist.inverse_kinematics(geometry, at(-STEP))
    rows_ahead, rows_behind = wrist.joint_jacobians(geometry, at(STEP)), wrist.joint_jacobians(geometry, at(-STEP))
    motion_ahead = wrist.joint_motion(geometry, at(STEP), Motion(omega + eta * STEP, eta))
    motion_behind = wrist.joint_motion(geometry, at(-STEP), Motion(omega - eta * STEP, eta))
    for name in wrist.QUANTITIES:
        # With every joint 20° from its lock third derivatives of the angles stay below some hundred.
        tolerance = 500 * STEP**2
        velocity = difference(ahead, behind, name) / (2 * STEP)
        np.testing.assert_allclose(joints.velocities[name], velocity, atol=tolerance)
        np.testing.assert_allclose(
            np.einsum("kij,kj->ki", getattr(rows, name), omega), joints.velocities[name], atol=1e-12
        )
        slope = (getattr(rows_ahead, name) - getattr(rows_behind, name)) / (2 * STEP)
        np.testing.assert_allclose(getattr(derivatives, name), slope, atol=10 * tolerance)
        change = (motion_ahead.velocities[name] - motion_behind.velocities[name]) / (2 * STEP)
        np.testing.assert_allclose(joints.accelerations[name], change, atol=20 * tolerance)


def test_lengths_are_the_limb_jacobian():
    geometry = preset("prototype").geometry
    poses = Rotation.random(20, np.random.default_rng(2))
    np.testing.assert_allclose(
        wrist.joint_jacobians(geometry, poses).lengths, wrist.limb_jacobian(geometry, poses), atol=1e-15
    )


def test_rows_in_terms_of_the_limbs_normal():
    # (b·s)/l X for θ_x and (b × X)/q for θ_y: their determinants are those of the sensors' singularities.
    geometry = preset("prototype").geometry
    poses = Rotation.random(50, np.random.default_rng(3))
    state, rows = wrist.inverse_kinematics(geometry, poses), wrist.joint_jacobians(geometry, poses)
    along = np.einsum("kij,kij->ki", state.platform_points, state.directions)
    expected = np.prod(along / state.lengths, axis=1) * np.linalg.det(state.normals)
    np.testing.assert_allclose(np.linalg.det(rows.base_theta_x), expected, rtol=1e-9, atol=1e-15)
    area = np.linalg.norm(np.cross(geometry.base_points, state.platform_points), axis=-1)
    q = area / np.linalg.norm(geometry.base_points, axis=-1)
    expected = np.linalg.det(np.cross(state.platform_points, state.normals)) / q.prod(axis=1)
    np.testing.assert_allclose(np.linalg.det(rows.base_theta_y), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    "measured",
    [("lengths",), ("base_theta_x",), ("base_theta_y",), ("platform_theta_x",), ("base_theta_x", "base_theta_y"),
     wrist.QUANTITIES],
    ids="+".join,
)  # fmt: skip
def test_back_from_rates_to_the_arm(measured):
    geometry = preset("prototype").geometry
    rng = np.random.default_rng(4)
    poses = calm_poses(geometry, rng, 30)
    omega, eta = rng.normal(size=(2, len(poses), 3))
    joints = wrist.joint_motion(geometry, poses, Motion(omega, eta))
    back = wrist.arm_motion(
        geometry,
        poses,
        {name: joints.velocities[name] for name in measured},
        {name: joints.accelerations[name] for name in measured},
    )
    error = 1e-13 * back.condition[:, None]
    assert (np.abs(back.angular_velocity - omega) < error).all()
    assert (np.abs(back.angular_acceleration - eta) < 1e3 * error * back.condition[:, None]).all()
    assert back.residual.max() < 1e-11


def test_the_singular_row_is_nan_and_no_other():
    exo = ep.load("prototype")
    poses = ep.thesis_rotation([40, 90, 10], [-20, 0, 0], [-30, 0, 0], degrees=True)
    back = wrist.arm_motion(exo.geometry, poses, {"lengths": np.full(3, 0.1)}, {"lengths": np.zeros(3)})
    assert np.isnan(back.angular_velocity[1]).all()
    assert np.isnan(back.angular_acceleration[1]).all()
    assert np.isinf(back.condition[1])
    assert np.isfinite(back.angular_velocity[[0, 2]]).all()
    turn, _ = Rotation.align_vectors(exo.geometry.base_points[:1].copy(), exo.geometry.platform_points[:1].copy())
    rows = wrist.joint_jacobians(exo.geometry, turn)
    np.testing.assert_allclose(rows.lengths[0], 0, atol=1e-15)
    assert np.isnan(rows.base_theta_y[0]).all()
    assert np.isfinite(rows.base_theta_y[1:]).all()


def test_what_does_not_fit_is_named():
    geometry, pose = preset("prototype").geometry, Rotation.identity()
    with pytest.raises(UnknownName, match="lengths"):
        wrist.arm_motion(geometry, pose, {"length": np.zeros(3)})
    with pytest.raises(InvalidInput, match="at least one"):
        wrist.arm_motion(geometry, pose, {})
    with pytest.raises(InvalidInput, match="accelerations of lengths"):
        wrist.arm_motion(geometry, pose, {"lengths": np.zeros(3)}, {"base_theta_x": np.zeros(3)})
    with pytest.raises(InvalidInput, match="broadcast"):
        wrist.arm_motion(geometry, pose, {"lengths": np.zeros((2, 3))})
