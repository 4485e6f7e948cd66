"""Discrete twins: derived ones are found and counted, none is returned in silence, wrong models are named."""

import itertools

import numpy as np
import pytest
from calibration_cases import CENTRE, JOINTS, MOUNTINGS, case, error, stated_error
from measured_devices import measured, near, poses, random_exo
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import ExoPinError, SuspectMeasurements


def lengths_of(device, seen):
    """Measured lengths of a fitted device, from the definition of a distance."""
    a, b = device.joints
    R = (device.torso_mounting * seen * device.arm_mounting).as_matrix()
    return np.linalg.norm(np.einsum("kij,nj->kni", R, b) - a, axis=2) - device.length_offsets


def check_devices(found, count):
    """So many devices, all with the same lengths, all different, the nearest to the design first and returned."""
    assert found.device_count == count
    assert len(found.devices) == min(count, 64)
    for device in found.devices:
        np.testing.assert_allclose(lengths_of(device, found.poses), found.lengths, atol=1e-8)
    joints = np.array([np.concatenate(device.joints) for device in found.devices])
    for one, other in itertools.combinations(joints, 2):
        assert np.abs(one - other).max() > 1e-3
    far = [device.distance for device in found.devices]
    assert far == sorted(far)
    assert found.distance == far[0]
    np.testing.assert_array_equal(found.devices[0].values, found.values)
    assert (f"{count} devices that fit equally well" in found.verdict) == (count > 1)


@pytest.mark.parametrize(("unknowns", "limbs", "count"), [
    (JOINTS, 3, 64),
    ((*JOINTS, "length_offsets"), 4, 256),
    # The frame turns with the joints: each choice of twins is still a device.
    ((*JOINTS, *MOUNTINGS), 3, 64),
    # A flat ring is its own mirror image, turned by half a turn and shifted; one that is not flat is not.
    ((*CENTRE, *MOUNTINGS), 3, 2),
    ((*CENTRE, *MOUNTINGS, "length_offsets"), 3, 2),
    ((*CENTRE, *MOUNTINGS), 5, 1),
    # The mirrored base is a turn and a shift of itself; of the cuff all points are unknown.
    (("base_offset", "torso_mounting", "platform_points"), 3, 2),
    # Without the shift, or without the turn, it is not.
    (("base_offset", "arm_mounting", "platform_points"), 3, 1),
    (("torso_mounting", "platform_points"), 3, 1),
    (CENTRE, 3, 1),
    (MOUNTINGS, 3, 1),
    (("base_points",), 3, 1),
])  # fmt: skip
def test_twins_are_those_of_the_derivation(unknowns, limbs, count):
    rng = np.random.default_rng(60 + limbs)
    exo = random_exo(rng, limbs)
    device = near(
        exo,
        rng,
        joints=0.0,
        offsets=0.02 if "length_offsets" in unknowns else 0.0,
        rings=(0.01 * ("base_offset" in unknowns), 0.01 * ("cuff_offset" in unknowns)),
    )
    mountings = [Rotation.random(rng=rng) if name in unknowns else Rotation.identity() for name in MOUNTINGS]
    if set(JOINTS) & set(unknowns):
        mountings = [Rotation.identity()] * 2
    device = device._replace(torso=mountings[0], arm=mountings[1])
    found = ep.calibrate(*measured(device, Rotation.random(30, rng)), exo, unknowns=unknowns)
    check_devices(found, count)
    # With joints and mountings unknown, where the frames are is undetermined.
    assert error(found, device, ("sensors",) if found.undetermined else ("body", "sensors")) < 1e-8
    assert found.is_decided
    assert not found.contradiction


def test_design_that_is_as_near_to_one_device_as_to_another_decides_nothing():
    rng = np.random.default_rng(67)
    exo = random_exo(rng, 3)
    geometry = exo.geometry
    # Half-way between A_1, B_1 and the pair with their distances exchanged, nearly.
    a, b = geometry.base_points.copy(), geometry.platform_points.copy()
    ratio = np.linalg.norm(b[0]) / np.linalg.norm(a[0])
    a[0], b[0] = a[0] * (0.55 + 0.45 * ratio), b[0] * (0.55 + 0.45 / ratio)
    nominal = exo.replace(geometry=geometry.replace(base_points=a, platform_points=b))
    seen, lengths = measured(near(exo, rng, joints=0.0), Rotation.random(40, rng), rng, 3e-4)
    found = ep.calibrate(seen, lengths, nominal, length_noise=3e-4)
    assert not found.is_decided
    assert "does not decide" in found.verdict
    assert min(error(device, near(exo, rng, joints=0.0)) for device in found.devices) < 0.01
    # A tolerance says what the design knows.
    tight = ep.calibrate(seen, lengths, exo, length_noise=3e-4, tolerances=dict.fromkeys(JOINTS, 0.003))
    assert tight.device_count == 1


def every_minimum(model, seen, lengths, rng, starts):
    """Sums of squares and values of minima, by SciPy from random starts all over the place."""
    measured_matrices = seen.as_matrix()
    for _ in range(starts):
        start = rng.normal(size=model.size) * np.where(np.array(model.units) == "rad", 1.5, 0.2)
        solved = least_squares(
            lambda p: (model.lengths(p, measured_matrices) - lengths).ravel() / 3e-4,
            start,
            x_scale=model.scales,
            xtol=1e-13,
            ftol=1e-13,
            gtol=1e-13,
        )
        yield 2.0 * solved.cost, solved.x


