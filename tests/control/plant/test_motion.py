"""The plant in motion: energy, MuJoCo, statics, conservation of air, and the closed chain."""

import mujoco
import numpy as np
import pytest
from drive_plants import limb_mjcf
from plant_chain import chain_run

import exo_pin as ep
from exo_pin.muscle import ConstantFriction, Valve, ValveUnit

#: Nothing that the plant has only by estimate.
FRICTIONLESS = {"muscle_damping": None, "second_flange": True}
CLOSED = ValveUnit(Valve(1e-9), Valve(1e-9), layout="fill and vent")


def drive(t, measured):
    return [-0.4 + 0.5 * t, -1.0, 0.3]


@pytest.fixture(scope="module")
def swing(prototype, abducted):
    """A lively motion without friction, with slack muscles and taut braids."""
    plant = ep.Plant(prototype, ep.PlantOptions(**FRICTIONLESS))
    start = plant.state(abducted, angular_velocity=[0.8, -1.2, 2.0], pressures=[1e5, 0.5e5, 2e5])
    return plant.simulate(drive, 2.0, start)


def test_the_energy_s_balance_closes(swing, prototype, abducted):
    assert swing.status == "completed"
    assert swing.slack.any(axis=0).all()
    assert (swing.tensions > 1.0).any(axis=0).sum() >= 2
    assert np.abs(swing.energy_residual).max() < 1e-6 * swing.kinetic_energy.max()
    assert not swing.shoulder_loss.any()
    assert not swing.drive_loss.any()
    rubbing = ep.PlantOptions(
        shoulder_viscous=0.02, shoulder_coulomb=0.1, muscle_friction=ConstantFriction(1.0), series_spring=4e3
    )
    plant = ep.Plant(prototype, rubbing)
    start = plant.state(ep.thesis_rotation(30.0, -10.0, 0.0, degrees=True), [0.0, -0.5, 0.0], [0.0, 0.0, 1e5])
    run = plant.simulate(drive, 1.0, start)
    # Into the end of the shoulder unit's range, where stops push.
    assert np.abs(run.stop_moment).max() > 0.1
    # Before it slips, friction is elastic, and gives back what it stored: up to moment times presliding over two.
    assert np.diff(run.shoulder_loss).min() > -0.1 * 2e-3
    assert run.shoulder_loss[-1] > 0.1
    assert run.drive_loss[-1].sum() > 1e-4
    assert np.abs(run.energy_residual).max() < 3e-6 * run.kinetic_energy.max()


def test_accelerations_lengths_and_energy_are_mujoco_s(swing, prototype):
    model = mujoco.MjModel.from_xml_string(limb_mjcf(prototype))
    model.opt.gravity[:] = prototype.mechanism.gravity
    data = mujoco.MjData(model)
    R = swing.rotations.as_matrix()
    for k in range(0, len(swing.times), 20):
        data.qpos[:] = np.roll(swing.rotations[k].as_quat(), 1)
        data.qvel[:] = R[k].T @ swing.angular_velocity[k]
        data.ctrl[:] = -swing.tensions[k]
        mujoco.mj_forward(model, data)
        mujoco.mj_energyVel(model, data)
        scale = max(1.0, np.abs(swing.angular_acceleration[k]).max())
        np.testing.assert_allclose(R[k] @ data.qacc, swing.angular_acceleration[k], atol=1e-8 * scale)
        np.testing.assert_allclose(data.ten_length, swing.lengths[k], atol=1e-12)
        np.testing.assert_allclose(data.ten_velocity, swing.length_rates[k], atol=1e-12)
        assert data.energy[1] == pytest.approx(swing.kinetic_energy[k], rel=1e-9)


def test_forces_along_the_run_are_the_reaction_query_s(swing):
    for split in ("spherical", "minimal", "standalone"):
        answer = swing.reaction(split)
        scale = np.abs(swing.tensions).max()
        np.testing.assert_allclose(answer.actuator_forces, swing.tensions, atol=1e-8 * scale)
    np.testing.assert_allclose(swing.reaction().shoulder_force, swing.shoulder_force, atol=1e-8 * scale)


