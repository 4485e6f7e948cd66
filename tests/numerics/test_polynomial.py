"""Real roots of polynomials on [-1, 1], which forward kinematics and the nearest singular pose rest on."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.numerics.polynomial import roots_and_touches


def found(p):
    out = np.empty(32)
    return np.sort(out[: roots_and_touches(np.array(p, dtype=float), len(p) - 1, 0.0, out)])


@pytest.mark.parametrize("degree", range(1, 9))
def test_roots_are_those_that_were_put_in(degree):
    """Newton's steps alone go to and fro on either side of some of them for ever."""
    rng = np.random.default_rng(degree)
    for _ in range(200):
        real = rng.integers(0, degree // 2 + 1) * 2 + degree % 2
        inside = np.sort(rng.uniform(-0.99, 0.99, real))
        if real > 1 and np.diff(inside).min() < 1e-3:
            continue
        pairs = rng.uniform(-1.5, 1.5, (degree - real) // 2) + 1j * rng.uniform(0.05, 1.0, (degree - real) // 2)
        p = np.polynomial.polynomial.polyfromroots([*inside, *pairs, *pairs.conj()]).real
        np.testing.assert_allclose(found(p), inside, atol=1e-7)


def test_every_pose_is_among_those_of_its_lengths():
    """5,000 poses all over the rotation group, of the geometry whose limbs come near O."""
    poses = Rotation.random(5_000, rng=1)
    for name in ("prototype", "optimised-table-5-3", "optimised-table-c-2"):
        exo = ep.load(name)
        modes = exo.forward_kinematics(exo.inverse_kinematics(poses).lengths, near=poses)
        assert (modes.count >= 2).all()
        away = (modes.nearest_rotations * poses.inv()).magnitude()
        # Where modes nearly meet, the lengths' rounding moves them apart by its root.
        assert away.max() < 1e-6
        assert np.median(away) < 1e-14
