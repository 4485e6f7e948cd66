"""The spherical 3RRR against vectors: eight inverse and four direct solutions, six singular curves."""

import itertools

import numpy as np
import pytest
from device_files import AgileEye
from scipy.spatial.transform import Rotation

from exo_pin import LoopNotClosed

EYE = AgileEye()
MOTORS = EYE.chain.roles.actuated


def random_poses(count, seed):
    """Poses well away from the singular curves."""
    found = [R for R in Rotation.random(20 * count, rng=np.random.default_rng(seed)).as_matrix()
             if EYE.sines(R).min() > 0.3]  # fmt: skip
    return found[:count]


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
