"""The plant of any device: against plants of one's own, and against the compiled plant of a wrist."""

import numpy as np
import pytest
from hinged_devices import HingedDevice, turns_of
from places import URDF
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control
from exo_pin.core.errors import InvalidInput
from exo_pin.device.device_model import DeviceModel

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
@pytest.mark.parametrize(("name", "rotor"), [("serial-y-x-z", 0.05), ("spherical-3rrr", 0.0)])
def test_hinged_devices_move_as_their_own_plants_with_the_persons_passive_moment(name, rotor):
    exo = loaded(name)
    pose = exo.pose(flexion=30.0, abduction=15.0)
    limits = np.array([drive.upper for drive in exo.device.as_chain().drives])
    # Most of what would hold the arm.
    commands = 0.8 * exo.reaction(pose, limits="none").actuator_forces / limits
    options = control.PlantOptions(joint_motor=control.JointMotor(inertia=rotor))
    plant = ep.Plant(exo, options, wearer=passive)
    run = plant.simulate(lambda t, seen: commands, 1.0, plant.state(pose), control_rate=10.0, rtol=1e-10)
    found, rates = HingedDevice(exo.device, rotor).run(
        run.times, turns_of(exo.device, pose), lambda t: commands * limits, lambda t, R, w: moment_of_tissue(R, w)
    )
    assert run.status == "completed"
    assert (run.rotations[-1] * pose.inv()).magnitude() > 0.05
    assert apart(run, found) < 1e-7
    np.testing.assert_allclose(run.angular_velocity, rates, atol=1e-6)
    # Energy with the person in it, and the efforts that the reaction query finds for the motion.
    assert np.abs(run.energy_residual).max() < 1e-8 * run.kinetic_energy.max()
    assert np.abs(run.drive_energy_residual).max() < 1e-8
    np.testing.assert_allclose(run.reaction(limits="none").actuator_forces, run.tensions, atol=1e-8)


def test_spring_support_moves_as_its_own_plant():
    exo = loaded("spring-support")
    device = exo.device.as_chain()
    (spring,), arm = device.springs, device.arm
    at = DeviceModel(device).cuff
    low = np.array(spring.route.points[0].point)
    c, g = arm.centre_of_mass, np.array(device.gravity)
    inertia = arm.inertia + arm.mass * (c @ c * np.eye(3) - np.outer(c, c))
    pose = exo.pose(flexion=50.0, abduction=20.0)

    def rate(t, y):
        R, w = Rotation.from_quat(y[:4]).as_matrix(), y[4:]
        span = R @ at - low
        pull = -span / np.linalg.norm(span) * float(spring.law.force(np.linalg.norm(span)))
        moment = np.cross(R @ at, pull) + np.cross(R @ c, arm.mass * g) + moment_of_tissue(R, w)
        own = R @ inertia @ R.T
        x, yy, z, s = y[:4]
        a, b, d = w
        turn = [s * a + b * z - d * yy, s * b + d * x - a * z, s * d + a * yy - b * x, -a * x - b * yy - d * z]
        return np.concatenate([0.5 * np.array(turn), np.linalg.solve(own, moment - np.cross(w, own @ w))])

    plant = ep.Plant(exo, wearer=passive)
    run = plant.simulate(lambda t, seen: [], 1.0, plant.state(pose), control_rate=20.0, rtol=1e-10)
    own = solve_ivp(rate, (0.0, 1.0), [*pose.as_quat(), 0.0, 0.0, 0.0], "DOP853", run.times, rtol=1e-11, atol=1e-12)
    assert apart(run, Rotation.from_quat(own.y[:4].T)) < 1e-7
    assert np.abs(run.energy_residual).max() < 1e-6
    # No drive: the device is the spring, whose pull and the weight give F_s by the arm's momentum.
    at_all = run.rotations.as_matrix() @ at - low
    lengths = np.linalg.norm(at_all, axis=1)
    pull = -at_all * (spring.law.force(lengths) / lengths)[:, None]
    C, w = run.rotations.as_matrix() @ c, run.angular_velocity
    acceleration = np.cross(run.angular_acceleration, C) + np.cross(w, np.cross(w, C))
    np.testing.assert_allclose(run.shoulder_force, arm.mass * (acceleration - g) - pull, atol=1e-8)
    # The ring weighs on the device, and not on the cuff's grip of the person's arm.
    (ring,) = (part for part in arm.parts if part.device)
    at_ring = run.rotations.as_matrix() @ ring.centre_of_mass
    swing = np.cross(run.angular_acceleration, at_ring) + np.cross(w, np.cross(w, at_ring))
    np.testing.assert_allclose(run.cuff_wrench[:, :3], pull + ring.mass * (g - swing), atol=1e-8)
    asked = run.reaction(limits="none")
    np.testing.assert_allclose(run.cuff_wrench, asked.cuff_wrench, atol=1e-8)