@pytest.mark.parametrize(("unknowns", "count", "starts"), [
    pytest.param(MOUNTINGS, 6, 10, marks=pytest.mark.full),
    pytest.param((*CENTRE, *MOUNTINGS), 8, 30, marks=pytest.mark.full),
    pytest.param(MOUNTINGS, 3, 60, marks=pytest.mark.full),
    pytest.param((*JOINTS,), 8, 60, marks=pytest.mark.full),
    pytest.param(("base_points", "cuff_offset"), 6, 60, marks=pytest.mark.full),
    pytest.param((*CENTRE, *MOUNTINGS), 8, 120, marks=pytest.mark.long),
])  # fmt: skip
def test_no_random_start_finds_a_device_that_is_not_listed(unknowns, count, starts):
    """Few poses: minima that fit equally well are then not only the exact twins."""
    rng = np.random.default_rng(68)
    exo = random_exo(rng, 3)
    device = near(exo, rng, joints=0.002 if "base_points" in unknowns else 0.0)
    seen, lengths = measured(device, poses(rng, count), rng, 3e-4)
    found = ep.calibrate(seen, lengths, exo, unknowns=unknowns, length_noise=3e-4)
    own = (found.estimate.residuals**2).sum()
    ends = [np.concatenate([d.torso_mounting.inv().apply(d.joints[0]), d.arm_mounting.apply(d.joints[1])])
            for d in found.devices]  # fmt: skip
    seen_once = 0
    for cost, values in every_minimum(found.model, seen, lengths, rng, starts):
        assert cost > own - 16.0 - 1e-6
        if cost <= own + 1.0:
            torso, arm = found.model.mountings(values)
            a, b = found.model.joints(values)
            here = np.concatenate([torso.inv().apply(a), arm.apply(b)])
            gap = min(np.abs(each - here).max() for each in ends)
            # Two minima within the stated errors of each other are one device.
            assert gap < max(1e-4, 4.0 * stated_error(found, ("sensors",)))
            seen_once += 1
    assert seen_once


def judged(seed):
    """One generated case: "right", or how a wrong device was returned."""
    generated = case(seed)
    try:
        found = generated.calibrated()
    except (ExoPinError, SuspectMeasurements):
        return "refused", generated.kind
    if error(found, generated.device) < max(0.02, 10.0 * stated_error(found)):
        return "right", generated.kind
    doubted = bool(found.contradiction) or not found.is_decided or bool(found.undetermined)
    assert doubted == ("All" not in found.verdict or "does not decide" in found.verdict)
    # In the sensors' frames it is the right one, and the verdict begins with the mountings that lengths cannot show.
    turned = explained(found, generated)
    return "wrong, and said" if doubted or turned else f"silent: seed {seed}", generated.kind


def explained(found, generated):
    """Whether the verdict begins with a mounting that was stated wrong, and an effect on the joints as large."""
    for name in MOUNTINGS:
        stated = generated.options.get(name, Rotation.identity())
        actual = getattr(generated.device, name.split("_")[0])
        off = (stated * actual.inv()).magnitude() if name == "torso_mounting" else (actual.inv() * stated).magnitude()
        known = {each.name: each for each in found.known}.get(name.replace("_", " "))
        if off > 0.01 and known is not None and not known.shows:
            first = found.verdict.startswith("Taken as known, and errors of it do not show in lengths: ")
            most = np.degrees(off) * 1e-3 * known.effects["joints_mm"]
            return first and str(known) in found.verdict and error(found, generated.device, ("body",)) < 1.1 * most
    return False


@pytest.mark.parametrize(
    "seeds",
    [
        pytest.param(range(30), marks=pytest.mark.full),
        *(pytest.param(range(k, k + 100), marks=pytest.mark.long) for k in range(0, 400, 100)),
    ],
    ids=lambda seeds: f"{seeds.start}-{seeds.stop}",
)
def test_no_twin_is_returned_in_silence(seeds):
    results = [judged(seed) for seed in seeds]
    assert not [text for text, _ in results if text.startswith("silent")]
    # All cases that the model explains are solved.
    assert {text for text, kind in results if kind == "clean"} == {"right"}
    assert sum(text == "right" for text, _ in results) > 0.6 * len(results)


def test_residuals_that_no_noise_explains_are_named():
    rng = np.random.default_rng(69)
    exo = ep.load("prototype")
    wrong = Rotation.from_rotvec([0.0, 0.1, 0.05])
    seen, lengths = measured(near(exo, rng, joints=0.0), poses(rng, 40), rng, 3e-4)
    for noise, words in ((3e-4, "times as large"), (None, "with the pose as no noise does")):
        found = ep.calibrate(seen, lengths, exo, unknowns=CENTRE, length_noise=noise, torso_mounting=wrong)
        assert words in found.contradiction
        assert "Not a good fit." in found.verdict
        assert "are determined" not in found.verdict
        assert not ep.calibrate(seen, lengths, exo, unknowns=CENTRE, length_noise=noise).contradiction
    # A third of the lengths of one limb are of a slack muscle.
    slack = lengths.copy()
    slack[:, 1] = np.maximum(slack[:, 1], np.quantile(slack[:, 1], 0.33))
    assert "times what their median says" in ep.calibrate(seen, slack, exo).contradiction
