"""What a calibration says: the table of unknowns, undetermined directions, mix-ups and contradictions, in numbers."""

import re
import warnings

import numpy as np
import pytest
from measured_devices import measured, near, poses, random_exo
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, SuspectMeasurements
from exo_pin.calibration import pose_information

JOINTS = ("base_points", "platform_points")
NOISE = 3e-4


def test_the_table_has_nominal_and_found_values_with_their_deviations():
    rng = np.random.default_rng(70)
    exo, unknowns = random_exo(rng, 3), ("base_points", "length_offsets", "cuff_offset", "arm_mounting")
    seen, lengths = measured(near(exo, rng, offsets=0.05, mounting=0.1, rings=(0.0, 0.01)), poses(rng, 25), rng, NOISE)
    found = ep.calibrate(seen, lengths, exo, unknowns=unknowns, length_noise=NOISE, arm_mounting=Rotation.identity())
    rows = {line[:22].strip(): [float(part) for part in line[22:].split()] for line in str(found).splitlines()
            if re.match(r"(A_\d|length offset \d|cuff offset|arm mounting), ", line)}  # fmt: skip
    assert len(rows) == 8
    deviations, places = found.standard_deviations, found.model.places
    for i in range(3):
        own = deviations[places["base_points"]][3 * i : 3 * i + 3]
        expected = 1e3 * np.concatenate([exo.geometry.base_points[i], found.joints[0][i], own])
        np.testing.assert_allclose(rows[f"A_{i + 1}, mm"], expected, atol=0.051)
        own = deviations[places["length_offsets"]][i]
        np.testing.assert_allclose(rows[f"length offset {i + 1}, mm"], 1e3 * np.array([found.length_offsets[i], own]),
                                   atol=0.051)  # fmt: skip
    expected = 1e3 * np.concatenate([found.centre_offset.cuff, deviations[places["cuff_offset"]]])
    np.testing.assert_allclose(rows["cuff offset, mm"], expected, atol=0.051)
    expected = np.degrees(np.concatenate([found.arm_mounting.as_rotvec(), deviations[places["arm_mounting"]]]))
    np.testing.assert_allclose(rows["arm mounting, deg"], expected, atol=0.051)
    text, left = str(found), 1e3 * found.residuals
    assert f"25 x 3, {75 - found.information.rank} degrees of freedom" in text
    assert f"{np.sqrt((left**2).mean()):.3g} mm (root of the mean square), largest {np.abs(left).max():.3g} mm" in text
    assert f"{found.probability:.2g} (chi-square" in text
    assert "Taken as known, and what an error of it would do" in text
    assert all(f"\n  {each}" in text for each in found.known)
    assert ("would show in the residuals" in text) == any(each.shows for each in found.known)


def test_other_devices_undetermined_directions_and_outliers_are_listed_and_counted():
    rng = np.random.default_rng(79)
    exo = random_exo(rng, 3)
    seen, lengths = measured(near(exo, rng), Rotation.random(40, rng), rng, NOISE)
    far = rng.permutation(120)[:10]
    lengths.ravel()[far] += 0.02
    found = ep.calibrate(seen, lengths, exo, length_noise=NOISE)
    text = str(found)
    assert f"Other devices that fit equally well ({found.device_count - 1}), the nearest" in text
    own = np.concatenate(found.joints)
    for place, device in enumerate(found.devices[1:6]):
        apart = 1e3 * np.linalg.norm(np.concatenate(device.joints) - own, axis=1)
        names = [f"{ring}_{i}" for ring in "AB" for i in (1, 2, 3)]
        moved = ", ".join(f"{name} {size:.3g}" for name, size in zip(names, apart, strict=True) if size > 0.1)
        line = f"  {1e3 * device.distance:.3g} mm from it; joints elsewhere by mm: {moved}\n"
        assert (line in text + "\n") == (place < 3)
    assert f"{len(found.outliers)} residuals beyond four standard deviations:" in text
    lines = [f"  pose {k}, limb {i + 1}: {1e3 * found.residuals[k, i]:+.2f} mm" for k, i in found.outliers]
    assert len(lines) > 9
    assert [line in text for line in lines] == [True] * 8 + [False] * (len(lines) - 8)
    assert text.endswith(f"  and {len(lines) - 8} more")
    few = ep.calibrate(seen[:2], lengths[:2], exo, length_noise=NOISE)
    text = str(few)
    assert "  (6 lengths for 18 unknowns: measure more poses)" in text
    assert f"  and {len(few.undetermined) - 8} more\n  Measure other poses" in text
    assert all((f"  {direction}" in text) == (k < 8) for k, direction in enumerate(few.undetermined))


