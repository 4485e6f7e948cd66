"""The inertial sensor: exact without errors, and errors as stated."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin import InvalidInput
from exo_pin.control import Imu, ImuSensor
from exo_pin.control.imu import PRINTED_DRIFT
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


def test_drift_grows_steadily_about_its_axis_in_the_ground():
    found = turned(Imu(TORSO, MOUNT, drift=PRINTED_DRIFT))
    axis = TORSO.inv().apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(found, PRINTED_DRIFT * TIMES[:, None] * axis, atol=1e-14)
    # Between 1° and 2° in half a minute.
    assert 1.0 < np.degrees(PRINTED_DRIFT * 30.0) < 2.0


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


def test_delayed_reading_is_the_pose_of_then():
    found = readings(Imu(TORSO, MOUNT, delay=0.035))
    for t, each in zip(TIMES, found, strict=True):
        pose, velocity = motion(max(t - 0.035, 0.0))
        # Between samples a steady turn is taken: off by α h²/8 where the speed changes by α.
        assert (each.orientation * pose.inv()).magnitude() < 1.6 * 0.01**2 / 8 + 1e-12
        np.testing.assert_allclose(each.angular_velocity, velocity, atol=1e-12)


def test_lost_sensor_repeats_the_last_reading():
    found = readings(Imu(lost=((0.5, 1.2),)))
    before = found[49].orientation.as_quat()
    for t, each in zip(TIMES, found, strict=True):
        assert each.lost == (0.5 <= t < 1.2)
        same = np.array_equal(each.orientation.as_quat(), before)
        assert same == (each.lost or t == TIMES[49])
    # Noise after the loss is that of a sensor that was not lost.
    kept, lost = (readings(Imu(noise=0.01, lost=gaps)) for gaps in ((), ((0.5, 1.2),)))
    assert np.array_equal(kept[-1].orientation.as_quat(), lost[-1].orientation.as_quat())


@pytest.mark.parametrize(
    "options",
    [
        {"noise": -1.0}, {"delay": np.nan}, {"drift": np.inf}, {"drift_axis": (0.0, 0.0, 0.0)}, {"lost": ((2.0, 1.0),)},
        {"lost": (1.0, 2.0)}, {"torso": Rotation.identity(3)}, {"mount": np.eye(3)}, {"chain": "figure 5-9"},
    ],
)  # fmt: skip
def test_bad_input_is_refused(options):
    with pytest.raises(InvalidInput):
        Imu(**options)
