"""Elastic determination for small displacements and misalignment, against beams, limits, energy and free bodies."""

import beam_frame
import numpy as np
import pytest
from guided_limbs import GUIDE, SOFT_JOINTS, STIFFNESS, guided
from mirror_image import MIRROR, mirrored
from mujoco_oracle import MujocoWrist
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep

DEGREES = {"degrees": True}
#: Loads so much smaller displace nothing that counts: what is left is linear in the load.
FEATHER = 1e-5
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def worn():
    return ep.load("prototype").worn_by(PERSON)


@pytest.mark.parametrize("guide", [GUIDE, SOFT_JOINTS], ids=["beams", "soft-joints"])
@pytest.mark.parametrize("name", ["prototype", "random-3", "random-4"])
def test_equals_a_frame_of_beams(name, guide, worn):
    exo = worn if name == "prototype" else ep.ShoulderExo.from_mechanism(
        random_mechanism(np.random.default_rng(40), int(name[-1]))
    )  # fmt: skip
    exo = guided(exo, guide)
    exo = exo.replace(gravity=FEATHER * exo.mechanism.gravity)
    for pose in regular_poses(exo.mechanism, np.random.default_rng(41), 10, margin=0.1):
        answer = exo.reaction(pose, split="elastic")
        weight = exo.arm.mass * exo.mechanism.gravity
        moment = np.cross(pose.as_matrix() @ exo.arm.centre_of_mass, weight)
        points = exo.inverse_kinematics(pose).platform_points
        guides = [limb.guide for limb in exo.limbs]
        delta, shoulder, tensions, on_arm = beam_frame.solve(
            exo.geometry.base_points, points, guides, STIFFNESS, weight, moment
        )
        # The beams' axial stiffness is finite, 1e10 N, so the arm turns a little: relative effect about 1e-5.
        scale = np.abs(tensions).max()
        if len(tensions) == 3:
            np.testing.assert_allclose(answer.actuator_forces, tensions, atol=1e-4 * scale)
            np.testing.assert_allclose(answer.shoulder_force, shoulder, atol=1e-4 * scale)
            np.testing.assert_allclose(answer.centre_displacement, delta, atol=1e-4 * np.abs(delta).max())
            np.testing.assert_allclose(answer.limb_wrenches[:, :3], on_arm, atol=1e-4 * scale)
        else:
            # Four limbs share the tension by their own axial stiffness; the sides follow from δ all the same.
            X = exo.inverse_kinematics(pose).normals
            k = answer.side_stiffness
            expected = -(k * (X @ delta))[:, None] * X - tensions[:, None] * exo.inverse_kinematics(pose).directions
            np.testing.assert_allclose(on_arm, expected, atol=1e-4 * scale)


def test_energy_is_least(worn):
    exo = guided(worn.replace(gravity=FEATHER * worn.mechanism.gravity))
    pose = ep.shoulder_rotation(60, 30, 0, **DEGREES)
    answer = exo.reaction(pose, split="elastic")
    X, k = exo.inverse_kinematics(pose).normals, answer.side_stiffness
    load = -answer.spherical_force

    def energy(delta):
        return 0.5 * delta @ STIFFNESS @ delta + 0.5 * k @ (X @ delta) ** 2 - load @ delta

    least = energy(answer.centre_displacement)
    rng = np.random.default_rng(44)
    for step in rng.normal(size=(50, 3)) * 1e-5 * FEATHER:
        assert energy(answer.centre_displacement + step) > least


def test_reciprocity(worn):
    """The displacement along x from a force along y at O is that along y from a force along x (Maxwell, Betti)."""
    exo = guided(worn.replace(gravity=[0, 0, 0]))
    pose = ep.shoulder_rotation(60, 30, 0, **DEGREES)
    loads = [ep.Load(FEATHER * force) for force in np.eye(3)]
    flexibility = np.array([exo.reaction(pose, None, load, "elastic").centre_displacement for load in loads])
    np.testing.assert_allclose(flexibility, flexibility.T, atol=1e-6 * np.abs(flexibility).max())
    assert np.linalg.eigvalsh(flexibility)[0] > 0


def test_published_effect_of_a_shift_along_z():
    """Rest lies so near the singular surface that 20 mm along z take the forces up fifteenfold, or down."""
    exo, rest = ep.load("prototype"), Rotation.identity()
    fits, up, down = (exo.reaction(rest, centre_offset=[0, 0, z]) for z in (0.0, 0.02, -0.02))
    np.testing.assert_allclose(up.actuator_forces, [-2.26, 114.73, 113.16], atol=0.005)
    assert up.magnitude == pytest.approx(220.0, abs=0.05)
    assert down.magnitude == pytest.approx(11.8, abs=0.05)
    assert fits.magnitude == pytest.approx(exo.reaction(rest).magnitude)
    # The reason: det X, already small, shrinks nineteenfold, and tensions go with its inverse.
    assert abs(up.determinant) < abs(fits.determinant) / 15
    assert abs(down.determinant) > abs(fits.determinant)


