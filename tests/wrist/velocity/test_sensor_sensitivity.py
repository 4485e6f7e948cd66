"""Errors of the arm's orientation by errors of sensors on the limbs and their joints."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName, shoulder_rotation, thesis_rotation, wrist
from exo_pin.design import preset
from exo_pin.wrist import QUANTITIES

DEGREES = {"degrees": True}


@pytest.mark.parametrize("limbs", [3, 4])
def test_rows_of_every_quantity_are_its_differences(limbs):
    geometry = random_mechanism(np.random.default_rng(61), limbs).geometry
    poses = Rotation.random(6, np.random.default_rng(62))
    rows, step = wrist.joint_jacobians(geometry, poses), 1e-5
    for axis in np.eye(3):
        ahead, behind = (
            wrist.inverse_kinematics(geometry, Rotation.from_rotvec(sign * step * axis) * poses) for sign in (1, -1)
        )
        for name in QUANTITIES:
            apart = getattr(ahead, name) - getattr(behind, name)
            if name != "lengths":
                apart = (apart + np.pi) % (2.0 * np.pi) - np.pi
            np.testing.assert_allclose(getattr(rows, name) @ axis, apart / (2.0 * step), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("limbs", [3, 4])
@pytest.mark.parametrize(
    "measured", ["lengths", "base_theta_y", ("base_theta_x", "base_theta_x"), ("lengths", "base_theta_x")]
)
def test_the_sensitivity_is_the_largest_turn_by_errors_of_unit_size(limbs, measured):
    """Angles of the arm's fit to sensors with errors: lengths count by the largest |B_i| beside angles, in m alone."""
    geometry = random_mechanism(np.random.default_rng(63), limbs).geometry
    poses = Rotation.random(5, np.random.default_rng(64))
    found = wrist.sensor_sensitivity(geometry, poses, measured)
    names = (measured,) if isinstance(measured, str) else measured
    largest = np.linalg.norm(geometry.platform_points, axis=1).max()
    for k in range(len(poses)):
        pose = poses[k]
        rows = wrist.joint_jacobians(geometry, pose)
        unit = largest if len(set(names)) == 2 else 1.0
        J = np.vstack([getattr(rows, name) / (unit if name == "lengths" else 1.0) for name in names])
        assert found.kind[k] == "regular"
        # Least squares of the sensors' errors: the normal equations, and the error of unit size that turns it most.
        np.testing.assert_allclose(J.T @ J @ found.error_gain[k], J.T, rtol=0, atol=1e-9 * np.abs(J).max())
        turns, axes = np.linalg.eigh(J.T @ J)
        assert found.sensitivity[k] == pytest.approx(1.0 / np.sqrt(turns[0]), rel=1e-9)
        assert abs(found.worst_axis[k] @ axes[:, 0]) == pytest.approx(1.0, abs=1e-9)
        s, b = wrist.inverse_kinematics(geometry, pose).directions, geometry.platform_points @ pose.as_matrix().T
        np.testing.assert_allclose(found.along[k], (s * b).sum(axis=1) / np.linalg.norm(b, axis=1), atol=1e-12)
        if len(J) == 3:
            assert found.determinant[k] == pytest.approx(J[0] @ np.cross(J[1], J[2]), rel=1e-9)
        else:
            assert np.isnan(found.determinant[k])


