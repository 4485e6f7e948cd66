"""The plant of any device: against the closed form of a wrist, gears with play, stiff drives."""

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, control

REST = ep.shoulder_rotation(10.0, 20.0, 0.0, degrees=True).as_matrix()


def loaded(name):
    return ep.load(URDF / f"{name}.urdf")


def moment_of_tissue(R, w):
    """A spring to a pose at rest and a damper, in N m."""
    return 3.0 * Rotation.from_matrix(REST @ R.T).as_rotvec() - 0.4 * w


def passive(t, arm):
    return moment_of_tissue(arm.matrix, arm.angular_velocity)


def nothing(t, arm):
    return np.zeros(3)


def apart(run, other):
    """Largest turn between two motions, rad."""
    return float((run.rotations * other.inv()).magnitude().max())


@pytest.mark.full
@pytest.mark.parametrize("name", ["four-cables", "three-linear-actuators", "prototype"])
def test_a_wrist_moves_the_same_in_closed_form_and_as_a_chain(name):
    exo = ep.load(name)
    plant, chain = ep.Plant(exo), ep.Plant(exo, wearer=nothing)
    pose = exo.pose(flexion=30.0, abduction=20.0)
    tensions = np.maximum(exo.reaction(pose, limits="none").actuator_forces, 5.0)
    commands = np.linspace(0.05, 0.3, plant.count)
    runs = [
        each.simulate(lambda t, seen: commands, 0.1, each.held(pose, tensions), rtol=1e-9) for each in (plant, chain)
    ]
    assert plant.equations is None
    assert chain.equations is not None
    assert [run.status for run in runs] == ["completed"] * 2
    one, other = runs
    assert apart(one, other.rotations) < 1e-7
    for key in ("lengths", "length_rates", "drive_positions"):
        np.testing.assert_allclose(getattr(one, key), getattr(other, key), atol=2e-5, err_msg=key)
    # Accelerations of up to 300 rad/s² of an arm with little inertia about its own axis.
    np.testing.assert_allclose(one.angular_acceleration, other.angular_acceleration, atol=2e-3)
    for key in ("tensions", "motor_forces", "shoulder_force"):
        np.testing.assert_allclose(getattr(one, key), getattr(other, key), atol=1e-4, err_msg=key)
    np.testing.assert_allclose(one.pressures, other.pressures, atol=1e-2)
    gain = [run.kinetic_energy + run.potential_energy - run.kinetic_energy[0] - run.potential_energy[0] for run in runs]
    np.testing.assert_allclose(*gain, atol=1e-8)


def test_a_query_along_a_run_has_idle_joints_where_the_run_has_them():
    exo = loaded("3rps-passive-ball")
    plant, pose = ep.Plant(exo, wearer=control.Passive(20.0, 1.0, source="a test")), exo.pose(10, 10)
    efforts = exo.reaction(pose, limits="none").actuator_forces[: plant.count]
    commands = efforts / np.array([drive.force_limit for drive in plant.drives])
    run = plant.simulate(lambda t, seen: commands, 0.2, plant.state(pose), control_rate=50.0)
    # The straight turn from rest would leave them elsewhere, and the shoulder 0.04 N off after 0.1 s.
    np.testing.assert_allclose(run.reaction().shoulder_force, run.link_force, atol=2e-3)


def test_a_motor_beyond_a_gear_with_play_hangs_on_one_side_of_it_and_loses_no_energy():
    exo, play, stiffness = loaded("serial-y-x-z"), 0.02, 2e3
    gear = {"inertia": 0.05, "stiffness": stiffness, "damping_time": 1e-3}
    loose, tight, rigid = (
        ep.Plant(exo, control.PlantOptions(joint_motor=control.JointMotor(**given)), wearer=passive)
        for given in (gear | {"play": play}, gear | {"stiffness": 1e5}, {"inertia": 0.05})
    )
    pose = exo.pose(20, 15)
    rest = loose.rest(near=pose)
    still = loose.simulate(lambda t, seen: np.zeros(3), 1e-6, rest)
    apart_by = still.lengths[0] - rest.drive_positions
    efforts = still.tensions[0]
    assert (np.abs(efforts) > 0.1).all()
    np.testing.assert_allclose(apart_by, -np.sign(efforts) * (0.5 * play + np.abs(efforts) / stiffness), atol=1e-9)
    load = ep.Load(np.zeros(3), still.wearer_moment[0])
    held = exo.reaction(rest.orientation, load=load, limits="none").actuator_forces
    np.testing.assert_allclose(efforts, held, atol=1e-6)
    np.testing.assert_allclose(loose.drive_states(still.lengths[0], efforts).positions, rest.drive_positions, atol=1e-9)
    found = []
    for plant in (loose, tight, rigid):
        run = plant.simulate(lambda t, seen: [0.1, 0.05, 0.02], 0.2, plant.state(pose))
        assert run.status == "completed"
        assert np.abs(run.energy_residual).max() < 1e-6
        assert np.abs(run.drive_energy_residual).max() < 1e-6
        found.append(run.rotations)
    assert (found[1] * found[2].inv()).magnitude().max() < 2e-3
    assert (found[0] * found[2].inv()).magnitude().max() > 5e-3
    with pytest.raises(InvalidInput, match="stiffness"):
        control.JointMotor(play=0.01)


def test_stiff_drives_take_implicit_steps():
    exo = loaded("serial-y-x-z")
    motor = control.JointMotor(viscous=2e4)
    plant = ep.Plant(exo, control.PlantOptions(joint_motor=motor))
    run = plant.simulate(lambda t, seen: [0.2, 0.2, 0.2], 0.05, plant.state(exo.pose(flexion=30.0)))
    assert run.status == "completed"
    # An explicit method would need a step of some millionths of a second: the inertia over the damping.
    assert run.steps < 400