def test_displaced_tensions_equal_mujoco(worn):
    offset = ep.CentreOffset([0.005, -0.01, 0.015], [-0.01, 0.008, 0.012])
    mechanism = worn.mechanism
    moved = mechanism.replace(
        geometry=ep.WristGeometry(
            mechanism.geometry.base_points + offset.base, mechanism.geometry.platform_points + offset.cuff
        )
    )
    oracle = MujocoWrist(moved)
    rng = np.random.default_rng(45)
    poses = regular_poses(moved, rng, 50)
    velocity, acceleration, force, moment = rng.normal(size=(4, 50, 3))
    answer = worn.reaction(poses, ep.Motion(velocity, acceleration), ep.Load(force, moment), centre_offset=offset)
    for k, pose in enumerate(poses):
        tensions, shoulder, _ = oracle.forces(pose, velocity[k], acceleration[k], force[k], moment[k])
        scale = np.abs(tensions).max()
        np.testing.assert_allclose(answer.actuator_forces[k], tensions, atol=1e-8 * scale)
        np.testing.assert_allclose(answer.shoulder_force[k], shoulder, atol=1e-8 * scale)


def test_small_misfit_alone_is_the_linear_formula(worn):
    """Without weight only the misfit loads: F_s = -K_s (K_s + K_X)⁻¹ K_X ε with ε the gap between the centres."""
    exo = guided(worn.replace(gravity=[0, 0, 0]))
    # So small that what the side forces' own lever arms do, second order in the offset, is below 1e-6.
    offset = ep.CentreOffset([1e-9, -2e-9, 1.5e-9], [2e-9, 1e-9, -1e-9])
    for pose in regular_poses(exo.mechanism, np.random.default_rng(46), 20, margin=0.05):
        answer = exo.reaction(pose, split="elastic", centre_offset=offset)
        X = exo.inverse_kinematics(pose).normals
        K_X = (X.T * answer.side_stiffness) @ X
        gap = offset.base - pose.as_matrix() @ offset.cuff
        expected = -STIFFNESS @ np.linalg.solve(STIFFNESS + K_X, K_X @ gap)
        np.testing.assert_allclose(answer.shoulder_force, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_side_wrench_does_no_work_in_the_joints(worn):
    """Its moment about each of the limb's four axes vanishes, misfit or not."""
    poses = regular_poses(worn.mechanism, np.random.default_rng(47), 30, margin=0.05)
    offset = ep.CentreOffset([0.01, -0.02, 0.015], [-0.02, 0.01, 0.02])
    answer = worn.reaction(poses, split="minimal", constraint_bounds=20.0, centre_offset=offset, limits="none")
    A, B = worn.geometry.base_points, worn.geometry.platform_points
    for k, R in enumerate(poses.as_matrix()):
        for i in range(3):
            a, b = A[i] + offset.base, R @ (B[i] + offset.cuff)
            s = (b - a) / np.linalg.norm(b - a)
            force, moment = np.split(answer.limb_wrenches[k, i], 2)
            scale = np.linalg.norm(force)
            for point, y in ((a, -A[i]), (b, -R @ B[i])):
                for axis in (y, np.cross(y, s)):
                    assert abs((moment - np.cross(point, force)) @ axis) < 1e-12 * scale
            assert force @ s == pytest.approx(-answer.actuator_forces[k, i], abs=1e-12 * scale)
    assert np.abs(answer.constraint_forces).max() == pytest.approx(20.0)


@pytest.mark.parametrize("split", ["spherical", "minimal", "elastic", "standalone"])
def test_every_split_balances_and_mirrors_with_an_offset(split, worn):
    left = guided(worn)
    poses = regular_poses(left.mechanism, np.random.default_rng(48), 15, margin=0.05)
    offset = np.array([0.008, -0.012, 0.02])
    bounds = {"constraint_bounds": (-30.0, 30.0)} if split == "minimal" else {}
    a = left.reaction(poses, split=split, centre_offset=offset, **bounds)
    b = left.mirrored().reaction(mirrored(poses), split=split, centre_offset=MIRROR @ offset, **bounds)
    assert (a.status == "ok").all()
    assert a.residual.max() < 1e-9
    scale = np.abs(a.constraint_forces).max() + np.abs(a.actuator_forces).max()
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ MIRROR, atol=1e-8 * scale)
    np.testing.assert_allclose(b.constraint_forces, -a.constraint_forces, atol=1e-8 * scale)
    np.testing.assert_allclose(b.actuator_forces, a.actuator_forces, atol=1e-8 * scale)
