"""Winches and linear actuators: motion against two other engines, energy, static ends, motor, stops, faults."""

import mujoco
import numpy as np
import pytest
from drive_plants import SMOOTH, held, integrated, limb_mjcf
from plant_chain import chain_run
from scipy.integrate import solve_ivp

import exo_pin as ep
from exo_pin import MissingData, control
from exo_pin.control.plant.equations.drive_kernels import motor_rates
from exo_pin.reaction.constraints.given_limits import given_forces

SPIN = (0.3, -0.2, 0.4)
MOTORS = ["four-cables", "three-linear-actuators"]


def shaken(plant, tensions):
    """Motor forces around those that hold, as commands at a time; constant between samples of 100 Hz."""
    limit = np.array([drive.force_limit for drive in plant.drives])
    return lambda t, measured=None: tensions / limit * (1.0 + 0.3 * np.sin(5.0 * np.floor(100.0 * t + 1e-6) / 100.0))


@pytest.mark.full
@pytest.mark.parametrize("name", [MOTORS[0], pytest.param(MOTORS[1], marks=pytest.mark.full)])
def test_the_motion_is_that_of_an_integration_of_its_own(name):
    plant, tensions, start = held(name, SMOOTH, spin=SPIN)
    run = plant.simulate(shaken(plant, tensions), 0.3, start, rtol=1e-11)
    constant = plant.simulate(lambda t, measured: tensions / 400.0, 0.6, start, rtol=1e-11)
    assert constant.status == "completed"
    other = integrated(plant, start, lambda t: tensions, constant.times)
    # Tensions are far from constant, and of the cables one goes slack.
    assert np.ptp(constant.tensions, axis=0).max() > 20.0
    assert constant.slack.any() == (name == "four-cables")
    assert (constant.rotations * other.inv()).magnitude().max() < 1e-8
    assert run.status == "completed"


def test_a_drive_in_its_play_swings_as_a_mass_between_two_springs():
    play, speed, length = 2e-3, 0.05, 0.4
    plant = ep.Plant(ep.load("three-linear-actuators"), SMOOTH.replace(play=play))
    own, free = plant.drives[0], (0.0, 1.0, 0.0, 1.0)

    def rate(t, x):
        return [x[1], motor_rates(own.row(), free, length, 0.0, x[0], x[1], 0.0)[1]]

    # Half a swing on a spring at either end, and twice across the play.
    period = 2.0 * np.pi * np.sqrt(own.parameters.mass / own.stiffness) + 2.0 * play / speed
    found = solve_ivp(rate, (0.0, period), [length, speed], rtol=1e-10, atol=1e-13, max_step=1e-4)
    np.testing.assert_allclose(found.y[:, -1], [length, speed], rtol=1e-6)
    beyond = found.y[0].max() - length - 0.5 * play
    assert beyond == pytest.approx(speed * np.sqrt(own.parameters.mass / own.stiffness), rel=1e-3)


@pytest.mark.full
@pytest.mark.parametrize("name", MOTORS)
def test_with_play_the_motion_is_that_of_an_integration_of_its_own(name):
    plant, tensions, start = held(name, SMOOTH.replace(play=5e-4), spin=SPIN)
    run = plant.simulate(lambda t, measured: tensions / 400.0, 0.1, start, rtol=1e-11)
    other = integrated(plant, start, lambda t: tensions, run.times)
    # Every way across the play multiplies what two integrations differ by.
    assert (run.rotations * other.inv()).magnitude().max() < 1e-7
    assert (run.tensions == 0.0).any()
    total = run.kinetic_energy + run.potential_energy + (run.stored_energy - run.source_work).sum(axis=1)
    assert np.abs(total - total[0]).max() < 1e-6 * run.kinetic_energy.max()
    whole, _ = chain_run(plant, lambda t, measured: tensions / 400.0, 0.05, start, 1e-9)
    assert (whole.rotations * run.rotations[: len(whole.times)].inv()).magnitude().max() < 1e-6