def test_the_plant_settles_where_the_reaction_query_says(prototype, abducted):
    """Valves shut, shoulder viscous: the end is the static equilibrium, with the muscles' forces at these pressures."""
    still = ep.PlantOptions(valves=CLOSED, shoulder_viscous=0.3)
    plant = ep.Plant(prototype, still)
    start = plant.rest([1.5e5, 0.0, 3.5e5], near=abducted)
    pushed = plant.state(start.orientation, [0.3, 0.2, -0.4], start.pressures)
    run = plant.simulate(lambda t, measured: np.zeros(3), 12.0, pushed, control_rate=5.0)
    assert np.abs(run.angular_velocity[-1]).max() < 1e-6
    assert not run.stop_moment[-1].any()
    answer = prototype.reaction(run.rotations[-1])
    assert answer.actuator_forces.min() > -1e-3
    np.testing.assert_allclose(answer.actuator_forces, run.tensions[-1], atol=1e-4)
    np.testing.assert_allclose(answer.shoulder_force, run.shoulder_force[-1], atol=1e-4)
    # The air was compressed and let go again: it is the same rest.
    assert (run.rotations[-1] * start.orientation.inv()).magnitude() < 1e-5
    resting = plant.simulate(lambda t, measured: np.zeros(3), 0.2, start)
    assert np.abs(resting.angular_velocity).max() < 1e-9
    exact = prototype.reaction(start.orientation)
    np.testing.assert_allclose(exact.actuator_forces, resting.tensions[0], atol=1e-9)


def agreement(plant, start, duration, rtol):
    other, opening = chain_run(plant, drive, duration, start, rtol)
    own = plant.simulate(drive, duration, start, rtol=1e-11)
    assert other.status == own.status == "completed"
    assert opening.max() < 1e-9
    assert np.abs(other.energy_residual).max() < 1e-6 * other.kinetic_energy.max()
    np.testing.assert_allclose(other.tensions, own.tensions, atol=1e-3)
    np.testing.assert_allclose(other.angular_acceleration, own.angular_acceleration, atol=1e-2)
    return own, other, (own.rotations * other.rotations.inv()).magnitude().max()


@pytest.mark.full
def test_the_closed_chain_moves_as_the_minimal_coordinates(prototype, abducted):
    plant = ep.Plant(prototype, ep.PlantOptions(**FRICTIONLESS))
    start = plant.state(abducted, [0.3, -0.2, 0.4], [1e5, 0.0, 2.5e5])
    own, other, apart = agreement(plant, start, 0.05, 1e-9)
    assert apart < 1e-8
    np.testing.assert_allclose(other.kinetic_energy, own.kinetic_energy, atol=1e-9)
    np.testing.assert_allclose(other.potential_energy, own.potential_energy, atol=1e-9)
    np.testing.assert_allclose(other.tension_work, own.tension_work, atol=2e-8)
    np.testing.assert_allclose(other.shoulder_force, own.shoulder_force, atol=1e-3)


def test_a_right_shoulder_is_the_mirror_image(prototype, abducted):
    left = ep.Plant(prototype)
    right = ep.Plant(ep.load("prototype", side="right"))
    mirror = np.diag([1.0, -1.0, 1.0])
    turn = type(abducted).from_matrix(mirror @ abducted.as_matrix() @ mirror)
    a = left.simulate(drive, 0.5, left.state(abducted, [0.4, -3.0, 0.2], 1e5))
    b = right.simulate(drive, 0.5, right.state(turn, [-0.4, -3.0, -0.2], 1e5))
    assert np.abs(a.stop_moment).max() > 0.0
    np.testing.assert_allclose(b.rotations.as_matrix(), mirror @ a.rotations.as_matrix() @ mirror, atol=1e-6)
    np.testing.assert_allclose(b.tensions, a.tensions, atol=1e-3)
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ mirror, atol=1e-3)
