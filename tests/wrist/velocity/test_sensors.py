"""Shoulder angles from two inertial sensors, Figure 5-9."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin import InvalidInput, shoulder_rotation
from exo_pin.wrist import OrientationChain

DEGREES = {"degrees": True}


def scene(rng, side="left"):
    """Sensors screwed on somehow, a torso that leans and turns, an arm that moves."""
    arm_mount, torso_mount = Rotation.random(2, rng)
    torso = Rotation.random(20, rng)
    poses = shoulder_rotation(
        rng.uniform(0, 100, 20), rng.uniform(0, 80, 20), rng.uniform(-20, 80, 20), side, **DEGREES
    )
    # A sensor's reading takes its own axes to the ground's.
    return arm_mount, torso_mount, torso, poses, torso * poses * arm_mount.inv(), torso * torso_mount.inv()


@pytest.mark.parametrize("side", ["left", "right"])
def test_poses_come_back_whatever_the_torso_does(side):
    arm_mount, torso_mount, torso, poses, arm_reading, torso_reading = scene(np.random.default_rng(0), side)
    chain = OrientationChain(arm_mount, torso_mount)
    found = chain.orientation(arm_reading, torso_reading)
    assert (found * poses.inv()).magnitude().max() < 1e-14
    # The printed product, with R_GT known: R_TS' = R_GTᵀ R_GS R_SS'.
    direct = OrientationChain(arm_mount, Rotation.identity()).orientation(arm_reading, torso)
    product = np.swapaxes(torso.as_matrix(), 1, 2) @ arm_reading.as_matrix() @ arm_mount.as_matrix()
    np.testing.assert_allclose(direct.as_matrix(), product, atol=1e-14)


def test_calibration_in_a_known_pose():
    rng = np.random.default_rng(1)
    arm_mount, torso_mount, _, poses, arm_reading, torso_reading = scene(rng)
    held = shoulder_rotation(30, 10, 5, **DEGREES)
    torso = Rotation.random(50, rng)
    noise = Rotation.from_rotvec(1e-3 * rng.normal(size=(50, 3)))
    chain = OrientationChain.calibrated(
        torso * held * arm_mount.inv() * noise, torso * torso_mount.inv(), pose=held, torso_mount=torso_mount
    )
    # Fifty readings average their noise: 1e-3 √3 / √50, thrice.
    assert (chain.arm_mount * arm_mount.inv()).magnitude() < 3 * 1e-3 * np.sqrt(3 / 50)
    assert 1e-3 < chain.spread < 6e-3
    assert (chain.orientation(arm_reading, torso_reading) * poses.inv()).magnitude().max() < 1e-3
    exact = OrientationChain.calibrated(torso[0] * arm_mount.inv(), torso[0])
    assert (exact.arm_mount * arm_mount.inv()).magnitude() < 1e-14
    assert exact.spread < 1e-14


def test_mounts_are_single_and_a_calibration_has_readings():
    flat, none = Rotation.identity(), Rotation.from_quat(np.zeros((0, 4)))
    assert OrientationChain(flat, flat).spread == 0.0
    for mounts in ((Rotation.identity(2), flat), (flat, none)):
        with pytest.raises(InvalidInput, match="_mount to be a single rotation, got shape"):
            OrientationChain(*mounts)
    with pytest.raises(InvalidInput, match="at least one reading"):
        OrientationChain.calibrated(none, flat)
    with pytest.raises(InvalidInput, match="arm_reading"):
        OrientationChain.calibrated("flat", flat)
