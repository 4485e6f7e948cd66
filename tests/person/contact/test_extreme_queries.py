"""The person at the limits: no muscles needed, hardly any, ends of the range of motion, side forces of limbs."""

import numpy as np
import pytest
from mirror_image import MIRROR, mirrored
from scipy.spatial.transform import Rotation

import exo_pin as ep

GRAVITY = np.array([0.0, 0.0, -9.81])

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

PERSON = ep.Person(1.75, 75, "male")


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def random_poses(count, seed, side="left"):
    """Orientations within the range of motion, up to its ends."""
    rng = np.random.default_rng(seed)
    found = Rotation.random(60 * count, rng=rng)
    person = PERSON.on_side(side)
    return found[person.allows(found)][:count]


@pytest.mark.parametrize("side", ["left", "right"])
def test_moments_carried_at_shoulder_and_elbow_leave_the_weight_of_the_arm(side):
    """The device carries every moment as a pure one: no muscle is active, and the joint carries the arm's weight."""
    person = ep.Person(1.75, 75, "male", elbow_flexion=70, payload=1.5, side=side, degrees=True)
    poses = ep.shoulder_rotation([10, 40, 80], [20, 60, 30], [0, 10, -10], side=side, degrees=True)
    R = poses.as_matrix()
    weight, lower = person.arm.mass * GRAVITY, person.forearm.mass * GRAVITY
    about_centre = np.cross(R @ person.arm.centre_of_mass, weight)
    about_elbow = np.cross(R @ (person.forearm.centre_of_mass - person.elbow_centre), lower)
    # On the forearm a moment that holds the elbow; on the upper arm what the shoulder still needs.
    on_forearm = ep.Load(np.zeros(3), -about_elbow)
    device = np.concatenate([np.zeros((3, 3)), about_elbow - about_centre], axis=1)
    options = ep.ContactOptions(cone=None, load_on="forearm")
    result = person.joint_contact(poses, load=on_forearm, device=device, options=options)
    assert (result.status == "ok").all()
    assert result.activations.max() < 1e-9
    np.testing.assert_allclose(result.force, np.tile(-weight, (3, 1)), atol=1e-6)


@pytest.mark.parametrize("elbow", [0.0, 130.0])
def test_poses_up_to_the_ends_of_the_range_have_an_answer_or_a_reason(elbow):
    person = ep.Person(1.9, 110, "female", elbow_flexion=elbow, forearm_rotation=-90, payload=1, degrees=True)
    poses = random_poses(60, 3)
    result = person.joint_contact(poses)
    assert set(result.status) <= {"ok", "too_weak", "unstable"}
    good = result.has_result
    assert good.sum() > 20
    assert result.residual[good].max() < 1e-9
    assert (result.activations[good] >= 0.0).all()
    assert (result.activations[good] <= 1.0).all()
    v = result.components[good] / [1.0, 0.61, 0.34]
    assert (np.hypot(v[:, 1], v[:, 2]) <= v[:, 0] * (1.0 + 1e-6) + 1e-6).all()
    lost = ~good
    assert np.isnan(result.force[lost]).all()
    weak = result.status == "too_weak"
    assert (
        np.linalg.norm(result.missing_moment[weak], axis=1) + np.abs(result.missing_elbow[weak]).sum(axis=1) > 0
    ).all()


def test_sides_are_mirror_images_to_rounding_up_to_the_ends_of_the_range():
    poses = random_poses(40, 4)
    left, right = PERSON.joint_contact(poses), PERSON.on_side("right").joint_contact(mirrored(poses))
    assert (left.status == right.status).all()
    good = left.has_result
    np.testing.assert_allclose(left.force[good], right.force[good] @ MIRROR, rtol=0, atol=1e-10 * 1e3)
    np.testing.assert_allclose(left.activations[good], right.activations[good], rtol=0, atol=1e-11)


def test_side_forces_act_through_the_centre_and_are_counted_in_the_balance(prototype):
    poses = prototype.pose([20, 40, 60], [20, 50, 30], 0)
    result = prototype.joint_contact(poses, PERSON, constraint_bounds=40.0)
    plain = prototype.joint_contact(poses, PERSON)
    assert (np.abs(result.constraint_forces) <= 40.0 + 1e-9).all()
    np.testing.assert_allclose(result.device_forces, plain.device_forces)
    np.testing.assert_allclose(result.device_wrench[:, 3:], plain.device_wrench[:, 3:], atol=1e-9)
    state = prototype.inverse_kinematics(poses)
    pulls = np.einsum("kn,kni->ki", result.device_forces, state.directions)
    sides = np.einsum("kn,kni->ki", result.constraint_forces, state.normals)
    weight = sum(part.mass for part in prototype.arm.parts if part.device) * GRAVITY
    np.testing.assert_allclose(result.device_wrench[:, :3], weight - pulls - sides, atol=1e-9)
    # Muscles silenced, the joint would carry what the reaction reports for the same side forces.
    balance = result.device_wrench[:, :3] + PERSON.arm.mass * GRAVITY
    assert (result.magnitude <= plain.magnitude + 1e-6).all()
    silent = result.activations.max(axis=1) < 1e-6
    np.testing.assert_allclose(result.force[silent], -balance[silent], atol=1e-4)