def test_the_deviation_of_a_direction_is_that_of_the_data_along_it():
    """Poses within two degrees: a direction is as uncertain as its eigenvector of the covariance is long."""
    rng = np.random.default_rng(71)
    exo = random_exo(rng, 3)
    arm = Rotation.from_rotvec(0.02 * rng.normal(size=(30, 3)))
    told = pose_information(arm, exo, unknowns=("base_offset", "length_offsets"), length_noise=1e-3)
    variances, axes = np.linalg.eigh(told.covariance)
    lost = np.flatnonzero(np.sqrt(variances) > 0.1 * told.model.reach)
    assert len(told.undetermined) == len(lost) > 0
    for each in told.undetermined:
        # In the space of the lost ones, along the direction whose largest component is one.
        along = axes[:, lost].T @ each.direction / np.linalg.norm(each.direction)
        size = np.sqrt((along**2 * variances[lost]).sum()) / np.linalg.norm(each.direction)
        assert each.standard_deviation == pytest.approx(size, rel=1e-6)
        assert f"(standard deviation {1e3 * each.standard_deviation:.3g} mm or mrad)" in str(each)
        largest = np.argsort(-np.abs(each.direction))[:4]
        named = [told.names[k] for k in largest if abs(each.direction[k]) > 0.05]
        assert re.findall(r"[+-][\d.e-]+ ([^,(]+?)(?:,|$)", each.description.removesuffix(", ...")) == named


@pytest.mark.parametrize("missing", [0.0, 0.03])
def test_swapped_limbs_are_told_by_how_lengths_change(missing):
    """Whatever constant is missing: the numbers are of changes about the mean."""
    rng = np.random.default_rng(72)
    exo = ep.load("prototype")
    arm = poses(rng, 40)
    exact = exo.inverse_kinematics(arm).lengths
    lengths = exact[:, [1, 0, 2]] + missing * np.array([1.0, -1.0, 0.5]) + 1e-3 * rng.normal(size=exact.shape)
    changes = [each - each.mean(axis=0) for each in (exact, lengths, lengths[:, [1, 0, 2]])]
    apart, left = (1e3 * np.sqrt(((changes[0] - other) ** 2).mean()) for other in changes[1:])
    said = (
        f"by {apart:.3g} mm, but only by {left:.3g} mm if the limbs are in another order: column 2 is limb 1, column 1"
    )
    with pytest.warns(SuspectMeasurements, match=re.escape(said)):
        ep.calibrate(arm, lengths, exo, unknowns=("length_offsets",), length_noise=1e-3)


@pytest.mark.parametrize(("share", "named"), [(0.59, False), (0.61, True), (1.59, True), (1.61, False)])
def test_a_unit_is_named_where_it_explains_three_fifths_to_eight_fifths(share, named):
    exo, arm = ep.load("prototype"), poses(np.random.default_rng(77), 20)
    with pytest.raises(InvalidInput) as caught:
        ep.calibrate(arm, 1000.0 * share * exo.inverse_kinematics(arm).lengths, exo)
    assert ("look like millimetres" in str(caught.value)) == named
    assert ("at most 5, got" in str(caught.value)) != named


@pytest.mark.parametrize(("constant", "varies", "named"), [
    (0.039, 0.0, False), (0.041, 0.0, True), (-0.041, 0.0, True), (0.05, 0.0059, True), (0.05, 0.0061, False),
])  # fmt: skip
def test_a_constant_that_a_limb_lacks_is_named(constant, varies, named):
    """By over 40 mm, half of the lengths within 6 mm of it."""
    exo, arm = ep.load("prototype"), poses(np.random.default_rng(78), 21)
    lengths = exo.inverse_kinematics(arm).lengths
    lengths[:, 2] -= constant + varies * np.array([0.0, *([1.0, -1.0] * 10)])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        ep.calibrate(arm, lengths, exo, unknowns="base_offset", length_noise=NOISE)
    words = f"by a constant: limb 3 by {1e3 * constant:+.3g} mm; where they leave out"
    assert [words in str(each.message) for each in said] == [True] * named
