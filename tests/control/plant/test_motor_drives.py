"""Winches and linear actuators: motion against two other engines, energy, static ends."""

import mujoco
import numpy as np
import pytest
from drive_plants import SMOOTH, held, integrated, limb_mjcf

import exo_pin as ep
from exo_pin import MissingData, control

SPIN = (0.3, -0.2, 0.4)
MOTORS = ["four-cables", "three-linear-actuators"]


def shaken(plant, tensions):
    """Motor forces around those that hold, as commands at a time; constant between samples of 100 Hz."""
    limit = np.array([drive.force_limit for drive in plant.drives])
    return lambda t, measured=None: tensions / limit * (1.0 + 0.3 * np.sin(5.0 * np.floor(100.0 * t + 1e-6) / 100.0))


@pytest.mark.full
@pytest.mark.parametrize("play", [0.0, 5e-4])
@pytest.mark.parametrize("name", MOTORS)
def test_the_motion_is_that_of_an_integration_of_its_own(name, play):
    plant, tensions, start = held(name, SMOOTH.replace(play=play), spin=SPIN)
    run = plant.simulate(lambda t, measured: tensions / 400.0, 0.1 if play else 0.6, start, rtol=1e-11)
    other = integrated(plant, start, lambda t: tensions, run.times)
    # Tensions are far from constant, and some cables go slack; every way across the play multiplies what differs.
    assert np.ptp(run.tensions, axis=0).max() > 20.0
    assert (run.tensions == 0.0).any() or not (play or name == "four-cables")
    assert (run.rotations * other.inv()).magnitude().max() < (1e-7 if play else 1e-8)
    total = run.kinetic_energy + run.potential_energy + (run.stored_energy - run.source_work).sum(axis=1)
    assert np.abs(total - total[0]).max() < 1e-6 * run.kinetic_energy.max()


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
    answer, scale = run.reaction(), np.abs(run.tensions[0]).max()
    np.testing.assert_allclose(answer.actuator_forces[0], run.tensions[0], atol=1e-9 * scale)
    np.testing.assert_allclose(answer.shoulder_force[0], run.shoulder_force[0], atol=1e-9 * scale)
    assert np.abs(run.angular_acceleration[0]).max() < 1e-6


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
