"""Motors with gears: as limits at the joint, of a device file too, and as a rotor that a coupling turns."""

import re
import shutil

import numpy as np
import pytest
from places import URDF

import exo_pin as ep

RATIO = 50.0
MAN = ep.Wearer(1.755, 85, "male")
POSES = ep.shoulder_rotation([20, 60, 90], [10, 40, 30], [0, 20, 30], degrees=True)


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
