"""A design that is written as URDF keeps what its actuators cannot do: its device file says so."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import Drive


@pytest.mark.parametrize("name", ["four-cables", "four-linear-actuators-worn", "prototype"])
def test_the_verdict_of_a_design_is_that_of_its_file(name, tmp_path):
    exo = ep.load(name)
    read = ep.load(exo.to_urdf(tmp_path))
    poses = exo.pose(flexion=[-10, 20, 45, 70, 100], abduction=[0, 15, 30, 60, 20])
    answer, same = exo.reaction(poses), read.reaction(poses)
    np.testing.assert_array_equal(same.can_hold, answer.can_hold)
    for own, limb in zip(read.device.drives, exo.mechanism.limbs, strict=True):
        assert own.lower == (-600.0 if limb.actuator.family == "linear" else 0.0)
    held = same.can_hold & (same.status == "ok")
    assert (same.actuator_forces[held] >= min(own.lower for own in read.device.drives) - 1e-9).all()
    assert not read.reaction(poses, load=ep.Load([0, 0, 0], moment=[0, 1e4, 0])).can_hold.any()


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


@pytest.mark.parametrize("name", ["four-cables", "prototype", "three-linear-actuators"])
def test_a_wrist_without_masses_of_its_limbs_comes_back_whole(name, tmp_path):
    exo = ep.load(name)
    read = ep.load(exo.to_urdf(tmp_path, assumed=None))
    assert type(read) is ep.ShoulderExo
    rng = np.random.default_rng(4)
    poses = exo.pose(flexion=rng.uniform(-20, 110, 40), abduction=rng.uniform(-5, 90, 40))
    answer, same = exo.reaction(poses), read.reaction(poses)
    np.testing.assert_array_equal(same.can_hold, answer.can_hold)
    np.testing.assert_allclose(same.shoulder_force, answer.shoulder_force, atol=1e-9)
    np.testing.assert_allclose(same.actuator_forces, answer.actuator_forces, atol=1e-9)


def test_a_linear_actuator_of_a_device_file_and_a_cable_that_must_stay_taut(tmp_path):
    path = ep.load("three-linear-actuators").to_urdf(tmp_path, assumed=None)
    file = path.with_suffix(".device.toml")
    text = file.read_text()
    assert "lower_N = -400.0" in text
    file.write_text(text.replace("lower_N = -400.0", "lower_N = 5.0", 1))
    first, second, _ = ep.load(path).mechanism.limbs
    assert (first.actuator.family, first.actuator.least_tension, first.actuator.pull_limit) == ("cable", 5.0, 400.0)
    assert (second.actuator.family, second.actuator.push_limit) == ("linear", 400.0)