@pytest.mark.parametrize("name", MOTORS)
def test_accelerations_are_mujoco_s(name):
    plant, tensions, start = held(name, None, spin=SPIN)
    run = plant.simulate(shaken(plant, tensions), 0.5, start)
    exo = ep.ShoulderExo.from_mechanism(plant.mechanism)
    model = mujoco.MjModel.from_xml_string(limb_mjcf(exo))
    model.opt.gravity[:] = plant.mechanism.gravity
    data, R = mujoco.MjData(model), run.rotations.as_matrix()
    for k in range(0, len(run.times), 10):
        data.qpos[:] = np.roll(run.rotations[k].as_quat(), 1)
        data.qvel[:] = R[k].T @ run.angular_velocity[k]
        data.ctrl[:] = -run.tensions[k]
        mujoco.mj_forward(model, data)
        scale = max(1.0, np.abs(run.angular_acceleration[k]).max())
        np.testing.assert_allclose(R[k] @ data.qacc, run.angular_acceleration[k], atol=1e-8 * scale)
        np.testing.assert_allclose(data.ten_length, run.lengths[k], atol=1e-12)


@pytest.mark.parametrize("name", MOTORS)
def test_energy_is_conserved_and_accounted_for(name):
    plant, tensions, start = held(name, SMOOTH, spin=SPIN)
    run = plant.simulate(lambda t, measured: tensions / 400.0, 1.0, start, rtol=1e-10)
    scale = run.kinetic_energy.max()
    total = run.kinetic_energy + run.potential_energy + (run.stored_energy - run.source_work).sum(axis=1)
    assert np.abs(total - total[0]).max() < 1e-6 * scale
    assert np.abs(run.drive_loss).max() == 0.0
    # Constant forces work by how far the drives moved.
    moved = run.drive_positions - run.drive_positions[0]
    np.testing.assert_allclose(run.source_work, -tensions * moved, atol=1e-8)
    plant, tensions, start = held(name, spin=SPIN)
    rough = plant.simulate(shaken(plant, tensions), 1.0, start, rtol=1e-10)
    assert np.abs(rough.energy_residual).max() < 1e-6 * scale
    assert np.abs(rough.drive_energy_residual).max() < 1e-6 * scale
    assert (np.diff(rough.drive_loss, axis=0) > -1e-3).all()
    assert rough.drive_loss[-1].min() > 0.0


@pytest.mark.parametrize("name", ["four-cables", "four-linear-actuators", "three-linear-actuators"])
def test_static_ends_are_those_of_the_reaction_query(name):
    plant, _, start = held(name)
    exo = ep.ShoulderExo.from_mechanism(plant.mechanism)
    rest = plant.rest(
        near=start.orientation, drive_positions=start.drive_positions - np.array([2e-3, 0.0, 1e-3, 0.0])[: plant.count]
    )
    assert (rest.orientation * start.orientation.inv()).magnitude() > 1e-4
    run = plant.simulate(
        lambda t, measured: np.zeros(plant.count),
        0.01,
        rest,
        faults=[ep.Fault("no current", i) for i in range(plant.count)],
    )
    tensions = run.tensions[0]
    answer = exo.reaction(rest.orientation, limits=given_forces(tensions[None]) if plant.count > 3 else "none")
    scale = np.abs(tensions).max()
    np.testing.assert_allclose(answer.actuator_forces, tensions, atol=1e-9 * scale)
    np.testing.assert_allclose(answer.shoulder_force, run.shoulder_force[0], atol=1e-9 * scale)
    assert answer.residual < 1e-8 * scale


def test_inertia_and_stiffness_are_those_of_the_parts():
    winch = control.Winch()
    assert winch.mass == pytest.approx((4.4e-6 * 26.0**2 + 1.4e-5) / 0.02**2)
    assert winch.series_stiffness(0.5) == pytest.approx(5.8e4)
    screw = control.LinearActuator()
    assert screw.mass == pytest.approx((4.4e-6 + 2.3e-6) * (2.0 * np.pi / 0.005) ** 2)


def test_presets_that_make_a_plant_are_named_where_one_does_not():
    with pytest.raises(MissingData) as caught:
        ep.Plant(ep.load("scenario-one"))
    assert caught.value.missing[:2] == ("limbs[0].actuator.force_law", "limbs[0].stroke.end_fitting")
    named = str(caught.value).partition("presets with all of it: ")[2].split(", ")
    assert {"prototype", *MOTORS} < set(named)
    for name in named:
        ep.Plant(ep.load(name))
