"""What a calibration took as known: effects against fits anew with the mistake, deviations that tolerances add."""

import numpy as np
import pytest
from measured_devices import measured, near, poses
from scipy.spatial.transform import Rotation

import exo_pin as ep

NOISE = 3e-4


@pytest.fixture(scope="module")
def exact():
    """A device, its poses, and its calibration from exact lengths."""
    rng = np.random.default_rng(80)
    exo = ep.load("three-linear-actuators")
    device, arm = near(exo, rng, joints=0.003), poses(rng, 25)
    return exo, device, arm, ep.calibrate(*measured(device, arm), exo, length_noise=NOISE)


def force(exo, joints, arm):
    moved = exo.replace(geometry=exo.geometry.replace(base_points=joints[0], platform_points=joints[1]))
    return moved.reaction(arm, limits="none").magnitude


@pytest.mark.parametrize(
    "name", ["length scale", *(pytest.param(f"{ring} mounting", marks=pytest.mark.full) for ring in ("torso", "arm"))]
)
def test_effects_are_those_of_a_fit_with_the_mistake(exact, name):
    exo, device, arm, found = exact
    known = {each.name: each for each in found.known}[name]
    assert not known.shows
    assert not known.is_stated
    true, size = (device.base, device.platform), 0.25 * known.size
    joints, forces = [], []
    for axis in np.eye(3)[: 1 if name == "length scale" else 3]:
        turn = Rotation.from_rotvec(np.radians(size) * axis)
        ring = name.partition(" ")[0]
        wrong = device._replace(**{ring: turn}) if ring in ("torso", "arm") else device
        seen, lengths = measured(wrong, arm)
        lengths = lengths / (1.0 + 1e-2 * size) if name == "length scale" else lengths
        other = ep.calibrate(seen, lengths, exo, length_noise=NOISE)
        # Nothing of it shows.
        assert np.abs(other.residuals).max() < 1e-9
        joints.append((np.stack(other.joints) - np.stack(true)).ravel() / size)
        forces.append((force(exo, other.joints, arm) / force(exo, true, arm) - 1.0) / size)
    moved = 1e3 * np.sqrt(np.square(joints).sum(axis=0)).max()
    assert moved == pytest.approx(known.effects["joints_mm"], rel=0.02)
    changed = 100.0 * np.median(np.sqrt(np.square(forces).sum(axis=0)))
    assert changed == pytest.approx(known.effects["F_s_percent"], rel=0.1)


def test_a_tolerance_of_a_mounting_turns_the_joints_with_it(exact):
    """Closed form: the covariance of a joint a grows by σ² (|a|² 1 - a aᵀ); the fit itself stays."""
    exo, _, arm, plain = exact
    sigma = np.radians(2.0)
    tolerances = {"torso_mounting": sigma, "length_scale": 0.01}
    found = ep.calibrate(arm, plain.lengths, exo, length_noise=NOISE, tolerances=tolerances)
    np.testing.assert_allclose(np.stack(found.joints), np.stack(plain.joints), atol=1e-9)
    assert found.device_count == plain.device_count == 64
    assert not found.undetermined
    a, b = found.joints
    squares = sigma**2 * ((a**2).sum(axis=1, keepdims=True) - a**2)
    expected = np.stack([squares, 0.0 * b]) + 0.01**2 * np.stack([a, b]) ** 2 + plain.joint_deviations**2
    np.testing.assert_allclose(found.joint_deviations, np.sqrt(expected), rtol=1e-6)
    stated = {each.name: each for each in found.known if each.is_stated}
    assert stated.keys() == {"torso mounting", "length scale"}
    assert stated["torso mounting"].size == pytest.approx(2.0)
    assert "(its tolerance)" in found.verdict
    assert "All 18 unknowns" in found.verdict


@pytest.mark.full
def test_joints_in_the_frames_of_the_body_lie_within_their_deviations():
    inside = []
    for seed in range(24):
        rng = np.random.default_rng([81, seed])
        exo = ep.load("prototype")
        turns = [Rotation.from_rotvec(np.radians(2.0) * rng.normal(size=3)) for _ in range(2)]
        device = near(exo, rng, joints=0.002)._replace(torso=turns[0], arm=turns[1])
        seen, lengths = measured(device, poses(rng, 30), rng, NOISE)
        lengths = lengths / (1.0 + 0.005 * rng.normal())
        tolerances = {"torso_mounting": np.radians(2.0), "arm_mounting": np.radians(2.0), "length_scale": 0.005}
        found = ep.calibrate(seen, lengths, exo, length_noise=NOISE, tolerances=tolerances)
        error = np.abs(np.stack(found.joints) - np.stack([device.base, device.platform]))
        inside.append((error < 1.96 * found.joint_deviations).mean())
    # 24 shares, each of three independent turns and a scale at least.
    assert 0.87 < np.mean(inside) <= 1.0