@pytest.mark.full
def test_dry_friction_of_hinges_brakes_the_arm_or_holds_it(tmp_path):
    """A fifth of the holding efforts is missing, less than 1 N m in each hinge; friction takes it up, or some of it."""
    text, moved = (URDF / "serial-y-x-z.urdf").read_text(), {}
    (tmp_path / "rubbed.closures.toml").write_text((URDF / "serial-y-x-z.closures.toml").read_text())
    for friction in (0.0, 0.3, 8.0):
        rubbed = text.replace('type="revolute">', f'type="revolute"><dynamics damping="0" friction="{friction}"/>')
        (tmp_path / "rubbed.urdf").write_text(rubbed)
        exo = ep.load(tmp_path / "rubbed.urdf")
        pose = exo.pose(flexion=30.0, abduction=15.0)
        holding = exo.reaction(pose, limits="none").actuator_forces
        assert 0.5 < np.abs(0.2 * holding).max() < 1.0
        commands = 0.8 * holding / [drive.upper for drive in exo.device.as_chain().drives]
        plant = ep.Plant(exo, wearer=nothing)
        run = plant.simulate(lambda t, seen, commands=commands: commands, 0.6, plant.state(pose), control_rate=10.0)
        moved[friction] = float((run.rotations[-1] * pose.inv()).magnitude())
        assert np.abs(run.energy_residual).max() < 1e-6
    # Bristles bend by a milliradian before a hinge slips.
    assert moved[8.0] < 1e-3
    assert 0.05 < moved[0.3] < 0.08
    assert moved[0.0] > 0.1


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


def test_a_rotor_of_a_motor_loads_the_shoulder_as_that_of_the_robots_file():
    exo, inertia = loaded("3rps-passive-ball"), 2.0
    model = exo.chain.model.copy()
    model.armature[exo.chain.velocity_indices([drive.joint for drive in exo.device.drives])] = inertia
    heavy = exo.replace(chain=ep.ClosedChain(model, exo.chain.description))
    motor = control.PlantOptions(joint_motor=control.JointMotor(inertia=inertia))
    runs = []
    for plant in (ep.Plant(exo, motor), ep.Plant(heavy)):
        run = plant.simulate(lambda t, seen: [0.1, -0.05, 0.08], 0.02, plant.state(exo.pose(20, 10)))
        assert run.status == "completed"
        runs.append(run)
    one, other = runs
    assert np.linalg.norm(one.shoulder_force, axis=1).min() > 10.0
    np.testing.assert_allclose(one.shoulder_force, other.shoulder_force, atol=1e-6)
    np.testing.assert_allclose(one.cuff_wrench, other.cuff_wrench, atol=1e-6)


def test_a_run_asks_in_the_configurations_that_its_idle_joints_have():
    exo = loaded("3rps-passive-ball")
    plant = ep.Plant(exo)
    run = plant.simulate(lambda t, seen: [0.1, -0.05, 0.08], 0.05, plant.state(exo.pose(20, 10)))
    asked = exo.reaction(run.rotations, **run.question()).shoulder_force
    np.testing.assert_allclose(asked, run.reaction().shoulder_force, atol=1e-9)
    # The query leaves out how fast these joints move.
    np.testing.assert_allclose(asked, run.shoulder_force, atol=0.01)


def test_a_joint_that_jams_stands_still():
    """The first step after it, of which the friction is stiff, is taken again where it blows up."""
    exo = loaded("serial-y-x-z")
    plant = ep.Plant(exo, control.PlantOptions(joint_motor=control.JointMotor(inertia=0.05)))
    pose = exo.pose(flexion=40.0, abduction=10.0)
    start = plant.held(pose, exo.reaction(pose, limits="none").actuator_forces)
    jam = ep.Fault("jam", limb=0, start=0.05)
    run = plant.simulate(lambda t, seen: np.full(3, 0.05), 0.1, start, faults=[jam])
    assert run.status == "completed"
    after = run.lengths[run.times > 0.05, 0]
    assert np.ptp(after) < 2.0 * plant.options.joint_motor.presliding  # rad: the friction holds up to there


def test_a_torn_motor_of_a_joint_takes_no_energy_any_more():
    exo = loaded("serial-y-x-z")
    motor = control.JointMotor(coulomb=0.2, viscous=0.1, load_friction=0.05, inertia=0.05)
    plant = ep.Plant(exo, control.PlantOptions(joint_motor=motor))
    start = plant.state(exo.pose(30.0, 20.0))
    run = plant.simulate(lambda t, seen: np.full(3, 0.15), 0.1, start, faults=[ep.Fault("torn", 1, 0.05)])
    after = run.times >= 0.05
    assert np.ptp(run.electric_energy[after], axis=0)[[0, 2]].min() > 0.1
    assert np.ptp(run.electric_energy[after, 1]) < 1e-9
    assert np.abs(run.drive_energy_residual).max() < 1e-6
