"""The contact force with a device on."""

import numpy as np
import pytest
from mirror_image import mirrored

import exo_pin as ep

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

PERSON = ep.Person(1.75, 75, "male")
POSES = ep.shoulder_rotation(0, np.array([30.0, 45.0, 60.0, 75.0]), 0, degrees=True)


@pytest.fixture(scope="module")
def device():
    return ep.load("prototype").replace(limbs=None)


def test_device_that_carries_the_arm_relieves_the_joint(device):
    result = device.joint_contact(POSES, PERSON)
    assert (result.relief_percent > 25.0).all()
    assert (result.relief_percent[1:] > 55.0).all()
    assert result.assumptions["device"].startswith("limbs carry 100 %")
    # Its limbs leave no moment for the shoulder's muscles.
    moment = result.device_wrench[:, 3:]
    weight = PERSON.arm.mass * ep.load("prototype").mechanism.gravity
    carried = np.cross(POSES.as_matrix() @ PERSON.arm.centre_of_mass, weight)
    assert np.abs(moment + carried).max() < 1e-9
    # Muscles, joint and device together balance the arm.
    assert (result.residual < 1e-9).all()


def test_side_forces_of_the_mirror_image_have_the_other_sign(device):
    low, high = np.array([-20.0, -30.0, -5.0]), np.array([10.0, 15.0, 40.0])
    left = device.joint_contact(POSES[1], PERSON, "least_contact", limits=100.0, constraint_bounds=(low, high))
    bounds = {"limits": 100.0, "constraint_bounds": (-high, -low)}
    right = device.mirrored().joint_contact(mirrored(POSES[1]), PERSON, "least_contact", **bounds)
    assert np.abs(left.constraint_forces).min() > 1.0
    assert np.allclose(right.constraint_forces, -left.constraint_forces, atol=1e-4)
    for one, other in ((left, right), (right, left)):
        assert np.allclose(one.mirrored().constraint_forces, other.constraint_forces, atol=1e-4)
        assert np.allclose(one.mirrored().device_wrench, other.device_wrench, atol=1e-4)


@pytest.mark.parametrize("name", ["four-cables", "prototype"])
def test_an_arm_that_hangs_without_a_moment_misses_none(name):
    exo = ep.load(name)
    found = exo.joint_contact(exo.pose(0, 0, 0), ep.Person(1.75, 75, "male", strength=0.0), limits="none")
    assert found.residual < 1e-6
