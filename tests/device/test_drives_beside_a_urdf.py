"""A design that is written as URDF keeps what its actuators cannot do: its device file says so."""

from dataclasses import replace

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.device import ChainDevice, Drive

#: Around poses that the prototype's muscles hold, near the ends of what they can pull; daily poses of the others.
ROOMS = {
    "prototype": ((-8, 12), (-25, 5), (-5, 30)),
    **dict.fromkeys(
        ["four-cables", "three-linear-actuators", "four-linear-actuators-worn"], ((-20, 110), (-5, 90), (-20, 85))
    ),
}


def drawn(exo, name, count=200):
    rng = np.random.default_rng(4)
    flexion, abduction, rotation = (rng.uniform(*span, count) for span in ROOMS[name])
    return exo.pose(flexion=flexion, abduction=abduction, internal_rotation=rotation)


@pytest.mark.parametrize("name", ROOMS)
def test_a_wrist_without_masses_of_its_limbs_comes_back_whole(name, tmp_path):
    exo = ep.load(name).replace(estimated=())  # which data are estimates stays in the design file
    read = ep.load(exo.to_urdf(tmp_path, assumed=None))
    assert type(read) is ep.ShoulderExo
    poses = drawn(exo, name)
    answer, same = exo.reaction(poses), read.reaction(poses)
    assert 0 < answer.can_hold.sum() < answer.can_hold.size
    np.testing.assert_array_equal(same.status, answer.status)
    np.testing.assert_array_equal(same.can_hold, answer.can_hold)
    np.testing.assert_allclose(same.shoulder_force, answer.shoulder_force, atol=1e-9)
    np.testing.assert_allclose(same.actuator_forces, answer.actuator_forces, atol=1e-9)
    for limb, other in zip(exo.mechanism.limbs, read.mechanism.limbs, strict=True):
        assert (limb.actuator, limb.stroke) == (other.actuator, other.stroke)


@pytest.mark.parametrize("name", ["prototype", "four-cables"])
def test_the_chain_of_a_file_has_the_lengths_and_limits_of_its_limbs(name, tmp_path):
    exo = ep.load(name)
    read = ep.load(exo.to_urdf(tmp_path))  # with assumed masses: no record of a wrist, but a chain
    assert isinstance(read.device, ChainDevice)
    poses = drawn(exo, name, 20)
    ours, theirs = exo.reaction(poses).source.poses, read.reaction(poses).source.poses
    np.testing.assert_allclose(theirs.lengths, ours.lengths, atol=1e-9)
    np.testing.assert_allclose(theirs.limits.lower, ours.limits.lower)
    np.testing.assert_allclose(theirs.limits.upper, ours.limits.upper, rtol=1e-6)
    np.testing.assert_allclose(theirs.limits.length_error, ours.limits.length_error, atol=1e-9)


def test_a_file_without_limits_does_not_say_that_it_holds(tmp_path):
    path = ep.load("four-cables").to_urdf(tmp_path)
    path.with_suffix(".device.toml").unlink()
    exo = ep.load(path)
    assert "It is not known whether" in exo.reaction(exo.pose(60, 30)).verdict


def test_cables_of_the_published_file_do_not_push():
    exo = ep.load(URDF / "six-cables.urdf")
    answer = exo.reaction(exo.pose(flexion=[20, 40, 60], abduction=20))
    assert answer.can_hold.all()
    assert (answer.actuator_forces >= -1e-9).all()


def test_speed_and_power_of_the_actuator_of_a_drive_count():
    actuator = ep.Actuator("cable", pull_limit=400.0, speed_limit=0.2, power_limit=50.0)
    drive = Drive("rope", joint="slide", pulls=True, actuator=actuator, power_limit=30.0)
    assert (drive.speed_limit, drive.power_limit) == (0.2, 30.0)


def test_a_drive_whose_limits_are_no_actuators_makes_a_chain(tmp_path):
    path = ep.load("three-linear-actuators").to_urdf(tmp_path, assumed=None)
    file = path.with_suffix(".device.toml")
    file.write_text(file.read_text().replace("pulls = true", "pulls = true\nlower_N = 5.0", 1))
    read = ep.load(path)
    assert read.device.drives[0].effort_range == (5.0, 400.0)
    assert read.reaction(read.pose(60, 30)).source.poses.limits.lower[0, 0] == 5.0


