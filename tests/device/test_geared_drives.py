"""Motors with gears: as limits at the joint, of a device file too, and as a rotor that a coupling turns."""

import re
import shutil

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import FileFormatError

RATIO = 50.0
MAN = ep.Wearer(1.755, 85, "male")
POSES = ep.shoulder_rotation([20, 60, 90], [10, 40, 30], [0, 20, 30], degrees=True)
MOTOR = """schema = 1
name = "serial"

[[drives]]
name = "flexion"
joint = "flexion"
[drives.motor]
torque_N_m = 0.2
ratio = 50.0
speed_rad_s = 300.0
"""


@pytest.fixture
def serial(tmp_path):
    """The serial device's files in a folder where others can stand beside them."""
    for ending in (".urdf", ".closures.toml"):
        shutil.copy(URDF / f"serial-y-x-z{ending}", tmp_path / f"serial{ending}")
    return tmp_path / "serial.urdf"


def test_a_rotor_with_a_gear_bears_the_moment_over_the_ratio(serial):
    plain = ep.load(serial).worn_by(MAN)
    urdf, closures = serial.read_text(), serial.with_suffix(".closures.toml")
    hinge = re.search(r'<joint name="flexion".*?</joint>', urdf, re.DOTALL)[0]
    rotor = hinge.replace('"flexion"', '"motor"').replace('"revolute"', '"continuous"').replace('"frame"', '"rotor"')
    rotor = re.sub(r'lower="[^"]*" upper="[^"]*"', "", rotor)
    inertia = '<inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/>'
    link = f'<link name="rotor"><inertial><mass value="1e-3"/>{inertia}</inertial></link>'
    serial.write_text(urdf.replace(hinge, hinge + link + rotor))
    gear = f"""[[closures]]
name = "gear"
type = "coupling"
joint_a = "motor"
joint_b = "flexion"
polynomial = [0.0, {1.0 / RATIO}]

[roles]"""
    text = closures.read_text().replace('"abduction", "flexion"]', '"abduction", "motor"]').replace("[roles]", gear)
    closures.write_text(text)
    geared = ep.load(serial).worn_by(MAN)
    one, other = plain.reaction(POSES), geared.reaction(POSES)
    np.testing.assert_allclose(other.actuator_forces, one.actuator_forces / [1.0, 1.0, RATIO], atol=1e-9)
    np.testing.assert_allclose(other.shoulder_force, one.shoulder_force, atol=1e-9)


def test_a_motor_of_a_device_file_gives_its_torque_times_the_ratio(serial, tmp_path):
    robot = ep.load(serial).worn_by(MAN)
    serial.with_suffix(".device.toml").write_text(MOTOR)
    exo = ep.load(serial).worn_by(MAN)
    (drive,) = (each for each in exo.device.drives if each.name == "flexion")
    assert (drive.lower, drive.upper, drive.speed_limit) == (-10.0, 10.0, 6.0)
    answer = exo.reaction(POSES)
    flexion = [name for name, _ in answer.drive_units].index("flexion")
    np.testing.assert_array_equal(answer.held, np.abs(answer.actuator_forces[:, flexion]) <= 10.0)
    assert 0 < answer.held.sum() < 3
    # What the file leaves out is the robot's: the travel of the joint, and the other drives.
    far = robot.pose(20.0, 96.0)
    assert robot.reaction(far).status == exo.reaction(far).status == "out_of_stroke"
    assert drive.greatest == robot.device.drives[flexion].greatest
    assert len(exo.device.drives) == 3
    quick = ep.Motion([0.0, -7.0, 0.0], [0.0, 0.0, 0.0])
    assert robot.reaction(robot.pose(20.0), quick).held
    assert exo.reaction(exo.pose(20.0), quick).status == "beyond_limits"
    back = ep.load(exo.to_urdf(tmp_path / "back"))
    assert {each.name: each for each in back.device.drives}["flexion"] == drive


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[drives.motor]", "upper_N_m = 5.0\n[drives.motor]", "either a motor"),
        ('joint = "flexion"\n', '[[drives.points]]\nlink = "arm"\npoint_m = [0, 0, 0]\n' * 2, "expected a joint"),
        ("ratio = 50.0\n", "", "ratio"),
        ("speed_rad_s", "speed_m_s", "unknown key"),
    ],
)
def test_a_wrong_motor_is_refused(serial, old, new, said):
    serial.with_suffix(".device.toml").write_text(MOTOR.replace(old, new))
    with pytest.raises(FileFormatError, match=said):
        ep.load(serial)
