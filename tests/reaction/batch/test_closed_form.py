"""The closed form against printed figures, finite differences, free bodies and an independent engine."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import map_of, random_mechanism, regular_poses

from exo_pin import InvalidInput, MissingData, shoulder_rotation, thesis_rotation, wrist
from exo_pin.design import Limb, preset
from exo_pin.load_case import Load, Motion

DEGREES = {"degrees": True}


def test_prototype_at_rest():
    state = wrist.inverse_kinematics(preset("prototype").replace(limbs=()).geometry, Rotation.identity())
    np.testing.assert_allclose(np.degrees(state.base_theta_y), [78.6, 83.2, -83.2], atol=0.05)
    np.testing.assert_allclose(np.degrees(state.base_theta_x), [-41.6, -65.0, -65.5], atol=0.05)
    np.testing.assert_allclose(state.lengths * 1e3, [305, 365, 366], atol=0.5)


@pytest.mark.parametrize(
    ("pose", "expected"),
    [((0, 0, 0), (-1.3, -4.0, -6.2)), ((60, 0, 0), (-17.8, 26.5, -3.7))],
)
def test_prototype_forces_at_rest_and_in_abduction(pose, expected):
    forces = map_of(preset("prototype").replace(limbs=()), thesis_rotation(*pose, **DEGREES))
    np.testing.assert_allclose(forces.actuator_forces, expected, atol=0.06)


def test_determinant_along_abduction_and_flexion():
    geometry = preset("prototype").replace(limbs=()).geometry
    abduction = shoulder_rotation(0, [0, 30, 60, 75, 6.21], 0, **DEGREES)
    np.testing.assert_allclose(
        wrist.singularity(geometry, abduction).determinant, [-0.0143, 0.0222, 0.0074, 0.0019, 0], atol=6e-5
    )
    flexion = shoulder_rotation([30, 60, 90, 35.45], 0, 0, **DEGREES)
    np.testing.assert_allclose(
        wrist.singularity(geometry, flexion).determinant, [-0.0085, 0.0600, 0.0389, 0], atol=6e-5
    )


def test_standalone_wrist_balances_as_a_free_body():
    rng = np.random.default_rng(13)
    for mechanism in (preset("prototype").replace(limbs=()), random_mechanism(rng, 5)):
        poses = regular_poses(mechanism, rng, 100)
        forces = map_of(mechanism, poses, split="standalone")
        state = wrist.inverse_kinematics(mechanism.geometry, poses)
        pull = -forces.actuator_forces[..., None] * state.directions
        side = -forces.constraint_forces[..., None] * state.normals
        weight = mechanism.arm.mass * mechanism.gravity
        largest = np.abs(forces.constraint_forces).max(axis=-1)[:, None] + 1
        np.testing.assert_allclose((pull + side).sum(axis=1) / largest, -weight / largest, atol=1e-11)
        centre = poses.as_matrix() @ mechanism.arm.centre_of_mass
        moment = np.cross(state.platform_points, pull).sum(axis=1) + np.cross(centre, weight)
        np.testing.assert_allclose(moment / largest, 0, atol=1e-11)


def test_least_norm_of_five_limbs():
    mechanism = random_mechanism(np.random.default_rng(14), 5)
    poses = regular_poses(mechanism, np.random.default_rng(15), 50)
    f = map_of(mechanism, poses).actuator_forces
    J = wrist.limb_jacobian(mechanism.geometry, poses)
    self_stress = f - np.einsum("kni,kij,kmj,km->kn", J, np.linalg.inv(np.swapaxes(J, 1, 2) @ J), J, f)
    np.testing.assert_allclose(self_stress, 0, atol=1e-11 * np.abs(f).max())


def test_margin_is_that_of_the_singular_values():
    mechanism = random_mechanism(np.random.default_rng(17), 5)
    poses = Rotation.random(200, np.random.default_rng(18))
    margin = map_of(mechanism, poses).margin
    found = wrist.singularity(mechanism.geometry, poses)
    np.testing.assert_allclose(margin, found.margin, rtol=1e-9)
    assert (found.margin * found.condition >= 1 - 1e-9).all()
    assert (found.margin * found.condition <= 3 + 1e-9).all()


def test_load_in_either_frame_and_at_a_point():
    mechanism = preset("prototype").replace(limbs=())
    pose = thesis_rotation(40, -20, -30, **DEGREES)
    force, at = np.array([3.0, -5.0, 2.0]), np.array([0.01, 0.02, -0.4])
    base = map_of(mechanism, pose, None, Load(force, at=at))
    arm = map_of(mechanism, pose, None, Load(pose.inv().apply(force), at=at, frame="arm"))
    couple = map_of(mechanism, pose, None, Load(force, moment=np.cross(pose.apply(at), force)))
    for other in (arm, couple):
        np.testing.assert_allclose(other.actuator_forces, base.actuator_forces, rtol=1e-12)
        np.testing.assert_allclose(other.shoulder_force, base.shoulder_force, rtol=1e-12)


def test_what_is_missing_or_wrong_is_named():
    pose = Rotation.identity()
    with pytest.raises(MissingData, match=r"scenario-one.*arm mass"):
        map_of(preset("scenario-one"), pose)
    with pytest.raises(MissingData, match="inertia"):
        map_of(preset("appendix-d"), pose, Motion(np.ones(3), np.zeros(3)))
    with pytest.raises(InvalidInput, match="Rotation"):
        map_of(preset("prototype").replace(limbs=()), np.eye(3))
    with pytest.raises(InvalidInput, match="too few"):
        map_of(preset("prototype").replace(limbs=()).replace(limbs=(Limb("SPS"),) * 3), pose, split="standalone")
    with pytest.raises(InvalidInput, match="broadcast"):
        map_of(preset("prototype").replace(limbs=()), pose, Motion(np.ones((2, 3)), np.zeros(3)))
