"""The reaction query, through Pinocchio and ProxSuite, against the closed form and against MuJoCo."""

import numpy as np
import pytest
from mirror_image import MIRROR, mirrored
from mujoco_oracle import MujocoWrist
from wrists import (
    DEGREES,
    MECHANISMS,
    PERSON,
    exo_of,
    map_of,
    random_terms,
    regular_poses,
)

import exo_pin as ep


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


@pytest.mark.parametrize("name", MECHANISMS)
def test_pinocchio_equals_the_closed_form(name):
    mechanism = MECHANISMS[name]()
    rng = np.random.default_rng(23)
    poses = regular_poses(mechanism, rng, 200)
    assert len(poses) == 200
    motion, load = random_terms(rng, len(poses))
    splits = ["spherical", "standalone"] if mechanism.is_upu.sum() >= 3 else ["spherical"]
    for split in splits:
        for terms, closed in (
            ((None, load), map_of(mechanism, poses, None, load, split)),
            ((motion, load), map_of(mechanism, poses, motion, load, split)),
        ):
            answer = exo_of(mechanism).reaction(poses, *terms, split=split, limits="none")
            assert (answer.equilibrium_status == closed.status).all()
            scale = np.abs(closed.actuator_forces).max(axis=1) + np.abs(closed.constraint_forces).max(axis=1) + 10
            for own, other in (
                (answer.actuator_forces, closed.actuator_forces),
                (answer.constraint_forces, closed.constraint_forces),
                (answer.shoulder_force, closed.shoulder_force),
            ):
                np.testing.assert_allclose((own - other) / scale[:, None], 0, atol=1e-9)
            assert answer.residual.max() < 1e-9
            assert (answer.residual[answer.has_answer] <= 1e-9).all()


def test_no_more_is_left_over_than_the_last_digits_of_the_forces():
    exo = ep.load("three-linear-actuators")
    poses = exo.pose(*np.meshgrid(np.arange(0.0, 120.0, 5.0), np.arange(0.0, 90.0, 5.0), [-30.0, 0.0, 30.0]))
    assert np.nanmax(exo.reaction(poses, limits="none").residual) < 5e-15


@pytest.mark.parametrize("name", ["prototype", "random-3", "random-5"])
def test_pinocchio_equals_mujoco(name):
    mechanism = MECHANISMS[name]()
    rng = np.random.default_rng(24)
    poses = regular_poses(mechanism, rng, 200)
    motion, load = random_terms(rng, len(poses))
    exo, oracle, none = exo_of(mechanism), MujocoWrist(mechanism), np.zeros(3)
    still, moving = exo.reaction(poses), exo.reaction(poses, motion, load)
    assert len(poses) == 200
    for k, pose in enumerate(poses):
        for answer, terms in (
            (still, (none,) * 4),
            (moving, (motion.angular_velocity[k], motion.angular_acceleration[k], load.force[k], load.moment[k])),
        ):
            tensions, shoulder, _ = oracle.forces(pose, *terms)
            scale = max(np.abs(tensions).max(), np.abs(shoulder).max())
            np.testing.assert_allclose(answer.actuator_forces[k], tensions, atol=1e-8 * scale)
            np.testing.assert_allclose(answer.shoulder_force[k], shoulder, atol=1e-8 * scale)


