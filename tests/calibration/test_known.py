"""What a calibration took as known: effects against fits anew with the mistake, deviations that tolerances add."""

import contextlib

import numpy as np
import pytest
from command_line import run
from measured_devices import measured, near, poses
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import SolverFailed, SuspectMeasurements, control

JOINTS, CENTRE = ("base_points", "platform_points"), ("base_offset", "cuff_offset")
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


def test_the_verdict_begins_with_what_lengths_cannot_show(exact):
    found = exact[3]
    start = "Taken as known, and errors of it do not show in lengths: 1 deg of the torso mounting: "
    assert found.verdict.startswith(start)
    assert "% of |F_s|; " in found.verdict
    assert str(found).startswith(found.verdict)
    assert [each.name for each in found.known][-1] == "length offsets"


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


def test_a_centre_far_away_is_returned_and_doubted():
    exo, arm = ep.load("prototype"), poses(np.random.default_rng(82), 20)
    base = exo.geometry.base_points + np.array([0.0, 0.25, 0.0])
    moved = exo.replace(geometry=exo.geometry.replace(base_points=base))
    lengths = moved.inverse_kinematics(arm).lengths
    found = ep.calibrate(arm, lengths, exo, unknowns="base_offset", length_noise=NOISE)
    np.testing.assert_allclose(found.centre_offset.base, [0.0, 0.25, 0.0], atol=1e-6)
    assert "The device's centre would be 250 mm from the shoulder's" in found.verdict


def test_mistakes_of_one_limb_are_named():
    rng = np.random.default_rng(83)
    exo, arm = ep.load("prototype"), poses(rng, 20)
    lengths = measured(near(exo, rng, 0.002), arm, rng, NOISE)[1]
    for factor, unit in ((100.0, "centimetres"), (1000.0, "millimetres")):
        for unknowns in (JOINTS, (*JOINTS, "length_offsets")):
            with pytest.raises(ep.InvalidInput, match=f"of limb 2 in m.*look like {unit}, divide"):
                ep.calibrate(arm, lengths * [1.0, factor, 1.0], exo, unknowns=unknowns)
    with pytest.warns(SuspectMeasurements, match=r"constant: limb 3 by \+1\d\d mm; .*make length_offsets unknown"):
        ep.calibrate(arm, lengths - [0.0, 0.0, 0.12], exo, length_noise=NOISE)
    lengths[7, 1] += 0.08
    found = ep.calibrate(arm, lengths, exo, unknowns=CENTRE, length_noise=NOISE)
    assert "most of it is pose 7, limb 2, an outlier" in found.contradiction


@pytest.mark.parametrize(("seen", "words"), [
    (lambda arm, _: Rotation.from_quat(arm.as_quat()[:, [3, 0, 1, 2]]), "w first"),
    (lambda _, angles: ep.shoulder_rotation(*angles[:, [1, 0, 2]].T, degrees=True), "abduction are swapped"),
    pytest.param(
        lambda _, angles: ep.shoulder_rotation(*np.radians(angles).T, degrees=True), "radians", marks=pytest.mark.full
    ),
])  # fmt: skip
def test_other_readings_are_named(seen, words):
    rng = np.random.default_rng(84)
    exo = ep.load("prototype")
    angles = rng.uniform([0.0, -4.0, -20.0], [85.0, 85.0, 85.0], (30, 3))
    arm = ep.shoulder_rotation(*angles.T, degrees=True)
    lengths = measured(near(exo, rng, 0.002), arm, rng, NOISE)[1]
    tolerances = dict.fromkeys(JOINTS, 0.01)
    # With such poses least squares may not even end; the warning comes before.
    with pytest.warns(SuspectMeasurements, match=words), contextlib.suppress(SolverFailed):
        ep.calibrate(seen(arm, angles), lengths, exo, unknowns=CENTRE, length_noise=NOISE)
    with pytest.warns(SuspectMeasurements, match="lengths are a row late"):
        ep.calibrate(arm[1:], lengths[:-1], exo, length_noise=NOISE, tolerances=tolerances)


def test_the_command_prints_what_python_says(exact, capsys, tmp_path):
    exo, _, arm, plain = exact
    path = tmp_path / "run.csv"
    control.write_run(control.MeasuredRun(arm, plain.lengths), path)
    options = ["--length-noise", "0.3", "--tolerance", "torso_mounting=2", "--tolerance", "length_scale=1"]
    status, out, _ = run(capsys, "calibrate", "three-linear-actuators", str(path), *options)
    tolerances = {"torso_mounting": np.radians(2.0), "length_scale": 0.01}
    read = control.read_run(path)
    found = ep.calibrate(read.poses, read.lengths, exo, length_noise=0.3e-3, tolerances=tolerances)
    assert status == 0
    assert out.splitlines()[0] == str(found).splitlines()[0]
    for line in str(found).splitlines():
        assert line in out
