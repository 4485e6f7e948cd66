"""Margins of a device that is not a wrist: of poses out of reach, of several wearers, off centre, and its gaps."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.workspace import Criteria

pytestmark = pytest.mark.usefixtures("plain")

SMALL, LARGE = ep.Wearer(1.55, 50.0, "female"), ep.Wearer(1.9, 105.0, "male")


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(LARGE)


def test_a_pose_that_is_not_reached_meets_no_criterion():
    """It is out of stroke by what is left of its way, neither connected nor held, and its forces are not known."""
    exo = ep.load(URDF / "3rps-passive-ball.urdf")
    poses = exo.pose([0.0, 30.0, 170.0], [0.0, 20.0, -40.0], [0.0, 0.0, 80.0])
    answer = exo.reaction(poses, split="minimal", constraint_bounds=(0.0, 0.0))
    assert answer.status.tolist() == ["ok", "ok", "out_of_reach"]
    lost = answer.status == "out_of_reach"
    found = exo.workspace(poses, ["stroke", "singularity", "forces"])
    for name in ("stroke", "singularity", "forces"):
        assert not found.met[name][lost].any(), name
    assert ((found.margins["stroke"][lost] >= -1.0) & (found.margins["stroke"][lost] < 0.0)).all()
    assert np.isnan(found.shoulder_force[lost]).all()
    np.testing.assert_allclose(
        found.shoulder_force[answer.held], answer.shoulder_force[answer.held], rtol=1e-9, atol=1e-9
    )


def test_of_two_wearers_each_is_held_by_the_same_drives(serial):
    """Each margin is that of the device with that arm, and the worse one counts."""
    poses = serial.pose([20.0, 60.0], [10.0, 30.0], [0.0, 20.0])
    both = serial.workspace(poses, Criteria(names=("forces",), wearers=(SMALL, LARGE))).margins["forces"]
    alone = [serial.worn_by(wearer).workspace(poses, ["forces"]).margins["forces"] for wearer in (SMALL, LARGE)]
    assert (np.abs(alone[1] - alone[0]) > 1.0).all()
    np.testing.assert_allclose(both, np.minimum(*alone), atol=1e-9)


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
    found = serial.workspace(poses, ["clearance"])
    expected = serial.device.gaps(poses.as_matrix(), body=ep.BodyShape.of(LARGE)).least
    np.testing.assert_allclose(found.gaps, expected, atol=1e-9)
    assert np.isposinf(found.gaps[:, 2]).all()
    np.testing.assert_allclose(found.margins["clearance"], expected.min(axis=1), atol=1e-9)
    assert np.isnan(serial.workspace(poses, ["singularity"]).gaps).all()
