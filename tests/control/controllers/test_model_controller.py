"""The controller that knows the plant: plan, pressures and valves at one sample."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from idle_devices import random_device
from places import URDF
from scipy.optimize import least_squares, lsq_linear
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import (
    AdmittanceController,
    Experiment,
    FeedbackGains,
    ModelController,
    OrientationSpline,
    Push,
    ReferenceState,
    Turn,
    options_for,
)
from exo_pin.muscle import muscle_model

PLANT = ep.Plant(ep.experiment("abduction-outward").mechanism)
#: Held by the three muscles; see the experiment held-abduction.
POSE = ep.shoulder_rotation(25.0, 55.0, 30.0, degrees=True)


def constant(pose):
    return lambda t: ReferenceState(pose, np.zeros(3), np.zeros(3))


def seen(pose, pressures, velocity=(0.0, 0.0, 0.0), **more):
    return SimpleNamespace(orientation=pose, angular_velocity=np.array(velocity), pressures=np.array(pressures), **more)


def test_plan_at_the_wanted_pose_is_that_of_statics():
    controller = ModelController(PLANT, constant(POSE))
    controller(0.0, seen(POSE, np.zeros(3)))
    planned, exo = controller.planned, ep.ShoulderExo.from_mechanism(PLANT.mechanism)
    # Plain equilibrium pushes with limb 2 by little; without that a little moment is missing.
    forces, arms = exo.reaction(POSE), exo.jacobian(POSE).T
    assert -1.0 < forces.actuator_forces[1] < 0.0
    moment = arms @ forces.actuator_forces
    law = [muscle_model("tang-optimised", nominal) for nominal in (0.15, 0.25, 0.25)]
    lengths = exo.inverse_kinematics(POSE).lengths
    x = [m.length + e - long for m, e, long in zip(law, (0.126, 0.154, 0.154), lengths, strict=True)]
    greatest = [max(float(m.unchecked_force(c, 4e5)), 1e-9) for m, c in zip(law, x, strict=True)]
    best = lsq_linear(arms, moment, (np.zeros(3), greatest), method="bvls", tol=1e-14)
    np.testing.assert_allclose(planned.tensions, best.x, atol=1e-6)
    np.testing.assert_allclose(planned.missing_moment, moment - arms @ best.x, atol=1e-9)
    along = exo.inverse_kinematics(POSE).directions
    expected = forces.shoulder_force + along.T @ (best.x - forces.actuator_forces)
    np.testing.assert_allclose(planned.shoulder_force, expected, atol=1e-6)


def test_feedback_adds_spring_damper_and_integral():
    gains = FeedbackGains(stiffness=0.1, damping=0.02, integral_time=0.5)
    turn = np.array([0.02, -0.01, 0.015])
    off = Rotation.from_rotvec(-turn) * POSE
    velocity = np.array([0.1, 0.2, -0.1])
    plain, controller = (ModelController(PLANT, constant(POSE), g) for g in (FeedbackGains(0.0, 0.0, np.inf), gains))
    wanted = []
    for each in (plain, controller):
        each(0.0, seen(off, np.full(3, 1e5), velocity))
        arms = ep.ShoulderExo.from_mechanism(PLANT.mechanism).jacobian(off).T
        wanted.append(each.planned.missing_moment + arms @ each.planned.tensions)
    # What the limbs shall put on the arm is minus Jᵀ f.
    np.testing.assert_allclose(wanted[0] - wanted[1], 0.1 * turn - 0.02 * velocity, atol=1e-12)


def test_the_load_of_the_plant_is_fed_forward():
    force, at = np.array([3.0, -2.0, -8.0]), np.array([0.01, 0.02, -0.25])
    loaded = ep.Plant(PLANT.mechanism, load=ep.Load(force, at=at))
    arms, wanted = ep.ShoulderExo.from_mechanism(PLANT.mechanism).jacobian(POSE).T, []
    for plant in (PLANT, loaded):
        controller = ModelController(plant, constant(POSE))
        controller(0.0, seen(POSE, np.zeros(3)))
        wanted.append(controller.planned.missing_moment + arms @ controller.planned.tensions)
    # The limbs put the opposite moment on the arm.
    np.testing.assert_allclose(wanted[1] - wanted[0], np.cross(POSE.apply(at), force), atol=1e-12)


def held_while_a_limb_tears(beyond, faults=True, lower_in=np.inf):
    """The opening design in a pose that its others hold without limb 1, which tears after 0.3 s."""
    exo = ep.load("four-linear-actuators-worn")
    hold = Turn(exo.pose(60, 20, 10), np.array([0.0, 0.0, 1e-9]), 0.3)
    own = ModelController(ep.Plant(exo), hold).gains
    gains = replace(own, lost_beyond=beyond, lower_in=lower_in)
    torn = (ep.Fault("torn", limb=0, start=0.3),) if faults else ()
    return Experiment(
        "torn", "torn", exo.mechanism, hold, "model", options_for(exo.mechanism), 3.0, feedback=gains, faults=torn
    ).run()


def test_others_take_the_load_of_a_torn_limb():
    alone, shared = (np.degrees(held_while_a_limb_tears(beyond).error) for beyond in (np.inf, 0.01))
    assert alone[-1] > 15.0
    assert shared[-1] < 4.0
    assert shared.max() < 0.5 * alone.max()


@pytest.mark.full
def test_the_others_let_the_arm_down_with_no_more_than_they_needed():
    shared, down = (held_while_a_limb_tears(0.01, lower_in=seconds) for seconds in (np.inf, 1.5))
    assert (
        np.degrees(down.run.rotations[-1].magnitude()) < 2.0 < 50.0 < np.degrees(shared.run.rotations[-1].magnitude())
    )
    # On the way lie poses in which 600 N a limb would press the joint with over a kilonewton.
    assert np.linalg.norm(down.shoulder_force, axis=1).max() < 500.0
    after, whole = shared.times >= 0.3, held_while_a_limb_tears(0.01, faults=False)
    force = [np.linalg.norm(each, axis=1).max() for each in (shared.shoulder_force[after], whole.shoulder_force[30:])]
    (said,) = (text for text in shared.findings if "torn" in text)
    assert f"|F_s| reaches {force[0]:.0f} N" in said
    assert f"(without it {force[1]:.0f} N and 0°)" in said


def hinges():
    """Three hinges, and two: the same without internal rotation. On the same man."""
    three, man = ep.load(URDF / "serial-y-x-z.urdf"), ep.Wearer(1.755, 85.0, "male")
    chain = three.device.chain
    held = chain.locked(["internal_rotation"], chain.reference_configuration())
    return ep.ShoulderExo.from_device(ep.device.ChainDevice.from_chain(held)).worn_by(man), three.worn_by(man)


def without_internal_rotation(exo, pose):
    """The nearest pose without internal rotation, and how far it is away, degrees."""
    left = lambda angles: (exo.pose(*angles).inv() * pose).as_rotvec(degrees=True)  # noqa: E731
    found = least_squares(left, [20.0, 10.0], xtol=1e-12, ftol=1e-12)
    return exo.pose(*found.x), float(np.linalg.norm(found.fun))


@pytest.mark.full
def test_two_hinges_follow_a_movement_to_the_nearest_poses_that_they_have():
    """They have no internal rotation; where some is wanted, they go where least of the turn is left."""
    exo, times = hinges()[0], np.linspace(0.0, 0.6, 25)
    share = 3.0 * (times / 0.6) ** 2 - 2.0 * (times / 0.6) ** 3
    ways = (("model", 0.0, 0.0), ("model", 20.0, 5.0), ("pi", 20.0, 5.0))
    for controller, turned, start in ways:
        poses = exo.pose(10.0 + 20.0 * share, 20.0 * share, start + turned * share)
        tracking = exo.track(ep.Movement.from_samples(times, poses, smoothing=None), controller)
        assert tracking.run.status == "completed"
        for row, near in ((0, 1e-4), (-1, 0.3)):  # degrees
            best, away = without_internal_rotation(exo, poses[row])
            assert np.rad2deg((best.inv() * tracking.run.rotations[row]).magnitude()) < near
            np.testing.assert_allclose(tracking.attained[row].as_matrix(), best.as_matrix(), atol=1e-7)
        assert (away > 10.0) == (turned > 0.0)
        assert tracking.reachable.all() == (turned == 0.0)
        said = [text for text in tracking.findings if "does not have the wanted poses" in text]
        assert len(said) == (turned > 0.0)
        assert all(f"up to {away:.1f}° away, at 0.60 s" in text for text in said)


@pytest.mark.full
def test_the_virtual_body_of_two_hinges_gives_way_as_that_of_three():
    """Three hinges let the arm turn about itself; two go to the nearest pose without that."""
    times = np.linspace(0.0, 0.4, 17)
    share = 3.0 * (times / 0.4) ** 2 - 2.0 * (times / 0.4) ** 3
    shove = Push(ep.Load([20.0, 5.0, 0.0], at=[0.0, 0.0, -0.3], frame="arm"), 0.1, 0.3)
    ends = []
    for exo in hinges():
        reference = OrientationSpline(times, exo.pose(10.0 + 15.0 * share, 15.0 * share))
        yielding = AdmittanceController(ep.Plant(exo), reference, 1.0, 8.0, 30.0)
        ends.append(exo.track(reference, yielding, wearer=shove).run.rotations[-1])
    best, away = without_internal_rotation(exo, ends[1])
    assert away > 2.0
    assert np.rad2deg((best.inv() * ends[0]).magnitude()) < 0.5
    assert np.rad2deg((best.inv() * reference(0.4).orientation).magnitude()) > 8.0


def test_freedoms_that_the_controller_leaves_alone_are_foreseen():
    reference = OrientationSpline([0.0, 0.5], ep.shoulder_rotation([0.0, 10.0], 0.0, 0.0, degrees=True))
    for kind, moves in ((random_device(2)[0], True), (random_device(3)[0], False)):
        said = Experiment("one", "One", kind, reference, "model", options_for(kind)).foreseen
        assert any("(1 freedom); the controller leaves that alone" in text for text in said) == moves