def test_sensors_are_singular_where_two_roots_meet():
    # b·s = 0: the limb touches the sphere on which B_i moves, so its angle has an extremum.
    geometry = preset("optimised-table-c-2").geometry
    a, b = geometry.base_points[0], geometry.platform_points[0]
    ratio = np.linalg.norm(b) / np.linalg.norm(a)
    # The angle between a and b at which s is at right angles to b.
    along, across = a / np.linalg.norm(a), np.cross(a, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    target = ratio * along + np.sqrt(1 - ratio**2) * across
    pose, _ = Rotation.align_vectors(target[None], b[None] / np.linalg.norm(b))
    state = wrist.sensor_sensitivity(geometry, pose, "base_theta_x")
    assert abs(state.along[0]) < 1e-12
    assert state.kind == "singular"
    assert state.sensitivity == np.inf
    assert np.isnan(state.error_gain).all()
    # The limbs themselves hold the arm there.
    assert wrist.singularity(geometry, pose).kind == "regular"
    angles = wrist.inverse_kinematics(geometry, pose).base_theta_x
    assert wrist.forward_kinematics_from_base_angles(geometry, theta_x=angles).status == "meeting"
    # Where the limbs lose the arm, so do these sensors, but not both angles together.
    lost = thesis_rotation(90, 0, 0, **DEGREES)
    geometry = preset("prototype").geometry
    assert wrist.sensor_sensitivity(geometry, lost, "base_theta_x").kind == "singular"
    assert wrist.sensor_sensitivity(geometry, lost, ("base_theta_x", "base_theta_y")).kind == "regular"


@pytest.mark.parametrize("measured", ["base_theta_x", "base_theta_y", "lengths"])
def test_sensitivity_predicts_the_error_of_the_solved_pose(measured):
    exo = ep.load("prototype")
    pose = ep.shoulder_rotation(20, 40, 10, **DEGREES)
    state, exact = exo.sensor_sensitivity(pose, measured), exo.inverse_kinematics(pose)
    rng = np.random.default_rng(7)
    errors = rng.normal(size=(50, 3))
    # Errors that turn the arm by up to 1e-6 rad: what is of second order is then below 1e-3 of that.
    errors *= 1e-6 / state.sensitivity / np.linalg.norm(errors, axis=1)[:, None]
    read = getattr(exact, measured) + errors
    if measured == "lengths":
        modes = exo.forward_kinematics(read, near=pose)
    else:
        modes = exo.forward_kinematics_from_base_angles(**{measured[5:]: read}, near=pose)
    off = (modes.nearest_rotations * pose.inv()).as_rotvec()
    np.testing.assert_allclose(off, errors @ state.error_gain.T, atol=1e-9)
    assert np.linalg.norm(off, axis=1).max() <= 1.001e-6
    assert np.linalg.norm(off, axis=1).max() > 0.5e-6


def test_determinant_of_theta_y_sensors():
    geometry = preset("prototype").geometry
    poses = Rotation.random(20, np.random.default_rng(8))
    state = wrist.inverse_kinematics(geometry, poses)
    ours = wrist.sensor_sensitivity(geometry, poses, "base_theta_y").determinant
    locus = np.linalg.det(np.cross(state.platform_points, state.normals))
    assert (np.sign(ours) == np.sign(locus)).all()


def test_sensors_that_are_not_there_are_named():
    geometry = preset("prototype").geometry
    with pytest.raises(UnknownName, match="base_theta_x"):
        wrist.sensor_sensitivity(geometry, Rotation.identity(), "theta_x")
    with pytest.raises(InvalidInput, match="at least one"):
        wrist.sensor_sensitivity(geometry, Rotation.identity(), ())


def test_folded_sensors_have_no_rate_and_a_determinant_of_zero():
    """Where a limb's line meets O its plane, and with it the rates of its angles, is lost; its length is not."""
    geometry = random_mechanism(np.random.default_rng(203), 3).geometry
    a, b = geometry.base_points[1], geometry.platform_points[1]
    pose, _ = Rotation.align_vectors(a[None], b[None])
    for measured in ("base_theta_x", "base_theta_y"):
        found = wrist.sensor_sensitivity(geometry, pose, measured)
        assert (str(found.kind), found.sensitivity, found.determinant) == ("folded", np.inf, 0.0)
        assert np.isnan(found.error_gain).all()
        # A turn about the only axis without an effect on the other two.
        others = getattr(wrist.joint_jacobians(geometry, pose), measured)[[0, 2]]
        np.testing.assert_allclose(others @ found.worst_axis, 0.0, atol=1e-9 * np.abs(others).max())


def test_lengths_as_sensors_are_near_singular_where_the_wrist_is():
    """By the same margin, which has no unit: across the surface, and for a wrist of another size."""
    geometry = preset("prototype").geometry
    poses = shoulder_rotation(0.0, 6.21 + np.linspace(-1.0, 1.0, 61), 0.0, degrees=True)
    for size in (1.0, 20.0):
        grown = geometry.replace(
            base_points=size * geometry.base_points, platform_points=size * geometry.platform_points
        )
        ours, theirs = wrist.sensor_sensitivity(grown, poses, "lengths"), wrist.singularity(grown, poses)
        np.testing.assert_array_equal(ours.kind, theirs.kind)
        assert (ours.kind == "near").sum() > 3
        assert (ours.kind == "regular").sum() > 3
        gain = ours.error_gain
        size_of = [np.linalg.norm(rows, axis=(-2, -1)) for rows in (gain, np.linalg.inv(gain))]
        near = 3.0 / (size_of[0] * size_of[1]) < 1e-3
        np.testing.assert_array_equal(ours.kind != "regular", near)
        np.testing.assert_allclose(ours.sensitivity, theirs.amplification, rtol=1e-9)
