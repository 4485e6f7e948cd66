"""The person in the plant: ready moments, payloads, pushes; controllers with a person in the loop."""

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control
from exo_pin.control.controllers.planning import DevicePlanner, WristPlanner
from exo_pin.core.errors import InvalidInput, MissingData

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


@pytest.mark.parametrize("kind", [control.Passive, control.Spasticity])
def test_no_number_of_a_person_is_taken_for_known(kind):
    with pytest.raises(MissingData, match="source"):
        kind()


def test_passive_moment_is_about_the_arms_axes():
    tissue = control.Passive([1.0, 2.0, 0.5], 0.1, source="a test")
    R = ep.shoulder_rotation(0.0, 0.0, 30.0, degrees=True).as_matrix()
    turn = Rotation.from_matrix(R.T).as_rotvec()
    found = tissue(0.0, control.ArmState(R, np.array([0.0, 0.0, 2.0])))
    np.testing.assert_allclose(found, [0.0, 0.0, 0.5 * turn[2] - 0.2], atol=1e-12)


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


def test_tremor_intent_and_spasticity_bear_energy_and_stay_within_their_strength():
    reference = control.AnglePath([0.0, 0.4], np.radians([[0.0, 0.0, 0.0], [30.0, 0.0, 0.0]]), "left", "minimum_jerk")
    person = [
        control.Tremor(0.1, 6.0, (0.0, 1.0, 0.0)),
        control.Intent(reference, strength=1.5, stiffness=10.0, damping=0.5, delay=0.05),
        control.Spasticity(0.3, 0.2, 0.5, source="a test"),
    ]
    run = bare_arm(wearer=person).simulate(no_command, 0.5, bare_arm().state(), rtol=1e-9)
    assert run.status == "completed"
    assert np.abs(run.energy_residual).max() < 1e-6
    assert np.linalg.norm(run.wearer_moment, axis=1).max() <= 1.5 + 0.1 + 0.5
    assert run.assistance == pytest.approx(0.0, abs=1e-9)  # no device
    assert np.degrees(run.rotations[-1].magnitude()) > 5.0


@pytest.mark.full
def test_planners_of_a_wrist_agree():
    exo = ep.load("three-linear-actuators")
    plant = ep.Plant(exo)
    closed, whole = WristPlanner(plant), DevicePlanner(plant)
    pose, motion = exo.pose(30.0, 20.0), ep.Motion([0.5, 0.2, -0.1], [1.0, -2.0, 0.5])
    load = ep.Load([3.0, 0.0, -5.0], [0.1, 0.2, 0.3], at=(0.0, 0.0, -0.3))
    np.testing.assert_allclose(whole.lengths(pose), closed.lengths(pose), atol=1e-9)
    for limit in (400.0, 20.0):
        ends = np.full(3, limit), np.full(3, -limit)
        one, other = (plans.tensions(pose, motion, *ends, load) for plans in (closed, whole))
        np.testing.assert_allclose(other.missing_moment, one.missing_moment, atol=1e-7)
        np.testing.assert_allclose(other.tensions, one.tensions, atol=1e-5)
    state = control.ReferenceState(pose, motion.angular_velocity, motion.angular_acceleration)
    for one, other in zip(closed.motion(state), whole.motion(state), strict=True):
        np.testing.assert_allclose(other, one, atol=1e-5)


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
def test_gravity_compensation_leaves_the_arm_where_it_is_and_a_share_of_the_weight_to_the_wearer():
    exo = ep.load(SERIAL)
    pose = exo.pose(40.0, 10.0)
    plant = ep.Plant(exo)
    run = plant.simulate(control.gravity_compensation(plant), 0.5, plant.state(pose), rtol=1e-6)
    assert (run.rotations[-1] * pose.inv()).magnitude() < 1e-3
    half = control.gravity_compensation(plant, share=0.5)
    fall = plant.simulate(half, 0.02, plant.state(pose), rtol=1e-6)
    weight = np.cross(pose.as_matrix() @ plant.tables.centre, plant.tables.mass * plant.tables.gravity)
    assert fall.assistance < 1.0 or np.linalg.norm(fall.angular_acceleration[0]) > 0.1
    # What the drives do not carry turns arm and links.
    inertial = fall.needed_moment[0] + weight
    assert inertial @ weight > 0.0


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


@pytest.mark.full
def test_a_reported_cut_is_borne_by_the_others():
    exo = ep.load(URDF / "six-cables.urdf")
    pose = exo.pose(30.0, 20.0)
    plant = ep.Plant(exo)
    worst = []
    for aware in (False, True):
        controller = control.impedance(plant, still(pose), 20.0, 3.0, fault_aware=aware)
        least, greatest = plant.force_limits(plant.contractions.lengths(pose))
        first = controller.plans.tensions(pose, None, greatest, least, None).tensions
        limb = int(first.argmax())
        cut = ep.Fault("torn", limb, start=0.1, reported_after=0.02)
        run = plant.simulate(controller, 0.8, plant.held(pose, first), faults=cut, rtol=1e-6)
        worst.append(float((run.rotations * pose.inv()).magnitude().max()))
        assert bool(controller.lost[limb]) == aware
    assert worst[1] < 0.7 * worst[0]


def test_bad_input_is_refused():
    with pytest.raises(InvalidInput, match="one load"):
        control.Push(ep.Load(np.zeros((2, 3))))
    with pytest.raises(InvalidInput, match="end after start"):
        control.Payload(1.0, (0.0, 0.0, 0.0), 2.0, 1.0)
    with pytest.raises(InvalidInput, match="axis"):
        control.Tremor(1.0, 5.0, (0.0, 0.0, 0.0))
    with pytest.raises(InvalidInput, match="weight_share"):
        control.FeedbackGains(weight_share=1.5)
    bad = bare_arm(wearer=lambda t, arm: np.full(3, np.nan if t > 0.05 else 0.0)).simulate(no_command, 0.1)
    assert "not finite" in bad.status
    assert bad.times[-1] < 0.06
