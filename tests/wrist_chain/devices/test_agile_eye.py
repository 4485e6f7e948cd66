"""The spherical 3RRR against vectors: eight inverse and four direct solutions, six singular curves."""

import itertools

import numpy as np
import pytest
from device_files import AgileEye, reached
from scipy.spatial.transform import Rotation

from exo_pin import LoopNotClosed, shoulder_rotation
from exo_pin.design import WristGeometry
from exo_pin.wrist import forward_kinematics

EYE = AgileEye()
MOTORS = EYE.chain.roles.actuated


def random_poses(count, seed):
    """Poses well away from the singular curves."""
    found = [R for R in Rotation.random(20 * count, rng=np.random.default_rng(seed)).as_matrix()
             if EYE.sines(R).min() > 0.3]  # fmt: skip
    return found[:count]


def test_all_pairs_of_neighbouring_axes_are_at_right_angles():
    for one, other in ((EYE.u, EYE.u), (EYE.v, EYE.v)):
        np.testing.assert_allclose(one @ other.T, np.eye(3), atol=1e-12)
    for axes in (EYE.u, EYE.v):
        np.testing.assert_allclose(np.einsum("ij,ij->i", axes, EYE.w), 0.0, atol=1e-12)


@pytest.mark.parametrize("R", random_poses(4, 0))
def test_a_pose_has_eight_ways_to_assemble_and_no_other(R):
    known = []
    for signs in itertools.product((1, -1), repeat=3):
        q = EYE.configuration(R, EYE.middles(R, signs))
        assert np.abs(EYE.chain.residual(q)).max() < 1e-12
        known.append(q[EYE.chain.configuration_slice(MOTORS[0]).start - 2 :])
    known = np.array(known)
    apart = np.abs(np.exp(1j * known[:, None]) - np.exp(1j * known)).max(axis=2) + 10 * np.eye(8)
    assert apart.min() > 0.1
    # From random angles with the arm held there the loops close in these eight ways alone, and in all of them.
    rng, held = np.random.default_rng(1), EYE.chain.locked(["root_joint"], q)
    seen = set()
    for _ in range(150):
        try:
            closed = held.close(rng.uniform(-np.pi, np.pi, held.model.nq))
        except LoopNotClosed:
            continue
        far = np.abs(np.exp(1j * known) - np.exp(1j * closed)).max(axis=1)
        assert far.min() < 1e-8
        seen.add(int(far.argmin()))
    assert seen == set(range(8))


@pytest.mark.parametrize("R", random_poses(4, 2))
def test_motor_angles_belong_to_four_poses_beside_the_four_that_all_angles_share(R):
    w = EYE.middles(R)
    # w_i across v_i: a wrist of unit vectors whose limbs are all √2 long, of which all eight solutions are found.
    modes = forward_kinematics(WristGeometry(w, EYE.v), np.full(3, np.sqrt(2.0)))
    assert int(modes.count) == 8
    poses = modes.rotations[modes.valid].as_matrix()
    folded = EYE.sines(poses).max(axis=1) < 1e-6
    assert np.count_nonzero(folded) == 4
    motors = [EYE.configuration(R, w)[EYE.chain.configuration_slice(name)] for name in MOTORS]
    for pose in poses[~folded]:
        # The same middle axes, and so the same motors.
        q = EYE.configuration(pose, w)
        assert np.abs(EYE.chain.residual(q)).max() < 1e-9
        for name, angle in zip(MOTORS, motors, strict=True):
            np.testing.assert_allclose(q[EYE.chain.configuration_slice(name)], angle, atol=1e-12)
        assert EYE.chain.mobility(q).kinds == ()
    assert min(np.abs(poses[~folded] - R).max(axis=(1, 2))) < 1e-9
    # Of all motor angles: every v_i along its u_i.
    other = EYE.middles(random_poses(1, 3)[0])
    for pose in poses[folded]:
        np.testing.assert_allclose(np.einsum("ij,ij->i", other, EYE.v @ pose.T), 0.0, atol=1e-7)


@pytest.mark.parametrize("R", random_poses(6, 4))
def test_the_drives_jacobian_is_that_of_the_vectors(R):
    w, v = EYE.middles(R), EYE.v @ R.T
    J = EYE.chain.frame_jacobian(EYE.configuration(R, w), "arm", MOTORS)[3:]
    # w_i' · v_i + w_i · v_i' = 0 with w_i' = rate u_i × w_i and v_i' = ω × v_i.
    A, b = np.cross(w, v), np.einsum("ij,ij->i", np.cross(EYE.u, w), v)
    np.testing.assert_allclose(A @ J, np.diag(b), atol=1e-10)


@pytest.mark.parametrize(("limb", "sign"), list(itertools.product(range(3), (1, -1))))
def test_on_six_curves_a_limb_folds_and_the_device_is_singular(limb, sign):
    onto = Rotation.align_vectors([sign * EYE.u[limb]], [EYE.v[limb]])[0]
    for angle in np.radians([20.0, 75.0, 200.0]):
        R = (Rotation.from_rotvec(angle * EYE.u[limb]) * onto).as_matrix()
        if np.delete(EYE.sines(R), limb).min() < 0.2:
            continue
        w = EYE.middles(R + 1e-300)
        w[limb] = EYE.w[limb]  # any direction across u_i will do
        q = EYE.configuration(R, w)
        assert np.abs(EYE.chain.residual(q)).max() < 1e-10
        mobility = EYE.chain.mobility(q)
        # With the arm held the folded limb still turns.
        assert "input" in mobility.kinds
        held = EYE.chain.locked(["root_joint"], q)
        assert held.mobility(q[4:]).degrees_of_freedom == 1


def test_off_these_curves_no_pose_is_singular():
    # Least singular value of the unit vectors w_i × v_i against the sine to the nearest curve: at least half of it.
    R = Rotation.random(20000, rng=np.random.default_rng(5)).as_matrix()
    v = np.einsum("kij,lj->kli", R, EYE.v)
    w = np.cross(EYE.u, v)
    rows = np.cross(w / np.linalg.norm(w, axis=2, keepdims=True), v)
    values = np.linalg.svd(rows, compute_uv=False)[:, 2]
    ratio = values / EYE.sines(R).min(axis=1)
    assert 0.5 < ratio.min() < 0.55


def test_the_box_is_away_from_the_curves():
    flexion, abduction, internal = np.meshgrid(
        np.linspace(0, 110, 12), np.linspace(-4, 96, 11), np.linspace(-20, 85, 11), indexing="ij"
    )
    R = shoulder_rotation(flexion.ravel(), abduction.ravel(), internal.ravel(), degrees=True).as_matrix()
    v = np.einsum("kij,lj->kli", R, EYE.v)
    w = np.cross(EYE.u, v)
    rows = np.cross(w / np.linalg.norm(w, axis=2, keepdims=True), v)
    least = np.linalg.svd(rows, compute_uv=False)[:, 2].min(), EYE.sines(R).min()
    assert 0.15 < min(least) < 0.20


def test_the_assembly_of_rest_reaches_through_the_box():
    for angles in ((90, 0, 0), (0, 90, 0), (110, 96, 85), (45, 45, -20)):
        pose = shoulder_rotation(*angles, degrees=True)
        q = reached(EYE.chain, pose)
        np.testing.assert_allclose(
            np.exp(1j * q[4:]),
            np.exp(1j * EYE.configuration(pose.as_matrix(), EYE.middles(pose.as_matrix()))[4:]),
            atol=1e-8,
        )
