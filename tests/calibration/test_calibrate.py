"""Calibration: exact data give the device, another optimiser and a closed form agree; mixed-up input."""

import numpy as np
import pytest
from measured_devices import measured, measured_by_mujoco, near, poses, random_exo
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, calibration
from exo_pin.calibration.length_model import GROUPS

JOINTS = ("base_points", "platform_points")
RIGID = ("length_offsets", "base_offset", "cuff_offset", "torso_mounting", "arm_mounting")


@pytest.mark.parametrize(
    ("limbs", "offsets"),
    [(3, 0.15), (5, 0.0), *(pytest.param(*case, marks=pytest.mark.full) for case in ((4, 0.0), (6, 0.0), (6, 0.15)))],
)
def test_exact_data_give_the_device_itself(limbs, offsets):
    rng = np.random.default_rng(100 + limbs)
    exo = random_exo(rng, limbs)
    device = near(exo, rng, joints=0.005, offsets=offsets)
    unknowns = (*JOINTS, "length_offsets") if offsets else JOINTS
    arm = Rotation.random(60, rng)
    found = ep.calibrate(*measured_by_mujoco(device, arm), exo, unknowns=unknowns)
    a, b = found.joints
    np.testing.assert_allclose(a, device.base, atol=1e-11)
    np.testing.assert_allclose(b, device.platform, atol=1e-11)
    np.testing.assert_allclose(found.length_offsets, device.offsets, atol=1e-11)
    np.testing.assert_allclose(found.exo.inverse_kinematics(arm).lengths, measured(device, arm)[1] + device.offsets)
    assert not found.undetermined
    assert np.abs(found.residuals).max() < 1e-12


@pytest.mark.parametrize("limbs", [3, 5])
def test_exact_data_give_offsets_and_mountings_of_rigid_rings(limbs):
    rng = np.random.default_rng(200 + limbs)
    exo = random_exo(rng, limbs)
    device = near(exo, rng, joints=0.0, offsets=0.05, mounting=0.3, rings=(0.01, 0.015))
    # Sensors along other axes of the body, as they are often mounted.
    flip = Rotation.from_euler("XYZ", [90.0, 0.0, -90.0], degrees=True)
    device = device._replace(torso=device.torso * flip, arm=flip * device.arm)
    found = ep.calibrate(*measured_by_mujoco(device, Rotation.random(60, rng)), exo, unknowns=RIGID)
    assert (found.torso_mounting * device.torso.inv()).magnitude() < 1e-10
    assert (found.arm_mounting * device.arm.inv()).magnitude() < 1e-10
    np.testing.assert_allclose(found.centre_offset.base, (device.base - exo.geometry.base_points)[0], atol=1e-11)
    shift = (device.platform - exo.geometry.platform_points)[0]
    np.testing.assert_allclose(found.centre_offset.cuff, shift, atol=1e-11)
    np.testing.assert_array_equal(found.exo.geometry.base_points, exo.geometry.base_points)


def one_limb(seen, lengths, near_base, near_platform):
    """A and B of one limb in closed form: l² = |a|² + |b|² - 2 R : a bᵀ is linear in |a|² + |b|² and in a bᵀ."""
    R = seen.as_matrix().reshape(-1, 9)
    found = np.linalg.lstsq(np.column_stack([np.ones(len(R)), -2.0 * R]), lengths**2, rcond=None)[0]
    left, sizes, right = np.linalg.svd(found[1:].reshape(3, 3))
    assert sizes[1] < 1e-9 * sizes[0]
    twins = []
    for square in np.roots([1.0, -found[0], sizes[0] ** 2]).real:
        for sign in (1.0, -1.0):
            size = np.sqrt(square)
            twins.append((sign * size * left[:, 0], sign * sizes[0] / size * right[0]))
    return min(twins, key=lambda ab: np.linalg.norm(ab[0] - near_base) + np.linalg.norm(ab[1] - near_platform)), twins


def test_one_limb_agrees_with_its_closed_form_and_has_four_twins():
    rng = np.random.default_rng(4)
    exo = ep.load("prototype")
    device = near(exo, rng)
    arm = Rotation.random(40, rng)
    seen, lengths = measured(device, arm)
    a, b = ep.calibrate(seen, lengths, exo).joints
    geometry = exo.geometry
    for i in range(3):
        (base, platform), twins = one_limb(seen, lengths[:, i], geometry.base_points[i], geometry.platform_points[i])
        np.testing.assert_allclose(a[i], base, atol=1e-10)
        np.testing.assert_allclose(b[i], platform, atol=1e-10)
        assert len(twins) == 4
        for other in twins:
            twin = np.linalg.norm(seen.apply(other[1]) - other[0], axis=1)
            np.testing.assert_allclose(twin, lengths[:, i], atol=1e-10)


