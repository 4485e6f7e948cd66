"""Devices as MJCF and SDF, whose device file names arm, shoulder, cuff and drives."""

import re
from pathlib import Path

import numpy as np
import pytest
from places import URDF

import exo_pin as ep

ROLES = '[roles]\narm = "arm"\nshoulder = "root_joint"\ncuff = "cuff_middle"\n'
DRIVES = 'actuated = ["internal_rotation", "abduction", "flexion"]\n'


def beside(robot, roles=ROLES):
    """Write the device file of a robot's file."""
    robot = Path(robot)
    robot.with_suffix(".device.toml").write_text(f'schema = 1\nname = "device"\nrobot = "{robot.name}"\n{roles}')
    return robot


@pytest.mark.parametrize("form", ["mjcf", "sdf"])
def test_a_device_has_one_answer_in_every_format(form, tmp_path):
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    write = exo.chain.to_mjcf if form == "mjcf" else exo.chain.to_sdf
    again = ep.load(beside(write(tmp_path), ROLES + DRIVES))
    poses = exo.pose([50.0, 10.0], [40.0, 20.0], 10.0)
    one, other = exo.reaction(poses), again.reaction(poses)
    assert (other.can_hold == one.can_hold).all()
    for name in ("shoulder_force", "actuator_forces"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), atol=1e-9, err_msg=name)
    # The same drives, those of MJCF without the limit of speed that it cannot state.
    assert [(d.joint, d.lower, d.upper, d.least) for d in again.device.drives] == [
        (d.joint, d.lower, d.upper, d.least) for d in exo.device.drives
    ]


MJCF = """<mujoco model="pole"><option gravity="0 0 -9.81"/><worldbody>
  <body name="arm"><joint name="root_joint" type="ball"/>
    <inertial pos="0 0 -0.3" mass="4" diaginertia="0.1 0.1 0.01"/>
    <body name="cuff" pos="0 0 -0.2"><inertial pos="0.02 0 0.01" mass="0.5" diaginertia="1e-3 1e-3 1e-3"/>
      <site name="cuff_middle"/></body></body></worldbody></mujoco>"""
SDF = """<sdf version="1.7"><model name="pole">
  <joint name="root_joint" type="ball"><parent>world</parent><child>arm</child></joint>
  <link name="arm"><inertial><pose>0 0 -0.3 0 0 0</pose><mass>4</mass>
    <inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.01</izz></inertia></inertial></link>
  <link name="cuff"><pose>0 0 -0.2 0 0 0</pose><inertial><pose>0.02 0 0.01 0 0 0</pose><mass>0.5</mass>
    <inertia><ixx>1e-3</ixx><iyy>1e-3</iyy><izz>1e-3</izz></inertia></inertial></link>
  <joint name="weld" type="fixed"><parent>arm</parent><child>cuff</child></joint>
  <frame name="cuff_middle" attached_to="cuff"/></model></sdf>"""


@pytest.mark.parametrize(("ending", "text"), [("xml", MJCF), ("sdf", SDF)])
def test_a_body_that_is_welded_to_the_arm_is_the_devices(ending, text, tmp_path):
    path = tmp_path / f"pole.{ending}"
    path.write_text(text)
    arm = ep.load(beside(path)).arm
    own, cuff = (next(part for part in arm.parts if part.device is which) for which in (False, True))
    assert (own.mass, cuff.mass) == pytest.approx((4.0, 0.5))
    np.testing.assert_allclose(own.centre_of_mass, [0.0, 0.0, -0.3], atol=1e-12)
    np.testing.assert_allclose(cuff.centre_of_mass, [0.02, 0.0, -0.19], atol=1e-12)
    # Another person's arm has the cuff on it all the same.
    man = ep.Wearer(1.755, 85.0, "male")
    assert ep.load(path).worn_by(man).arm.mass == pytest.approx(ep.Arm.of_wearer(man).mass + 0.5)


def test_a_device_file_without_a_robot_is_of_the_one_beside_it(tmp_path):
    robot = Path(ep.load(URDF / "serial-y-x-z.urdf").chain.to_urdf(tmp_path))
    device = robot.with_suffix(".device.toml")
    device.write_text('schema = 1\nname = "device"\n')
    assert len(ep.load(device).device.drives) == 3


def test_roles_are_stated_once_and_name_what_there_is(tmp_path):
    urdf = Path(ep.load(URDF / "serial-y-x-z.urdf").chain.to_urdf(tmp_path))
    with pytest.raises(ep.FileFormatError, match="given twice"):
        ep.load(beside(urdf))
    path = tmp_path / "pole.xml"
    path.write_text(MJCF)
    bare = ep.load(path)
    with pytest.raises(ep.InvalidInput, match="names no arm"):
        bare.device  # noqa: B018
    with pytest.raises(ep.UnknownName, match="elbow"):
        ep.load(beside(path, ROLES.replace('"arm"', '"elbow"')))
    path = tmp_path / "pole.sdf"
    path.write_text(SDF)
    with pytest.raises(ep.FileFormatError, match="hip"):
        ep.load(beside(path, ROLES.replace("root_joint", "hip")))


@pytest.mark.parametrize("form", ["urdf", "mjcf", "sdf"])
def test_a_written_device_keeps_its_cuff_on_the_next_wearer(form, tmp_path):
    exo, pose = ep.load(URDF / "serial-y-x-z.urdf"), ep.shoulder_rotation(40, 20, 0, degrees=True)
    path = getattr(exo.chain, f"to_{form}")(tmp_path)
    again = ep.load(path if form == "urdf" else beside(path, ROLES + DRIVES))
    woman = ep.Wearer(1.6, 55.0, "female")
    cuff = exo.worn_by(woman).arm.mass - ep.Arm.of_wearer(woman).mass
    assert cuff == pytest.approx(1.663)
    assert again.worn_by(woman).arm.mass - ep.Arm.of_wearer(woman).mass == pytest.approx(cuff)
    np.testing.assert_allclose(
        again.worn_by(woman).reaction(pose).shoulder_force, exo.worn_by(woman).reaction(pose).shoulder_force, atol=1e-8
    )


def test_an_exported_device_keeps_its_springs(tmp_path):
    exo = ep.load(URDF / "spring-support.urdf")
    files = exo.export(tmp_path / "other.urdf")
    assert sorted(file.name for file in files) == ["other.closures.toml", "other.device.toml", "other.urdf"]
    again, pose = ep.load(tmp_path / "other.device.toml"), exo.pose(0, 60)
    forces = [each.reaction(pose, limits="none").shoulder_force for each in (exo, again)]
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-9)
    assert len(again.device.springs) == 1


@pytest.mark.parametrize("is_device", [False, True])
def test_what_is_wrong_is_read_where_it_is_named(is_device, tmp_path):
    """Of the robot's file with a device file beside it, and without one."""
    robot = ep.load(URDF / "serial-y-x-z.urdf").to_urdf(tmp_path)
    text, count = re.subn(r'(<link name="link_2".*?ixx=")[^"]*', r"\g<1>9.0", robot.read_text(), count=1, flags=re.S)
    assert count == 1
    robot.write_text(text)
    if is_device:
        robot.with_suffix(".device.toml").write_text('schema = 1\nname = "device"\ncuff_area_m2 = 0.01\n')
    with pytest.raises(ep.ExoPinError, match=r'leave_out=\["inertia_rules"\]'):
        ep.load(robot)
    exo = ep.load(robot, leave_out=["inertia_rules"])
    assert any("inertia_rules" in text for text in exo.chain.description.left_out)
    assert (exo.device.interfaces.cuff_area is not None) == is_device
