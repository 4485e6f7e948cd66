"""The person in the plant: payloads, pushes, ends of the range, torso; controllers with a person in the loop."""

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control

#: Rotors behind gears: without them an arm has too little inertia about its own axis for a damper at 100 Hz.
GEARED = control.PlantOptions(joint_motor=control.JointMotor(inertia=0.3))
SERIAL = URDF / "serial-y-x-z.urdf"


def still(pose):
    """A reference that stands."""
    return lambda t: control.ReferenceState(pose, np.zeros(3), np.zeros(3))


def bare_arm(**more):
    """An arm without a device: one free point mass more than none."""
    return ep.Plant(ep.load(URDF / "prototype-shoulder.urdf"), **more)


def no_command(t, seen):
    return []


def test_a_dropped_payload_is_a_fall_from_there_on():
    start, at = bare_arm().state(ep.shoulder_rotation(40.0, 0.0, 0.0, degrees=True)), (0.0, 0.0, -0.3)
    cup = control.Payload(0.5, at, end=0.1)
    run = bare_arm(payloads=cup).simulate(no_command, 0.2, start)
    assert np.abs(run.energy_residual).max() < 1e-9
    alone = bare_arm().simulate(no_command, 0.1, _without_payload(run.state(0.1)))
    np.testing.assert_allclose(alone.rotations[-1].as_matrix(), run.rotations[-1].as_matrix(), atol=1e-9)
    # With it the arm is a pendulum of more inertia, whose weight acts besides.
    heavier = bare_arm().mechanism.arm + ep.Arm(0.5, at, np.zeros((3, 3)))
    device = ep.load(URDF / "prototype-shoulder.urdf").device.replace(arm=heavier)
    own = ep.Plant(device).simulate(no_command, 0.1, start)
    np.testing.assert_allclose(own.rotations[-1].as_matrix(), run.rotations[10].as_matrix(), atol=1e-9)


def _without_payload(state):
    return bare_arm().state(state.orientation, state.angular_velocity)


def test_a_caught_payload_takes_part_by_a_plastic_impact():
    start, at = bare_arm().state(ep.shoulder_rotation(60.0, 0.0, 0.0, degrees=True)), np.array([0.0, 0.0, -0.3])
    cup = control.Payload(0.4, tuple(at), start=0.1)
    run = bare_arm(payloads=cup).simulate(no_command, 0.2, start, sample_rate=1000.0)
    before, after = run.angular_velocity[100], run.angular_velocity[101]
    tables, R = run.plant.tables, run.rotations[100].as_matrix()
    p = R @ at
    mass = R @ tables.inertia @ R.T
    more = 0.4 * (p @ p * np.eye(3) - np.outer(p, p))
    caught = np.linalg.solve(mass + more, mass @ before)
    # A millisecond of weight later.
    np.testing.assert_allclose(after, caught, atol=0.05)
    assert np.linalg.norm(after - before) > 0.3
    assert np.abs(run.energy_residual).max() < 1e-8
    rest = run.plant.simulate(no_command, 0.1, run.state(0.1), sample_rate=1000.0)
    assert (rest.chain[-1] == run.chain[-1]).all()


def test_a_push_is_a_load_while_it_lasts():
    start = bare_arm().state()
    load = ep.Load([5.0, 0.0, 0.0], [0.0, 0.1, 0.0], at=(0.0, 0.0, -0.2))
    run = bare_arm(wearer=control.Push(load, 0.05, 0.1)).simulate(no_command, 0.2, start)
    pushed = (run.times >= 0.05 - 1e-9) & (run.times < 0.1 - 1e-9)
    np.testing.assert_allclose(run.wearer_force[pushed], np.tile([5.0, 0.0, 0.0], (pushed.sum(), 1)))
    assert not run.wearer_force[~pushed].any()
    assert np.abs(run.energy_residual).max() < 1e-9
    np.testing.assert_allclose(run.external_load().force, run.wearer_force)
    # The shoulder's share of the force is that of the arm's momentum.
    np.testing.assert_allclose(run.cuff_wrench, 0.0, atol=1e-8)


@pytest.mark.full
@pytest.mark.parametrize("axis", np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0.0], [0.0, 0.6, -0.8]]]).tolist())
def test_impedance_is_the_stiffness_that_a_push_finds(axis):
    exo = ep.load(SERIAL)
    pose, couple = exo.pose(30.0, 20.0, 10.0), 2.0 * np.array(axis)
    push = control.Push(ep.Load(np.zeros(3), couple))
    plant = ep.Plant(exo, GEARED, wearer=push)
    controller = control.impedance(plant, still(pose), stiffness=40.0, damping=12.0)
    run = plant.simulate(controller, 2.0, plant.state(pose), rtol=1e-6)
    turned = (run.rotations[-1] * pose.inv()).as_rotvec()
    assert couple @ turned / (turned @ turned) == pytest.approx(40.0, rel=0.05)