def test_another_optimiser_from_another_start_finds_the_same():
    rng = np.random.default_rng(5)
    exo = random_exo(rng, 4)
    seen, lengths = measured(near(exo, rng), Rotation.random(40, rng), rng, length_noise=5e-4)
    found = ep.calibrate(seen, lengths, exo)

    def misfit(x):
        a, b = x.reshape(2, 4, 3)
        return np.concatenate([lengths[:, i] - np.linalg.norm(seen.apply(b[i]) - a[i], axis=1) for i in range(4)])

    start = np.concatenate(found.joints).ravel() + 0.01 * rng.normal(size=24)
    other = least_squares(misfit, start, method="lm", jac="3-point", xtol=1e-14, ftol=1e-14)
    np.testing.assert_allclose(np.concatenate(found.joints).ravel(), other.x, atol=1e-8)
    # Its noise is estimated from what is left.
    assert found.length_noise == pytest.approx(np.sqrt(2 * other.cost / (160 - 24)), rel=1e-9)
    assert found.length_noise == pytest.approx(5e-4, rel=0.15)
    spread = found.length_noise**2 * np.linalg.inv(other.jac.T @ other.jac)
    np.testing.assert_allclose(found.covariance, spread, rtol=1e-4, atol=1e-12)


def test_errors_of_orientations_agree_with_unknown_true_poses():
    rng = np.random.default_rng(6)
    exo, noise, turn = random_exo(rng, 3), 3e-4, np.radians(0.3)
    seen, lengths = measured(near(exo, rng), Rotation.random(25, rng), rng, noise, turn)
    found = ep.calibrate(seen, lengths, exo, length_noise=noise, orientation_noise=turn)

    def misfit(x):
        # The true pose is the measured one and a small turn, which is unknown.
        a, b = x[:18].reshape(2, 3, 3)
        turns = x[18:].reshape(-1, 3)
        ends = (Rotation.from_rotvec(turns) * seen).as_matrix() @ b.T
        left = lengths - np.linalg.norm(np.swapaxes(ends, 1, 2) - a, axis=2)
        return np.concatenate([left.ravel() / noise, turns.ravel() / turn])

    start = np.concatenate([np.concatenate(found.joints).ravel(), np.zeros(75)])
    joint = least_squares(misfit, start, jac="3-point", xtol=1e-14, ftol=1e-14)
    spread = np.linalg.inv(joint.jac.T @ joint.jac)[:18, :18]
    # First order in the errors: the difference is of second order.
    difference = (np.concatenate(found.joints).ravel() - joint.x[:18]) / np.sqrt(np.diag(spread))
    assert np.abs(difference).max() < 0.2
    np.testing.assert_allclose(found.standard_deviations, np.sqrt(np.diag(spread)), rtol=0.05)
    # Without them the estimate is worse: the weights are wrong.
    plain = ep.calibrate(seen, lengths, exo, length_noise=noise)
    assert plain.probability < 1e-6 < 0.01 < found.probability
    assert "contradict" in plain.verdict


@pytest.mark.parametrize("count", [1, 2, 3])
def test_fewer_lengths_than_unknowns_are_met_exactly(count):
    """Least squares has nothing left to do then, and says what is not determined."""
    exo, arm = ep.load("prototype"), poses(np.random.default_rng(14), 3)[:count]
    lengths = exo.inverse_kinematics(arm).lengths + 1e-3 * np.arange(3)
    found = ep.calibrate(arm, lengths, exo, length_noise=1e-3)
    assert np.abs(found.residuals).max() < 1e-12
    assert 0.0 < np.abs(found.values).max() < 3e-3
    assert len(found.undetermined) >= 18 - 3 * count
    with pytest.raises(InvalidInput, match="none"):
        calibration.pose_information(arm[:0], exo, length_noise=1e-3)


def test_result_prints_its_verdict_first():
    rng = np.random.default_rng(12)
    exo = ep.load("prototype")
    device = near(exo, rng, offsets=0.1)
    seen, lengths = measured(device, poses(rng, 30), rng, 3e-4)
    lengths[4, 1] += 0.02
    found = ep.calibrate(seen, lengths, exo, unknowns=GROUPS, length_noise=3e-4)
    text = str(found)
    assert text.startswith(found.verdict)
    # With all unknown, the scale too is.
    assert sum(direction.is_exact for direction in found.undetermined) == 13
    assert f"do not determine {len(found.undetermined)} of 34 directions" in found.verdict
    for words in (
        "pose 4, limb 2: +",
        "length offset 3, mm",
        "torso mounting, deg",
    ):
        assert words in text
    assert "of 34" in repr(found)
