"""Angular velocity and acceleration from quaternions of any length, against differences of rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.numerics.smoothing.smoothing_splines import continuous_quaternions, motion_of_quaternions

#: A curve of quaternions whose length changes, too: coefficients of t, t² and t³ beside a constant.
CURVE = np.array([[0.2, -0.4, 0.1, 1.3], [0.5, 0.3, -0.7, 0.2], [-0.1, 0.6, 0.2, -0.3], [0.3, -0.2, 0.4, 0.1]])


def derivatives(t):
    powers = np.array([[1, t, t**2, t**3], [0, 1, 2 * t, 3 * t**2], [0, 0, 2, 6 * t]])
    return (powers @ CURVE)[:, None]


@pytest.mark.parametrize("unit", [1.0, 0.25])
@pytest.mark.parametrize("t", [-0.7, 0.0, 0.4, 1.1])
def test_motion_is_that_of_the_rotations(t, unit):
    u, velocity, acceleration = motion_of_quaternions(derivatives(t), unit)
    np.testing.assert_allclose(np.linalg.norm(u, axis=-1), 1.0, rtol=1e-15)
    np.testing.assert_allclose(u[0], derivatives(t)[0, 0] / np.linalg.norm(derivatives(t)[0, 0]), rtol=1e-14)

    def rotation(shift):
        return Rotation.from_quat(derivatives(t + shift / unit)[0, 0])

    def rate(shift, h=1e-5):
        # In the base frame: the turn from before to after.
        return (rotation(shift + h) * rotation(shift - h).inv()).as_rotvec() / (2 * h)

    h = 1e-3
    np.testing.assert_allclose(velocity[0], rate(0.0), atol=1e-8 / unit**3)
    np.testing.assert_allclose(acceleration[0], (rate(h) - rate(-h)) / (2 * h), atol=2e-5 / unit**4)


def test_quaternions_follow_one_another_by_less_than_half_a_turn():
    """Over two turns, from readings of any sign: the fourth component goes through zero and on."""
    angles = np.linspace(0.0, 4.0 * np.pi, 60)
    axis = np.array([0.6, 0.0, 0.8])
    expected = np.concatenate([np.outer(np.sin(angles / 2), axis), np.cos(angles / 2)[:, None]], axis=1)
    signs = np.random.default_rng(55).choice([-1.0, 1.0], 60)
    found = continuous_quaternions(Rotation.from_quat(expected * signs[:, None]))
    np.testing.assert_allclose(found * signs[0], expected, atol=1e-15)
    assert (np.einsum("ij,ij->i", found[1:], found[:-1]) > 0.9).all()
