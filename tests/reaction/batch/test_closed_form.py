"""The closed form against printed figures, finite differences, free bodies and an independent engine."""

import mujoco
import numpy as np
import pytest
from mirror_image import MIRROR, mirrored
from mujoco_oracle import MujocoWrist
from scipy.spatial.transform import Rotation
from wrists import map_of, random_mechanism, regular_poses

from exo_pin import InvalidInput, MissingData, shoulder_rotation, thesis_rotation, wrist
from exo_pin.design import Limb, preset
from exo_pin.load_case import Load, Motion

DEGREES = {"degrees": True}


@pytest.mark.full
def test_motion_may_broadcast_in_part():
    mechanism = random_mechanism(np.random.default_rng(9), 3)
    poses = Rotation.random(4, rng=np.random.default_rng(10))
    whole = map_of(mechanism, poses, Motion(np.ones((4, 3)), np.ones((4, 3))))
    for motion in (Motion(np.ones((4, 3)), np.ones(3)), Motion(np.ones(3), np.ones((4, 3)))):
        spread = map_of(mechanism, poses, motion)
        np.testing.assert_array_equal(spread.shoulder_force, whole.shoulder_force)


def test_prototype_at_rest():
    state = wrist.inverse_kinematics(preset("prototype").replace(limbs=()).geometry, Rotation.identity())
    np.testing.assert_allclose(np.degrees(state.base_theta_y), [78.6, 83.2, -83.2], atol=0.05)
    np.testing.assert_allclose(np.degrees(state.base_theta_x), [-41.6, -65.0, -65.5], atol=0.05)
    np.testing.assert_allclose(state.lengths * 1e3, [305, 365, 366], atol=0.5)


def test_prototype_reference_forces():
    forces = map_of(preset("prototype").replace(limbs=()), thesis_rotation(40, -20, -30, **DEGREES))
    np.testing.assert_allclose(forces.actuator_forces, [0.478730, 3.732240, 13.185893], atol=1e-6)
    # Printed with six decimals from other rounding of the same numbers.
    np.testing.assert_allclose(forces.shoulder_force, [6.136294, 13.289826, -2.869032], atol=2e-6)


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


def test_sign_of_the_oracle_is_that_of_a_hanging_arm():
    oracle = MujocoWrist(preset("prototype").replace(limbs=()))
    oracle.data.qpos[:] = [1, 0, 0, 0]
    mujoco.mj_forward(oracle.model, oracle.data)
    # Its centre of mass is almost straight below O, so it hardly falls: the torso carries it, upwards.
    assert oracle.data.sensordata[2] == pytest.approx(0.65656 * 9.81, rel=0.05)


@pytest.mark.parametrize(
    "mechanism",
    [
        preset("prototype").replace(limbs=()),
        preset("prototype").replace(limbs=()).mirrored(),
        random_mechanism(np.random.default_rng(10), 3),
        random_mechanism(np.random.default_rng(11), 5, ["UPU", "SPS", "UPU", "SPS", "UPU"]),
    ],
    ids=["prototype", "prototype-right", "random-3", "random-5"],
)
def test_statics_and_dynamics_equal_mujoco(mechanism):
    rng = np.random.default_rng(12)
    poses = regular_poses(mechanism, rng, 200)
    assert len(poses) == 200
    velocity, acceleration = rng.normal(size=(2, 200, 3)) * 3
    force, moment = rng.normal(size=(2, 200, 3)) * [[[10]], [[1]]]
    motion, load = Motion(velocity, acceleration), Load(force, moment)
    still = map_of(mechanism, poses)
    moving = map_of(mechanism, poses, motion, load)
    oracle = MujocoWrist(mechanism)
    none = np.zeros(3)
    for k, pose in enumerate(poses):
        for forces, terms in (
            (still, (none, none, none, none)),
            (moving, (velocity[k], acceleration[k], force[k], moment[k])),
        ):
            tensions, shoulder, reached = oracle.forces(pose, *terms)
            scale = max(np.abs(tensions).max(), np.abs(shoulder).max())
            np.testing.assert_allclose(forces.actuator_forces[k], tensions, atol=1e-8 * scale)
            np.testing.assert_allclose(forces.shoulder_force[k], shoulder, atol=1e-8 * scale)
            # MuJoCo moves as asked when these tensions pull.
            np.testing.assert_allclose(reached, terms[1], atol=1e-8 * scale / mechanism.arm.mass)


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


def test_mirror_image():
    rng = np.random.default_rng(16)
    left = random_mechanism(rng, 3)
    right = left.mirrored()
    poses = regular_poses(left, rng, 50)
    for split, sign in (("spherical", 1), ("standalone", -1)):
        a, b = (map_of(m, p, split=split) for m, p in ((left, poses), (right, mirrored(poses))))
        np.testing.assert_allclose(b.actuator_forces, a.actuator_forces, rtol=1e-9, atol=1e-9)
        # X is a pseudovector: its coefficient changes sign.
        np.testing.assert_allclose(b.constraint_forces, sign * a.constraint_forces, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ MIRROR, rtol=1e-9, atol=1e-9)
    turned = [
        wrist.singularity(g, p).determinant for g, p in ((left.geometry, poses), (right.geometry, mirrored(poses)))
    ]
    np.testing.assert_allclose(turned[1], turned[0], atol=1e-13)


def test_singular_poses_are_marked_and_spoil_no_other():
    mechanism = preset("prototype").replace(limbs=())
    poses = thesis_rotation([40, 90, 10], [-20, 0, 0], [-30, 0, 0], **DEGREES)
    forces = map_of(mechanism, poses)
    assert forces.status.tolist() == ["ok", "singular", "ok"]
    assert np.isnan(forces.actuator_forces[1]).all()
    assert np.isnan(forces.shoulder_force[1]).all()
    assert np.isfinite(forces.actuator_forces[[0, 2]]).all()
    assert wrist.singularity(mechanism.geometry, poses).kind.tolist() == ["regular", "singular", "regular"]


def test_margin_is_that_of_the_singular_values():
    mechanism = random_mechanism(np.random.default_rng(17), 5)
    poses = Rotation.random(200, np.random.default_rng(18))
    margin = map_of(mechanism, poses).margin
    found = wrist.singularity(mechanism.geometry, poses)
    np.testing.assert_allclose(margin, found.margin, rtol=1e-9)
    assert (found.margin * found.condition >= 1 - 1e-9).all()
    assert (found.margin * found.condition <= 3 + 1e-9).all()


def test_folded_limb_is_marked():
    geometry = preset("prototype").replace(limbs=()).geometry
    # Turn the arm so that B_1 comes to lie on the line through O and A_1.
    turn, _ = Rotation.align_vectors(geometry.base_points[:1].copy(), geometry.platform_points[:1].copy())
    assert map_of(preset("prototype").replace(limbs=()), turn).status == "folded"
    assert wrist.singularity(geometry, turn).kind == "folded"
    assert np.isnan(wrist.inverse_kinematics(geometry, turn).normals[0]).all()


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


def test_stacks_keep_their_shape():
    poses = thesis_rotation(np.zeros((4, 1)), np.linspace(0.1, 0.5, 5), 0.2)
    forces = map_of(preset("prototype").replace(limbs=()), poses, Motion(np.ones(3), np.zeros((5, 3))))
    assert forces.actuator_forces.shape == (4, 5, 3)
    assert forces.status.shape == (4, 5)
    assert map_of(preset("prototype").replace(limbs=()), poses[:0]).status.shape == (0, 5)


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