def test_standalone_equals_the_chain_without_a_ball_joint(prototype):
    """Inverse dynamics of the free-flying wrist in Pinocchio, by its closure Jacobian alone."""
    import pinocchio as pin

    from exo_pin.wrist_chain import mechanism_urdf

    chain = ep.ClosedChain.from_urdf(*mechanism_urdf(prototype.mechanism, part="wrist"))
    with_shoulder = prototype.chain
    for pose in regular_poses(prototype.mechanism, np.random.default_rng(35), 5):
        start = with_shoulder.close(prototype.configurations(pose))
        q = chain.close(np.concatenate([np.zeros(3), start]))
        tau = pin.rnea(chain.model, chain.model.createData(), q, np.zeros(chain.model.nv), np.zeros(chain.model.nv))
        slides = [chain.model.joints[chain.model.getJointId(f"limb_{i}_slide")].idx_v for i in (1, 2, 3)]
        selection = np.eye(chain.model.nv)[:, slides]
        unknown = np.linalg.solve(np.hstack([chain.constraint_jacobian(q).T, selection]), tau)
        answer = prototype.reaction(pose, split="standalone", limits="none")
        np.testing.assert_allclose(-unknown[-3:], answer.actuator_forces, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(answer.shoulder_force, 0, atol=1e-9)


@pytest.mark.parametrize("split", ["spherical", "minimal", "standalone"])
def test_right_shoulder_is_the_mirror_image(split):
    left, right = (ep.load("prototype", side=side).worn_by(PERSON) for side in ("left", "right"))
    poses = regular_poses(left.mechanism, np.random.default_rng(36), 20)
    lower, upper = np.array([-5.0, -20, -1]), np.array([30.0, 2, 8])
    bounds = {"left": None, "right": None}
    if split == "minimal":
        bounds = {"left": (lower, upper), "right": (-upper, -lower)}
    a = left.reaction(poses, split=split, constraint_bounds=bounds["left"])
    b = right.reaction(mirrored(poses), split=split, constraint_bounds=bounds["right"])
    scale = np.abs(a.constraint_forces).max() + 1
    np.testing.assert_allclose(b.actuator_forces, a.actuator_forces, atol=1e-9 * scale)
    np.testing.assert_allclose(b.constraint_forces, -a.constraint_forces, atol=1e-8 * scale)
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ MIRROR, atol=1e-8 * scale)
    np.testing.assert_allclose(b.determinant, a.determinant, atol=1e-12)


def test_cuff_and_harness(prototype):
    exo = prototype.worn_by(PERSON)
    pose = ep.shoulder_rotation(30, 20, 0, **DEGREES)
    motion = ep.Motion([1.0, -2.0, 0.5], [3.0, 1.0, -2.0])
    load = ep.Load([0, 0, -5.0], at=[0, 0, -0.5])
    answer = exo.reaction(pose, motion, load)
    # The person's arm alone: cuff, shoulder, its weight, the load and its inertia balance.
    own = exo.arm.person
    assert own.mass == pytest.approx(PERSON.mass)
    centre = pose.as_matrix() @ own.centre_of_mass
    omega, eta = motion.angular_velocity, motion.angular_acceleration
    acceleration = np.cross(eta, centre) + np.cross(omega, np.cross(omega, centre))
    force = answer.cuff_wrench[:3] + answer.shoulder_force + own.mass * exo.mechanism.gravity + load.force
    np.testing.assert_allclose(force, own.mass * acceleration, atol=1e-9)
    # Massless limbs: what they put on the torso is what they take from the arm.
    np.testing.assert_allclose(answer.harness_wrenches, -answer.limb_wrenches, atol=1e-12)
    # Torso: harness and shoulder together carry all weight and inertia.
    total = answer.harness_wrenches[:, :3].sum(axis=0) - answer.shoulder_force
    whole = exo.arm
    c = pose.as_matrix() @ whole.centre_of_mass
    a = np.cross(eta, c) + np.cross(omega, np.cross(omega, c))
    np.testing.assert_allclose(total, whole.mass * (exo.mechanism.gravity - a) + load.force, atol=1e-9)


def test_leaning_trunk_mirrors(prototype):
    leaning = prototype.replace(gravity=[1.0, 2.0, -9.0])
    pose = ep.shoulder_rotation(60, 30, 10, **DEGREES)
    left, right = leaning.reaction(pose), leaning.mirrored().reaction(mirrored(pose))
    np.testing.assert_allclose(right.shoulder_force, left.shoulder_force @ MIRROR, atol=1e-9)
    lopsided = ep.Arm(2.0, [0.02, 0.05, -0.25])
    a = prototype.worn_by(lopsided).reaction(pose)
    b = ep.load("prototype", side="right").worn_by(lopsided).reaction(mirrored(pose))
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ MIRROR, atol=1e-9)
