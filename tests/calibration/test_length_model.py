"""Measured lengths and their derivatives, against MuJoCo and differences."""

import numpy as np
import pytest
from measured_devices import measured, measured_by_mujoco, near, poses, random_exo
from scipy.spatial.transform import Rotation

from exo_pin.calibration.length_model import GROUPS, LengthModel, as_unknowns


def model_of(device, unknowns=GROUPS):
    return LengthModel(device.base, device.platform, device.offsets, device.torso, device.arm, as_unknowns(unknowns))


@pytest.mark.parametrize("limbs", [3, 5])
def test_lengths_are_those_of_mujoco_with_sensors_on_torso_and_arm(limbs):
    rng = np.random.default_rng(limbs)
    device = near(random_exo(rng, limbs), rng, offsets=0.1, mounting=1.0)
    arm = poses(rng, 20)
    seen, lengths = measured_by_mujoco(device, arm)
    own, plain = measured(device, arm)
    np.testing.assert_allclose(plain, lengths, atol=1e-14)
    assert (own * seen.inv()).magnitude().max() < 1e-14
    model = model_of(device)
    np.testing.assert_allclose(model.evaluate(np.zeros(model.size), seen.as_matrix()).values, lengths, atol=1e-14)


@pytest.mark.parametrize("limbs", [3, 4, 6])
def test_derivatives_by_unknowns_and_orientation(limbs):
    rng = np.random.default_rng(10 + limbs)
    device = near(random_exo(rng, limbs), rng, offsets=0.1, mounting=1.0)
    model, arm = model_of(device), poses(rng, 12)
    assert model.size == 7 * limbs + 13 == len(model.names) == len(set(model.names))
    # Away from the start, so that the mountings' rotation vectors are large.
    values = 0.02 * rng.normal(size=model.size)
    for name in ("torso_mounting", "arm_mounting"):
        values[model.places[name]] = rng.normal(size=3)
    seen = measured(device, arm)[0].as_matrix()
    here = model.evaluate(values, seen)
    # Central differences: 1e-5² of third derivatives of some 1/m², and rounding 1e-16 / 1e-5.
    step = 1e-5
    for k in range(model.size):
        change = step * np.eye(model.size)[k]
        ahead, behind = (model.evaluate(values + sign * change, seen).values for sign in (1, -1))
        np.testing.assert_allclose(here.by_unknowns[:, :, k], (ahead - behind) / (2 * step), atol=1e-9)
    torso = model.mountings(values)[0].as_matrix()
    for k in range(3):
        turns = [torso.T @ Rotation.from_rotvec(sign * step * np.eye(3)[k]).as_matrix() @ torso for sign in (1, -1)]
        ahead, behind = (model.evaluate(values, turn @ seen).values for turn in turns)
        np.testing.assert_allclose(here.by_orientation[:, :, k], (ahead - behind) / (2 * step), atol=1e-9)
