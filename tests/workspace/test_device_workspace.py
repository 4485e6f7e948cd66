"""The workspace of a device that is not a wrist against its own answers, and gaps against sampled surfaces."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.device import ChainDevice
from exo_pin.workspace import limb_loss, limb_sheet, limb_table

MAN = ep.Wearer(1.755, 85.0, "male")


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)


def test_margins_are_those_of_the_answers(serial):
    poses = ep.adl_box(30.0)
    found = serial.workspace(poses)
    answer = serial.reaction(poses, split="minimal", constraint_bounds=(0.0, 0.0))
    state = serial.singularity(poses)
    np.testing.assert_allclose(found.margins["singularity"], state.margin - 0.05, atol=1e-12)
    np.testing.assert_array_equal(found.margins["forces"] >= 0.0, answer.held)
    np.testing.assert_allclose(
        np.linalg.norm(found.shoulder_force, axis=-1)[answer.held], answer.magnitude[answer.held]
    )
    # Where its drives are in line the device is singular: at a right angle of abduction.
    in_line = serial.workspace(serial.pose([20.0, 60.0], 89.0))
    assert (in_line.margins["singularity"] < 0.0).all()
    assert {"joint_angles", "shoulder_range"}.isdisjoint(found.margins)


def test_a_dead_drive_lets_the_arm_sink(serial):
    poses = serial.pose([30.0, 60.0], [20.0, 30.0])
    found = serial.workspace(poses, ep.Criteria(("forces", "limb_loss"), least_moment_without_limb=0.0))
    assert found.fractions["forces"] == 1.0
    assert found.fractions["limb_loss"] == 0.0
    dead = serial.replace(drives=[d.idle() if d.name == "flexion" else d for d in serial.device.drives])
    answer = dead.reaction(poses)
    assert not answer.can_hold.any()
    # What lacks is the moment about the axis of the dead motor, the torso's y.
    np.testing.assert_allclose(
        np.abs(found.margins["limb_loss"]).max(), np.abs(serial.reaction(poses).actuator_forces).max(), rtol=1e-6
    )


def test_the_same_wrist_has_the_same_held_poses_both_ways():
    exo = ep.load("four-linear-actuators-worn")
    device = ChainDevice.from_chain(exo.chain).replace(arm=exo.arm)
    limits = [d.__class__(d.name, d.joint, pulls=True, lower=-600.0, upper=600.0, least=d.least, greatest=d.greatest)
              for d in device.drives]  # fmt: skip
    poses = exo.pose(*np.meshgrid([0.0, 30.0, 60.0, 90.0], [0.0, 40.0]))
    names = ep.Criteria(("stroke", "forces"))
    one, other = (
        exo.workspace(poses, names),
        ep.ShoulderExo.from_device(device.replace(drives=limits)).workspace(poses, names),
    )
    np.testing.assert_array_equal(one.inside, other.inside)
    np.testing.assert_allclose(other.margins["forces"], one.margins["forces"], rtol=1e-6)
    np.testing.assert_allclose(other.shoulder_force, one.shoulder_force, atol=1e-5)


def test_a_table_of_the_drives_and_of_their_loss(serial):
    poses = serial.pose([30.0, 60.0], [20.0, 30.0])
    found = serial.workspace(poses, ["stroke", "forces"])
    table = limb_table(serial.device, found)
    assert table["drive"].tolist() == [drive.name for drive in serial.device.drives]
    flexion = table["drive"].tolist().index("flexion")
    # The serial device turns as the angles of the pose do.
    assert np.degrees([table[f"used_{end}"][flexion] for end in ("from", "to")]) == pytest.approx([30.0, 60.0])
    answer = serial.reaction(poses, split="minimal", constraint_bounds=(0.0, 0.0))
    np.testing.assert_allclose(table["effort_to"], answer.actuator_forces.max(axis=0))
    assert "30.0 to 60.0" in limb_sheet(serial.device, table)
    assert limb_loss(serial.device, found)["held"].tolist() == [0.0, 0.0, 0.0]
    support = ep.load(URDF / "spring-support.urdf")
    passive = support.workspace(support.pose([30.0]), ["singularity"])
    with pytest.raises(InvalidInput, match="which has none"):
        limb_table(support.device, passive)


def test_where_a_device_reaches_is_known_without_an_arm(serial):
    poses, bare = serial.pose([30.0, 60.0], [20.0, 89.9]), serial.replace(arm=None)
    found, worn = bare.workspace(poses), serial.workspace(poses)
    assert found.not_checked["forces"] == "not known: arm mass"
    for name in ("stroke", "singularity"):
        np.testing.assert_allclose(found.margins[name], worn.margins[name], atol=1e-9)
    assert np.isnan(limb_table(bare.device, found)["effort_to"]).all()
    with pytest.raises(MissingData, match="--person"):
        limb_loss(bare.device, found)
