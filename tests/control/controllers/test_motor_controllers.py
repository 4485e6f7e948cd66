"""Controllers of motor drives: feed-forward, integral, a model that is not true, loss of the sensor."""

from dataclasses import replace

import numpy as np
import pytest
from drive_plants import held, holding
from places import URDF

import exo_pin as ep
from exo_pin import control
from exo_pin.device import Drive

MOTORS = ["four-cables", "four-linear-actuators", "three-linear-actuators"]


def tracked(plant, controller, reference, duration=None):
    pose = reference(0.0).orientation
    run = plant.simulate(controller, duration or reference.duration, plant.held(pose, holding(plant, pose)))
    return run, (reference(run.times).orientation * run.rotations.inv()).magnitude()


@pytest.mark.parametrize("name", MOTORS)
def test_without_friction_feed_forward_follows(name):
    """What is left comes from commands that stay for 10 ms, and from the drive's inertia on a stretching limb."""
    free = {"viscous": 0.0, "coulomb": 0.0, "load_friction": 0.0}
    smooth = ep.PlantOptions(winch=control.Winch(**free), linear_actuator=control.LinearActuator(**free))
    plant = ep.Plant(ep.load(name), smooth)
    reference = control.flexion(1.0, duration=2.0, law="minimum_jerk")
    gains = replace(control.ModelController(plant, reference).gains, stiffness=0.0, damping=0.0, integral_time=np.inf)
    run, error = tracked(plant, control.ModelController(plant, reference, gains), reference)
    assert run.status == "completed"
    assert np.degrees(error.max()) < 0.5


def test_the_integral_removes_what_the_weight_does():
    free = ep.PlantOptions(linear_actuator=control.LinearActuator(viscous=0.0, coulomb=0.0, load_friction=0.0))
    plant, _, start = held("three-linear-actuators", free)
    pose = start.orientation
    constant = control.Turn(pose, [0.0, 0.0, 1e-9], duration=1.0)
    controller = control.LengthController(plant, constant)
    heavier = ep.Plant(plant.mechanism.replace(arm=replace(plant.mechanism.arm, mass=5.5)), free)
    run = heavier.simulate(controller, 5.0, start)
    off = np.abs(run.drive_positions - plant.contractions.lengths(pose)).max(axis=1)
    assert off.max() > 5e-5
    assert off[-100:].max() < 0.02 * off.max()


def test_without_the_inertial_sensor_the_arm_goes_on_along_the_reference():
    experiment = control.experiment("four-cables-abduction").replace(imu=control.Imu(lost=((1.0, 4.0),)))
    tracking = experiment.run()
    assert np.degrees(tracking.rms_error()) < 1.0


def test_a_command_is_the_share_of_the_limit_on_its_side():
    """The effort that holds a pose is the same whatever more the drives could exert to either side."""
    pose, none, demands = ep.shoulder_rotation(30, 20, 5, degrees=True), np.zeros(3), []
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    for lower, upper in ((-90.0, 90.0), (-60.0, 90.0), (-90.0, 40.0)):
        plant = ep.Plant(
            exo.replace(drives=[Drive(d.name, d.joint, lower=lower, upper=upper) for d in exo.device.drives])
        )
        angles = plant.contractions.lengths(pose)
        seen = control.Measurement(pose, none, none, 0.0, angles, none, angles, none)
        commands = control.ModelController(plant, control.Turn(pose, [0.4, -0.5, 0.5], duration=1.0))(0.0, seen)
        demands.append([drive.demand(float(one)) for drive, one in zip(plant.drives, commands, strict=True)])
    assert (np.sign(demands[0]) == [1.0, 1.0, -1.0]).all()
    np.testing.assert_allclose(demands[1:], demands[:1] * 2, rtol=1e-12)


def test_the_model_need_not_be_true():
    """Twice the friction, a fifth of the stiffness and an arm that is 20 % heavier than the controller thinks."""
    exo = ep.load("four-cables")
    believed = ep.Plant(exo)
    winch = control.Winch(coulomb=16.0, load_friction=0.2, viscous=40.0, axial_stiffness=1.2e4)
    arm = replace(exo.arm, mass=1.2 * exo.arm.mass, inertia=1.2 * exo.arm.inertia)
    plant = ep.Plant(exo.replace(arm=arm), ep.PlantOptions(winch=winch))
    reference = control.abduction(1.2, duration=4.0, law="minimum_jerk")
    run, error = tracked(plant, control.ModelController(believed, reference), reference)
    assert run.status == "completed"
    assert np.degrees(error.max()) < 6.0
