"""Margins of a device that is not a wrist: of places that are given, of several wearers and of drives that fail."""

from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.workspace import Criteria
from exo_pin.workspace.device_values import DeviceValues
from exo_pin.workspace.pose_offsets import PoseOffsets

pytestmark = pytest.mark.usefixtures("plain")

NAN = np.nan
SMALL, LARGE = ep.Wearer(1.55, 50.0, "female"), ep.Wearer(1.9, 105.0, "male")


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(LARGE)


def of_places(serial, names, passive=None, reached=(True, True, True), **places):
    """Of three poses whose drives are at the middle of their ranges, or at coordinates that are given."""
    middle = [0.5 * (drive.least + drive.greatest) for drive in serial.device.drives]
    known = {
        "coordinates": np.tile(middle, (3, 1)), "share": np.array([1.0, 0.25, 0.75]),
        "margin": np.array([0.5, NAN, 0.2]), "state": SimpleNamespace(moment_of_f=np.tile(np.eye(3), (3, 1, 1))),
    }  # fmt: skip
    placed = SimpleNamespace(reached=np.array(reached), **(known | places))
    poses = SimpleNamespace(placed=placed, limits=SimpleNamespace(passive_error=passive))
    values = object.__new__(DeviceValues)
    # What the equilibrium of the poses would tell.
    values.__dict__["_plain"] = SimpleNamespace(source=SimpleNamespace(poses=poses))
    values.__init__(serial.device, np.tile(np.eye(3), (3, 1, 1)), (3, 1, 1), Criteria(least_margin=0.1), names)
    return values


def test_joints_without_a_drive_count_by_what_they_are_beyond_their_ends(serial):
    """Where they are within them the drives decide, and where a pose is not reached the way that is left to it."""
    room = min(0.5 * (drive.greatest - drive.least) for drive in serial.device.drives)
    assert room > 0.1
    for passive, expected in (
        (None, [room, room, room]),
        (np.array([0.0, 0.3, 0.0]), [room, -0.3, room]),
        (np.array([0.02, 0.0, 0.0]), [-0.02, room, room]),
    ):
        found = of_places(serial, ("stroke",), passive)
        np.testing.assert_allclose(found.margins["stroke"], expected)
        lost = of_places(serial, ("stroke",), passive, reached=(True, False, True))
        np.testing.assert_allclose(lost.margins["stroke"], [expected[0], -0.75, expected[2]])
    assert "stroke" not in of_places(serial, ("singularity",)).margins


def test_a_pose_that_is_not_reached_is_singular_and_not_connected(serial):
    """Where the drives' moments were not found nothing is known: such a pose is neither singular nor regular."""
    found = of_places(serial, ("singularity", "connected"), reached=(True, True, False))
    np.testing.assert_allclose(found.margin, [0.5, NAN, -0.25])
    np.testing.assert_allclose(found.margins["singularity"], [0.4, NAN, -0.35])
    at_rest = min(0.5, float(serial.reaction(serial.pose(), limits="none").margin))
    np.testing.assert_allclose(found.margins["connected"], [at_rest - 0.1, -np.inf, -np.inf])
    beyond = SimpleNamespace(moment_of_f=np.stack([np.eye(3), -np.eye(3), -np.eye(3)]))
    turned = of_places(serial, ("singularity",), state=beyond)
    np.testing.assert_allclose(np.abs(turned.margin), [0.5, NAN, 0.2])
    assert turned.margin[0] * turned.margin[2] < 0.0
    assert np.isposinf(found.bend).all()
    # Nothing asks for gaps or forces.
    for values in (found.gaps, found.tensions, found.shoulder):
        assert values.shape == (3, 3)
        assert np.isnan(values).all()
    assert np.isnan(found.moment).tolist() == [True] * 3


def test_of_two_wearers_each_is_held_by_the_same_drives(serial):
    """Arms, poses and drives in that order; each is the answer of the device with that arm, and the worst counts."""
    poses = serial.pose([20.0, 60.0], [10.0, 30.0], [0.0, 20.0])
    limits = Criteria(names=("forces",), wearers=(SMALL, LARGE))
    values = DeviceValues(serial.device, np.ascontiguousarray(poses.as_matrix()), (2,), limits, ("forces",))
    margin, efforts, shoulder = values.held_by_arm()
    assert (margin.shape, efforts.shape, shoulder.shape) == ((2, 2), (2, 2, 3), (2, 2, 3))
    for k, wearer in enumerate((SMALL, LARGE)):
        answer = serial.worn_by(wearer).reaction(poses, split="minimal", constraint_bounds=(0.0, 0.0))
        np.testing.assert_allclose(efforts[k], answer.actuator_forces, atol=1e-8)
        np.testing.assert_allclose(shoulder[k], answer.shoulder_force, atol=1e-8)
    assert (np.abs(margin[1] - margin[0]) > 1.0).all()
    np.testing.assert_array_equal(values.moment, margin.min(axis=0))


