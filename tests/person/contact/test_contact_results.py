"""What a contact force says of itself, of numbers that are given."""

import numpy as np
import pytest
from contact_results import some_contact
from mirror_image import MIRROR

from exo_pin.person import MUSCLES

NAN = np.nan


def test_sizes_are_those_of_the_vectors():
    rng = np.random.default_rng(2)
    force, turn = rng.normal(size=(3, 3)), np.linalg.qr(rng.normal(size=(3, 3)))[0]
    found = some_contact(np.ones(3), force=force, glenoid=np.broadcast_to(turn, (3, 3, 3)))
    out, superior, anterior = np.array([turn @ each for each in force]).T
    np.testing.assert_allclose(found.magnitude, np.sqrt((force**2).sum(axis=1)))
    np.testing.assert_allclose(found.percent_body_weight, found.magnitude / 7.5)
    np.testing.assert_allclose(found.components, np.stack([out, superior, anterior], axis=1))
    np.testing.assert_allclose(found.compression, out)
    np.testing.assert_allclose(found.shear, np.sqrt(superior**2 + anterior**2))
    np.testing.assert_allclose(found.effort, 0.01 * len(MUSCLES))
    data = found.as_dict()
    for name in ("magnitude", "percent_body_weight", "compression", "muscles"):
        np.testing.assert_array_equal(data[name], getattr(found, name))
    assert data["relief_percent"] is None
    assert data["body_weight"] == 750.0


def test_mirror_image_of_every_vector():
    rng = np.random.default_rng(3)
    fields = {
        "force": rng.normal(size=3),
        "device_wrench": rng.normal(size=6),
        "glenoid": rng.normal(size=(3, 3)),
        "centre": rng.normal(size=3),
        "missing_moment": rng.normal(size=3),
        "missing_elbow": rng.normal(size=2),
        "device_forces": rng.normal(size=2),
        "constraint_forces": np.array([1.5, 0.0]),
    }
    found = some_contact(1.0, side="right", without_device=some_contact(2.0, side="right"), **fields)
    image = found.mirrored()
    assert (image.side, image.without_device.side, image.mirrored().side) == ("left", "left", "right")
    for name in ("force", "glenoid", "centre"):  # vectors
        np.testing.assert_array_equal(getattr(image, name), fields[name] @ MIRROR)
    np.testing.assert_array_equal(image.device_wrench[:3], fields["device_wrench"][:3] @ MIRROR)
    np.testing.assert_array_equal(image.device_wrench[3:], -fields["device_wrench"][3:] @ MIRROR)
    np.testing.assert_array_equal(image.missing_moment, -fields["missing_moment"] @ MIRROR)
    for name in ("missing_elbow", "device_forces"):  # numbers of a joint or a limb
        np.testing.assert_array_equal(getattr(image, name), fields[name])
    assert image.constraint_forces.tolist() == [-1.5, 0.0]
    assert not np.signbit(image.constraint_forces[1])
    assert some_contact(1.0).mirrored().without_device is None


def test_relief_counts_where_the_device_holds():
    bare = some_contact([500.0, 500.0, 500.0, NAN])
    found = some_contact([400.0, 600.0, 100.0, 100.0], without_device=bare)
    np.testing.assert_allclose(found.relief_percent, [20.0, -20.0, 80.0, NAN])
    held = some_contact([400.0, 600.0, 100.0, 100.0], without_device=bare, held=np.array([True, True, False, True]))
    np.testing.assert_allclose(held.relief_percent, [20.0, -20.0, NAN, NAN])
    assert bare.relief_percent is None


@pytest.mark.parametrize(
    ("status", "words"),
    [
        ("too_weak", "The muscles are too weak to hold the arm in this pose."),
        ("unstable", "The muscles can hold the arm only with a contact force outside the socket's rim."),
        ("outside", "The pose is outside the range of motion."),
        ("no_device_force", "The device has no limb forces in this pose."),
        ("not_solved", "The solver found no result."),
    ],
)
def test_verdict_of_a_pose_without_a_result(status, words):
    found = some_contact(NAN, status=status)
    assert found.verdict == words
    assert not found.has_result
    assert found.peak_row is None


def test_verdict_of_a_pose():
    def verdict(force, bare=None, **more):
        without = None if bare is None else some_contact(bare)
        return some_contact(force, without_device=without, **more).verdict

    carries = "The joint carries 300 N, 40 % of body weight"
    assert verdict(300.0) == carries + "."
    assert verdict(300.0, 400.0) == carries + ", at most 25 % less than without the device: people keep more tension."
    assert verdict(300.0, 200.0) == carries + ", 50 % more than without the device."
    assert verdict(300.0, 300.0) == carries + ", at most 0 % less than without the device: people keep more tension."
    assert verdict(300.0, NAN) == carries + " with the device."
    assert verdict(300.0, caution="It slips.") == f"It slips. {carries}."


def test_verdict_and_summary_of_a_stack():
    found = some_contact([150.0, 450.0, NAN], without_device=some_contact([300.0, 600.0, NAN]))
    assert found.verdict == "2 of 3 poses have a result; the largest contact force is 60 % of body weight."
    assert found.peak_row == 1
    assert found.summary() == {
        "peak_contact_N": 450.0,
        "mean_contact_N": 300.0,
        "peak_contact_without_device_N": 600.0,
        "mean_contact_without_device_N": 450.0,
    }
    assert set(found.without_device.summary()) == {"peak_contact_N", "mean_contact_N"}
    empty = some_contact([NAN, NAN])
    assert empty.verdict == "No pose has a result."
    assert empty.peak_row is None
    assert np.isnan(list(empty.summary().values())).all()


def test_cautions_of_device_and_record():
    assert some_contact(1.0).cautions == ()
    assert some_contact(1.0, caution="a", record_cautions=("b", "c")).cautions == ("a", "b", "c")
    assert some_contact(1.0, record_cautions=("b",)).cautions == ("b",)
    assert some_contact(1.0).held is None
