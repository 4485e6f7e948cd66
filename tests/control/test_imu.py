"""The inertial sensor: exact without errors, and noise as stated."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.control import Imu, ImuSensor
from exo_pin.design import preset
from exo_pin.wrist import OrientationChain

TORSO, MOUNT = (Rotation.from_rotvec(turn) for turn in ([0.3, -0.2, 1.1], [-0.5, 0.9, 0.4]))
TIMES = np.arange(0.0, 2.0, 0.01)


def motion(t):
    """A turn about a fixed axis of the torso: pose and angular velocity."""
    axis = np.array([0.6, -0.64, 0.48])
    return Rotation.from_rotvec(0.8 * t**2 * axis) * Rotation.from_rotvec([0.1, 0.2, -0.3]), 1.6 * t * axis


def readings(imu):
    signal = ImuSensor(imu, preset("prototype"))
    return [signal.read(t, *motion(t)) for t in TIMES]


def turned(imu):
    """By how much each reading is off, rotation vectors in the base frame, shape (N, 3)."""
    return np.array(
        [(each.orientation * motion(t)[0].inv()).as_rotvec() for t, each in zip(TIMES, readings(imu), strict=True)]
    )


def test_calibration_is_exact_without_errors():
    found = readings(Imu(TORSO, MOUNT))
    assert np.abs(turned(Imu(TORSO, MOUNT))).max() < 1e-14
    velocity = np.array([each.angular_velocity for each in found])
    np.testing.assert_allclose(velocity, [motion(t)[1] for t in TIMES], atol=1e-14)
    assert not any(each.lost for each in found)


def test_chain_calibrated_on_the_sensor_itself_is_exact_and_a_wrong_one_is_not():
    bare = Imu(TORSO, MOUNT)
    held = Rotation.from_rotvec([0.2, -0.1, 0.4])
    chain = OrientationChain.calibrated(bare.reading(held), TORSO, held)
    assert np.abs(turned(Imu(TORSO, MOUNT, chain))).max() < 1e-14
    # A pose that was taken for the hanging arm, but was not, turns all poses by as much.
    wrong = OrientationChain.calibrated(bare.reading(held), TORSO)
    np.testing.assert_allclose(np.linalg.norm(turned(Imu(TORSO, MOUNT, wrong)), axis=1), held.magnitude(), atol=1e-12)


def test_noise_has_its_size_and_its_seed():
    noisy = Imu(TORSO, MOUNT, noise=0.01, velocity_noise=0.05, seed=4)
    found = turned(noisy)
    # 600 numbers: their rms is known to 2.9 %; four times that.
    assert np.sqrt((found**2).mean()) == pytest.approx(0.01, rel=0.12)
    assert np.array_equal(found, turned(noisy))
    assert not np.array_equal(found, turned(Imu(TORSO, MOUNT, noise=0.01, velocity_noise=0.05, seed=5)))
    signal = ImuSensor(noisy, preset("prototype"))
    first = signal.read(0.0, *motion(0.0)).orientation.as_quat()
    signal.reset()
    assert np.array_equal(signal.read(0.0, *motion(0.0)).orientation.as_quat(), first)