def test_speed_of_an_actuator_comes_back(tmp_path):
    exo = ep.load("four-cables")
    slow = ep.Actuator("cable", pull_limit=400.0, speed_limit=0.05)
    exo = exo.replace(limbs=[replace(limb, actuator=slow) for limb in exo.mechanism.limbs])
    read = ep.load(exo.to_urdf(tmp_path, assumed=None))
    quick = ep.Motion([0.0, 2.0, 0.0], [0.0, 0.0, 0.0])
    for each in (exo, read):
        assert each.reaction(each.pose(60, 30), quick).status == "beyond_limits"


@pytest.mark.parametrize(
    ("given", "said"), [({"zero_length": -0.1}, "zero_length"), ({"zero_length": 0.2}, "pulls=True")]
)
def test_a_wrong_zero_length_is_refused(given, said):
    with pytest.raises(ep.InvalidInput, match=said):
        Drive("rope", joint="slide", **given)


WOMAN = ep.Wearer(1.60, 60, "female")


@pytest.mark.parametrize("name", ["prototype", "four-cables"])
def test_the_next_wearer_of_a_file_keeps_what_the_device_moves(name, tmp_path):
    exo = ep.load(name).replace(estimated=())
    read = ep.load(exo.to_urdf(tmp_path, assumed=None))
    assert read.arm.body_mass == exo.arm.body_mass
    own, other = (each.worn_by(WOMAN) for each in (exo, read))
    poses = drawn(exo, name, 10)
    np.testing.assert_allclose(
        other.reaction(poses, limits="none").shoulder_force,
        own.reaction(poses, limits="none").shoulder_force,
        atol=1e-9,
    )


def test_with_assumed_masses_the_device_moves_as_much_and_its_links_more(tmp_path, capsys):
    exo = ep.load("four-cables")
    path = exo.to_urdf(tmp_path)
    read = ep.load(path).worn_by(WOMAN)
    assert read.arm.mass == pytest.approx(exo.worn_by(WOMAN).arm.mass, rel=1e-12)
    assert read.device.links_mass == pytest.approx(4 * (0.06 + 0.04 + 0.005))  # as its header says
    main(
        ["reaction", str(path), "--person", f"{WOMAN.height},{WOMAN.mass},{WOMAN.sex}", "--flexion", "20", "--explain"]
    )
    assert "moving part of the device 1.08 kg" in " ".join(capsys.readouterr().out.split())


def test_a_chain_is_written_with_the_arm_of_who_wears_it(tmp_path):
    worn = ep.load(URDF / "serial-y-x-z.urdf").worn_by(WOMAN)
    read = ep.load(worn.to_urdf(tmp_path))
    assert (read.arm.wearer.height, read.arm.wearer.mass) == (WOMAN.height, WOMAN.mass)
    pose = worn.pose(60, 30)
    assert read.reaction(pose).magnitude == pytest.approx(float(worn.reaction(pose).magnitude), rel=1e-9)
    weight = sum(inertia.mass for inertia in worn.chain.model.inertias)
    assert weight == pytest.approx(worn.arm.mass + worn.device.links_mass)


def test_an_arm_that_the_robot_does_not_have_is_refused(tmp_path):
    path = ep.load("prototype").to_urdf(tmp_path)
    file = path.with_suffix(".device.toml")
    file.write_text(file.read_text().replace("mass_kg = 0.65", "mass_kg = 0.75", 1))
    with pytest.raises(ep.FileFormatError, match="not the one of the robot's file"):
        ep.load(path)


@pytest.mark.parametrize("name", ["four-cables", "optimised-table-c-2"])
def test_a_right_device_is_read_as_one(name, tmp_path):
    exo = ep.load(name, side="right").worn_by(WOMAN)
    path = exo.to_urdf(tmp_path, assumed=None)
    read = ep.load(path)
    assert (read.side, ep.load(path, side="right").side) == ("right", "right")
    pose = exo.pose(60, 30)
    force = exo.reaction(pose, limits="none").shoulder_force
    np.testing.assert_allclose(read.reaction(read.pose(60, 30), limits="none").shoulder_force, force, atol=1e-9)
    # The other side is its mirror image.
    left = ep.load(path, side="left")
    there = left.reaction(left.pose(60, 30), limits="none").shoulder_force
    assert left.side == "left"
    np.testing.assert_allclose(there * [1.0, -1.0, 1.0], force, atol=1e-9)