@pytest.mark.full
@pytest.mark.parametrize("name", ["six-cables.urdf", "four-linear-actuators-worn"])
def test_drives_with_a_loop_of_their_own_give_way_as_asked(name):
    """Their dry friction holds a part of the push; without it the arm has the stiffness asked for."""
    exo = ep.load(URDF / name if name.endswith("urdf") else name)
    pose, smooth = exo.pose(30.0, 20.0), {"coulomb": 0.0, "load_friction": 0.0}
    found = []
    for given in (smooth, {}):
        options = control.PlantOptions(winch=control.Winch(**given), linear_actuator=control.LinearActuator(**given))
        plant = ep.Plant(exo, options, wearer=control.Push(ep.Load(np.zeros(3), [0.0, 10.0, 0.0])))
        controller = control.impedance(plant, still(pose), 20.0, 3.0)
        least, greatest = plant.force_limits(plant.contractions.lengths(pose))
        start = plant.held(pose, controller.plans.tensions(pose, None, greatest, least, None).tensions)
        run = plant.simulate(controller, 1.5, start, rtol=1e-5)
        turned = (run.rotations[-1] * pose.inv()).as_rotvec()
        found.append(10.0 * turned[1] / (turned @ turned))
    assert found[0] == pytest.approx(20.0, rel=0.05)
    assert found[1] > 22.0


@pytest.mark.full
def test_gravity_compensation_leaves_the_arm_where_it_is_and_a_share_of_the_weight_to_the_wearer():
    exo = ep.load(SERIAL)
    pose = exo.pose(40.0, 10.0)
    plant = ep.Plant(exo)
    run = plant.simulate(control.gravity_compensation(plant), 0.5, plant.state(pose), rtol=1e-6)
    assert (run.rotations[-1] * pose.inv()).magnitude() < 1e-3
    half = control.gravity_compensation(plant, share=0.5)
    fall = plant.simulate(half, 0.02, plant.state(pose), rtol=1e-6)
    # What the drives do not carry turns arm and links; held still they carry themselves, and half of the person's arm.
    assert np.linalg.norm(fall.angular_acceleration[0]) > 0.1
    arm = exo.arm.person
    weight = np.cross(pose.as_matrix() @ arm.centre_of_mass, arm.mass * plant.tables.gravity)
    held = exo.reaction(pose, load=ep.Load(np.zeros(3), -0.5 * weight), limits="none")
    np.testing.assert_allclose(fall.tensions[0], held.actuator_forces, atol=1e-9)


@pytest.mark.full
def test_assistance_as_needed_gives_what_lacks_and_forgets_it():
    exo = ep.load(SERIAL)
    pose = exo.pose(30.0, 20.0)
    tables = ep.Plant(exo).tables

    def end(lacking):
        """Turn from the reference of an arm whose person carries the weight but for a moment, rad."""

        def person(t, arm):
            return -np.cross(arm.matrix @ tables.centre, tables.mass * tables.gravity) - lacking

        plant = ep.Plant(exo, GEARED, wearer=person)
        controller = control.assist_as_needed(plant, still(pose), 40.0, 12.0, 0.05, 0.5, 1.0)
        run = plant.simulate(controller, 6.0, plant.state(pose), rtol=1e-6)
        return (run.rotations[-1] * pose.inv()).as_rotvec()

    lacking = np.array([0.0, 6.0, 0.0])
    turned = end(lacking)
    assert np.linalg.norm(turned) == pytest.approx(0.05 + 6.0 / (40.0 * 3.0), rel=0.05)
    assert turned @ lacking < 0.0
    assert np.linalg.norm(end(np.zeros(3))) < 0.05


@pytest.mark.full
def test_admittance_gives_way_by_its_own_spring():
    exo = ep.load(SERIAL)
    pose, couple = exo.pose(30.0, 20.0), np.array([0.0, 3.0, 0.0])
    plant = ep.Plant(exo, GEARED, wearer=control.Push(ep.Load(np.zeros(3), couple), start=0.1))
    gains = control.FeedbackGains(stiffness=150.0, damping=25.0, integral_time=np.inf)
    controller = control.AdmittanceController(plant, still(pose), 0.5, 8.0, 20.0, gains)
    run = plant.simulate(controller, 2.5, plant.state(pose), rtol=1e-6)
    np.testing.assert_allclose(controller.interaction, couple, atol=0.1)
    virtual = controller._virtual.orientation
    assert (virtual * pose.inv()).magnitude() == pytest.approx(3.0 / 20.0, rel=0.05)
    assert (run.rotations[-1] * virtual.inv()).magnitude() < 0.05


@pytest.mark.parametrize("side", ["left", "right"])
def test_ends_of_a_person_are_those_of_their_model(side):
    person, poses = ep.Person(1.75, 75, "male", side=side), Rotation.random(800, rng=2)
    names = ("elevation", "axial rotation")
    ends = control.JointStops({name: person.range_of_motion[name] for name in names}, 50.0, 0.0, side, source="a test")
    outside = person.limb_state(poses).outside
    assert ((ends.depth(poses) > 0.0) == outside[:, 1:].any(axis=1)).all()
    # The model counts the plane of elevation from 3.37° further, and not where the arm hangs.
    off = np.radians(3.368)
    plane = control.JointStops({"plane of elevation": (off - 1.658, off + 2.269)}, 50.0, 0.0, side, source="a test")
    raised = -poses.as_matrix()[:, 2, 2] > -np.cos(np.radians(10.0))
    assert ((plane.depth(poses) > 0.0) == outside[:, 0])[raised].all()


