"""Modes of measured angles: which there are, and which limbs may be folded."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin import wrist
from exo_pin.wrist.kinematics.assembly import _spins
from exo_pin.wrist.limbs import STATUS, classify

pytestmark = pytest.mark.usefixtures("plain")


@pytest.mark.parametrize("n", [3, 4])
def test_angles_beyond_a_right_angle_or_unknown_have_no_pose(n):
    rng = np.random.default_rng(221)
    geometry = random_mechanism(rng, n).geometry
    angles = wrist.inverse_kinematics(geometry, Rotation.random(rng=rng)).base_theta_x
    assert wrist.forward_kinematics_from_base_angles(geometry, theta_x=angles).count > 0
    for limb in range(n):
        for wrong in (np.pi - angles[limb], -np.pi - angles[limb], angles[limb] + 2.0 * np.pi, np.nan):
            other = np.stack([angles, angles])
            other[1, limb] = wrong
            # The first three have the same sine. The pose beside them is not spoiled.
            found = wrist.forward_kinematics_from_base_angles(geometry, theta_x=other)
            assert found.valid.any(axis=1).tolist() == [True, False], wrong


def test_turns_that_meet_the_equations_are_tried_where_the_two_are_parallel():
    """A cos ψ + B sin ψ + C = 0 of both equations; where C is beyond their reach, the ψ that comes nearest."""
    rng = np.random.default_rng(222)
    for factor, beyond in ((0.4, 0.0), (-0.9, 0.0), (1.3, 1.0), (-1.3, 1.0)):
        A, B = rng.normal(size=2)
        C, scale = factor * np.hypot(A, B), 1.7
        terms = np.zeros((2, 3, 3))
        terms[0, :, 0], terms[1, :, 0] = (A, B, C), (scale * A, scale * B, scale * C)
        psi = np.full(5, np.nan)
        assert _spins(terms, 1.0, 0.0, psi) == 5
        left = np.abs(A * np.cos(psi[1:]) + B * np.sin(psi[1:]) + C)
        np.testing.assert_allclose(left, 0.3 * beyond * np.hypot(A, B), atol=1e-7)
        np.testing.assert_allclose(np.cos(psi[1] - psi[2]), 2.0 * min(1.0, factor**2) - 1.0, atol=1e-7)
    # Without ψ in the equations there is nothing to solve, and with two that differ there is one ψ.
    assert _spins(np.zeros((2, 3, 3)), 1.0, 0.0, np.empty(5)) == 1
    terms = np.zeros((2, 3, 3))
    terms[0, :, 0], terms[1, :, 0] = (
        (1.0, 0.5, -np.cos(0.3) - 0.5 * np.sin(0.3)),
        (0.2, -1.0, -0.2 * np.cos(0.3) + np.sin(0.3)),
    )
    psi = np.empty(5)
    assert _spins(terms, 1.0, 0.0, psi) == 1
    assert psi[0] == pytest.approx(0.3, abs=1e-12)


@pytest.mark.parametrize("n", [3, 4, 5])
def test_a_folded_limb_that_holds_no_plane_may_leave_the_others_to_hold_the_pose(n):
    """Of more than three limbs; of three each is needed. A universal joint's plane is lost in any case."""
    for limb, kind in ((limb, kind) for limb in range(n) for kind in ("UPU", "SPS")):
        kinds = ["UPU"] * n
        kinds[limb] = kind
        mechanism = random_mechanism(np.random.default_rng(223), n, kinds)
        a, b = mechanism.geometry.base_points[limb], mechanism.geometry.platform_points[limb]
        folded, _ = Rotation.align_vectors(a[None], b[None])
        limbs = classify(mechanism, np.array([folded.as_matrix(), Rotation.from_rotvec([0.5, 0.2, -0.4]).as_matrix()]))
        assert limbs.reach[0, limb] < 1e-15 < 1e-3 < np.delete(limbs.reach[0], limb).min()
        names = [STATUS[code] for code in limbs.status]
        assert names == ["folded" if kind == "UPU" or n == 3 else "ok", "ok"]
