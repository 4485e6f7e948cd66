"""Controllers of motor drives: derivatives of lengths, feed-forward, PI of lengths, gains, loss of the sensor."""

from dataclasses import replace

import numpy as np
import pytest
from drive_plants import held, holding

import exo_pin as ep
from exo_pin import InvalidInput, MissingData, control
from exo_pin.control.controllers.model_controller import gains_for
from exo_pin.control.controllers.wrist_lengths import length_motion

MOTORS = ["four-cables", "four-linear-actuators", "three-linear-actuators"]


def tracked(plant, controller, reference, duration=None):
    pose = reference(0.0).orientation
    run = plant.simulate(controller, duration or reference.duration, plant.held(pose, holding(plant, pose)))
    return run, (reference(run.times).orientation * run.rotations.inv()).magnitude()


def test_lengths_and_their_derivatives_are_those_of_differences():
    geometry = ep.load("four-cables").geometry
    reference = control.AnglePath([0.0, 2.0], np.radians([[0.0, 5.0, 0.0], [50.0, 40.0, 30.0]]))
    step = 1e-4
    for t in (0.3, 1.0, 1.7):
        before, now, after = (length_motion(geometry, reference(t + k * step)) for k in (-1, 0, 1))
        np.testing.assert_allclose(now.rates, (after.lengths - before.lengths) / (2 * step), atol=1e-7)
        np.testing.assert_allclose(now.accelerations, (after.rates - before.rates) / (2 * step), atol=1e-6)


@pytest.mark.parametrize("name", MOTORS)
def test_without_friction_feed_forward_follows(name):
    """What is left comes from commands that stay for 10 ms, and from the drive's inertia on a stretching limb."""
    free = {"viscous": 0.0, "coulomb": 0.0, "load_friction": 0.0}
    smooth = ep.PlantOptions(winch=control.Winch(**free), linear_actuator=control.LinearActuator(**free))
    plant = ep.Plant(ep.load(name), smooth)
    reference = control.flexion(1.0, duration=2.0, law="minimum_jerk")
    gains = replace(gains_for(plant.mechanism), stiffness=0.0, damping=0.0, integral_time=np.inf)
    run, error = tracked(plant, control.ModelController(plant, reference, gains), reference)
    assert run.status == "completed"
    assert np.degrees(error.max()) < 0.5


@pytest.mark.parametrize("name", [MOTORS[0], *(pytest.param(name, marks=pytest.mark.full) for name in MOTORS[1:])])
@pytest.mark.parametrize("kind", [control.ModelController, control.LengthController])
def test_both_controllers_follow_with_friction(name, kind):
    plant = ep.Plant(ep.load(name))
    reference = control.flexion(1.2, duration=3.0, law="minimum_jerk")
    run, error = tracked(plant, kind(plant, reference), reference)
    assert run.status == "completed"
    assert np.degrees(np.sqrt((error**2).mean())) < (0.5 if kind is control.ModelController else 2.0)
    assert np.abs(run.commands).max() < 1.0


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


def test_a_reset_controller_repeats_itself():
    plant = ep.Plant(ep.load("four-cables"))
    reference = control.abduction(0.5, duration=0.5, law="minimum_jerk")
    controller = control.LengthController(plant, reference)
    first, _ = tracked(plant, controller, reference)
    controller.reset()
    again, _ = tracked(plant, controller, reference)
    np.testing.assert_array_equal(again.commands, first.commands)


def test_cables_stay_taut_under_the_model_based_controller():
    plant = ep.Plant(ep.load("four-cables"))
    reference = control.flexion(1.2, duration=3.0, law="minimum_jerk")
    run, _ = tracked(plant, control.ModelController(plant, reference), reference)
    assert run.tensions.min() > 0.0
    assert not run.slack.any()


def test_without_the_inertial_sensor_the_arm_goes_on_along_the_reference():
    experiment = control.experiment("four-cables-abduction").replace(imu=control.Imu(lost=((1.0, 4.0),)))
    tracking = experiment.run()
    assert np.degrees(tracking.rms_error()) < 1.0


def test_gains_grow_with_the_arm_and_leave_the_prototype_alone():
    assert gains_for(ep.load("prototype").mechanism) == control.FeedbackGains()
    gains = gains_for(ep.load("four-cables").mechanism)
    arm = ep.load("four-cables").arm
    weight = arm.mass * 9.81 * np.linalg.norm(arm.centre_of_mass)
    assert gains.stiffness == pytest.approx(weight, rel=1e-3)
    assert gains.axial_share < 0.2


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


def test_what_does_not_fit_is_refused():
    prototype = ep.Plant(ep.load("prototype"))
    with pytest.raises(InvalidInput, match="motor in every limb"):
        control.LengthController(prototype, control.flexion())
    plant, tensions, start = held("four-cables")
    with pytest.raises(InvalidInput, match="reference"):
        control.LengthController(plant, "flexion")
    measured = control.Measurement(start.orientation, np.zeros(3), np.zeros(4), 0.0, np.ones(4), np.zeros(4))
    for controller in (control.LengthController, control.ModelController):
        with pytest.raises(MissingData, match="drive_positions"):
            controller(plant, control.flexion())(0.0, measured)
    assert len(tensions) == 4