def test_an_arm_that_swings_into_an_end_comes_back():
    ends = control.JointStops({"elevation": (0.0, 0.6)}, 200.0, 0.0, source="a test")
    start = bare_arm().state(angular_velocity=[0.0, -6.0, 0.0])
    run = bare_arm(wearer=ends).simulate(no_command, 0.5, start)
    depth = ends.depth(run.rotations)
    assert 0.02 < depth.max() < 0.3
    assert depth[-1] == 0.0
    assert run.summary()["outside_s"] == pytest.approx((depth > 0.0).sum() * 0.01, abs=0.011)
    kinetic = run.kinetic_energy + run.potential_energy
    np.testing.assert_allclose(kinetic + 100.0 * depth**2, kinetic[0], atol=1e-6)


def turning_torso():
    return control.AnglePath([0.0, 0.6], np.radians([[0.0, 0.0, 0.0], [50.0, 30.0, 20.0]]), "left", "minimum_jerk")


def test_on_a_torso_that_turns_a_free_arm_swings_as_on_one_at_rest():
    pose, w, turn = ep.shoulder_rotation(40.0, 20.0, 10.0, degrees=True), [0.3, -0.5, 0.8], turning_torso()
    cup = control.Payload(0.5, (0.0, 0.05, -0.3))
    still, moved = (
        plant.simulate(no_command, 0.6, plant.state(pose, w), rtol=1e-10)
        for plant in (bare_arm(payloads=cup), bare_arm(payloads=cup, torso=control.Torso(turn)))
    )
    world = turn(moved.times).orientation
    assert ((world * moved.rotations) * still.rotations.inv()).magnitude().max() < 1e-11
    assert (moved.rotations * still.rotations.inv()).magnitude().max() > 0.5
    force = world.apply(np.array(moved.shoulder_force))
    np.testing.assert_allclose(force, still.shoulder_force, atol=1e-9)
    np.testing.assert_allclose(moved.cuff_wrench, 0.0, atol=1e-10)
    assert np.abs(moved.energy_residual).max() < 1e-12
    rest = moved.plant.simulate(no_command, 0.3, moved.state(0.3), rtol=1e-10)
    assert (rest.chain[-1] == moved.chain[-1]).all()


def test_on_a_torso_that_accelerates_gravity_is_another():
    exo, a = ep.load("four-cables"), np.array([2.0, -3.0, 1.5])
    other = exo.device.replace(gravity=tuple(np.array(exo.device.gravity) - a))
    plants = [
        ep.Plant(exo, torso=control.Torso(acceleration=lambda t: a)),
        ep.Plant(other, wearer=lambda t, arm: np.zeros(3)),
    ]
    pose = exo.pose(30.0, 20.0)
    runs = [own.simulate(lambda t, seen: np.full(4, 0.1), 0.1, own.held(pose, np.full(4, 40.0))) for own in plants]
    assert (runs[0].rotations * runs[1].rotations.inv()).magnitude().max() < 1e-9
    np.testing.assert_allclose(runs[0].shoulder_force, runs[1].shoulder_force, atol=1e-6)
    np.testing.assert_allclose(runs[0].reaction().shoulder_force, runs[0].shoulder_force, atol=1e-6)


def test_a_fall_is_stopped_and_pushes_the_hand():
    fall = control.Fall(75.0, 0.4, peak=0.8, impact_time=0.12, hand=(0.0, 0.0, -0.5), start=0.1)
    plant = bare_arm(wearer=[fall, control.Passive(2.0, 1.0, source="a test")], torso=fall.torso)
    run = plant.simulate(
        no_command, 0.6, plant.state(ep.shoulder_rotation(50.0, 0.0, 0.0, degrees=True)), sample_rate=1000.0
    )
    assert run.status == "completed"
    falling = np.array([fall.torso.acceleration(t)[2] for t in run.times])
    assert np.trapezoid(falling, run.times) == pytest.approx(0.0, abs=0.01)
    assert run.wearer_force[:, 2].max() == pytest.approx(0.8 * 75.0 * 9.81, rel=1e-3)
    assert np.abs(run.energy_residual).max() < 1e-6


def test_a_person_with_a_delay_stands_still_until_it_has_passed():
    wish = control.Intent(control.flexion(law="constant_speed"), 5.0, 9.0, 0.7, delay=0.2)
    hanging = control.ArmState(np.eye(3), np.zeros(3))
    assert not wish(0.1, hanging).any()
    # From then on it sees 18 degrees a second.
    np.testing.assert_allclose(wish(0.2, hanging), [0.0, -0.7 * np.radians(18.0), 0.0], atol=1e-12)
