"""Rates of limbs and universal joints against finite differences on the rotation group, and back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import wrist
from exo_pin.design import preset

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


def test_the_row_of_a_folded_limb_is_nan_and_no_other():
    exo = ep.load("prototype")
    turn, _ = Rotation.align_vectors(exo.geometry.base_points[:1].copy(), exo.geometry.platform_points[:1].copy())
    rows = wrist.joint_jacobians(exo.geometry, turn)
    np.testing.assert_allclose(rows.lengths[0], 0, atol=1e-15)
    assert np.isnan(rows.base_theta_y[0]).all()
    assert np.isfinite(rows.base_theta_y[1:]).all()