def test_a_dead_drive_gives_no_effort_and_the_others_theirs(serial):
    """A number beyond the drives is one of the moments that the wearer gives, and takes none of them away."""
    poses = serial.pose([20.0, 60.0], [10.0, 30.0], [0.0, 20.0])
    values = DeviceValues(serial.device, np.ascontiguousarray(poses.as_matrix()), (2,), Criteria(), ("forces",))
    margin = values.held_by_arm()[0]
    less, idle, _ = values.held_by_arm(1)
    assert less.shape == margin.shape == (1, 2)
    # It is still in its place, between the two others.
    assert idle.shape == (1, 2, 3)
    assert (less <= 1e-9).all()
    assert (margin > 1.0).all()
    assert not (np.abs(idle[..., 1]) > 1e-9).any()
    for one, other in zip(values.held_by_arm(3), values.held_by_arm(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_pose_that_is_not_reached_is_not_held_by_any_means(serial, monkeypatch):
    """Whatever the drives could hold where the device stopped; forces of a pose that is not held are not known."""
    module = import_module("exo_pin.workspace.device_values")
    monkeypatch.setattr(module, "disturbing_moment", lambda _: np.array([5.0, -6.0, 7.0]))
    found = of_places(serial, ("singularity",), reached=(True, True, False))
    found._plain.held = np.array([True, False, True])
    found._plain.actuator_forces = found._plain.shoulder_force = np.arange(9.0).reshape(3, 3)
    margin, *forces = found.held_by_arm()
    assert margin.tolist() == [[5.0, -6.0, -np.inf]]
    for each in forces:
        np.testing.assert_array_equal(each, [[[0.0, 1.0, 2.0], [NAN] * 3, [6.0, 7.0, 8.0]]])


@pytest.mark.parametrize("base", [0.0, 0.01])
@pytest.mark.parametrize("cuff", [0.0, 0.02])
def test_a_device_is_asked_about_where_it_is(serial, monkeypatch, base, cuff):
    """Off at either end or at both, with the load on the arm, by the split that needs no couple of the cuff."""
    module = import_module("exo_pin.workspace.device_values")
    monkeypatch.setattr(module, "solve", lambda *question: question)
    values, load = object.__new__(DeviceValues), ep.Load([1.0, 2.0, 3.0])
    values.matrices, values.load, values._posture = np.tile(np.eye(3), (2, 1, 1)), load, None
    values.offsets = PoseOffsets(np.array([[0.0, base, 0.0]]), np.array([[0.0, 0.0, cuff]]))
    device, case, assumptions = values._answer(serial.device)
    assert device is serial.device
    assert case.load is load
    assert (assumptions.split, assumptions.constraint_bounds) == ("minimal", (0.0, 0.0))
    if base == cuff == 0.0:
        assert case.centre_offset is None
        return
    np.testing.assert_array_equal(case.centre_offset.base, values.offsets.base)
    np.testing.assert_array_equal(case.centre_offset.cuff, values.offsets.cuff)


@pytest.mark.parametrize("offset", [([0.02, 0.0, 0.0], [0.0] * 3), ([0.0] * 3, [0.0, 0.0, 0.03])])
def test_a_device_that_is_off_at_one_end_answers_as_its_reaction_does(offset):
    exo = ep.load(URDF / "spring-support.urdf").worn_by(LARGE)
    poses, moved = exo.pose([30.0, 60.0], [20.0, 40.0]), ep.CentreOffset(*map(np.array, offset))
    found = exo.workspace(poses, ["forces"], centre_offset=moved)
    answer = exo.reaction(poses, split="minimal", constraint_bounds=(0.0, 0.0), centre_offset=moved)
    still = exo.reaction(poses, split="minimal", constraint_bounds=(0.0, 0.0))
    assert np.abs(answer.actuator_forces - still.actuator_forces).max() > 1e-3
    np.testing.assert_array_equal(found.margins["forces"] >= 0.0, answer.held)
    np.testing.assert_allclose(found.tensions[answer.held], answer.actuator_forces[answer.held], atol=1e-9)
    np.testing.assert_allclose(found.lengths.shape, (2, exo.device.limb_count))


def test_gaps_are_asked_for_by_the_clearance_alone(serial):
    poses = serial.pose([0.0, 50.0], [0.0, 40.0])
    matrices = np.ascontiguousarray(poses.as_matrix())
    values = DeviceValues(serial.device, matrices, (2,), Criteria(), ("clearance",))
    expected = serial.device.gaps(matrices, body=ep.BodyShape.of(LARGE)).least
    np.testing.assert_allclose(values.gaps, expected, atol=1e-9)
    assert np.isposinf(values.gaps[:, 2]).all()
    np.testing.assert_allclose(values.margins["clearance"], expected.min(axis=1), atol=1e-9)
    found = serial.workspace(Rotation.concatenate([poses, poses]), ["singularity"])
    assert np.isnan(found.gaps).all()
