"""The controller that knows the plant: plan, pressures and valves at one sample."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.control import (
    Experiment,
    FeedbackGains,
    ModelController,
    ReferenceState,
    Turn,
    options_for,
    reference_of,
    tensions_for_motion,
)
from exo_pin.control.controllers.model_controller import gains_for
from exo_pin.muscle import muscle_model
from exo_pin.muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, mass_flow

PLANT = ep.Plant(ep.experiment("abduction-outward").mechanism)
#: Held by the three muscles; see the experiment held-abduction.
POSE = ep.shoulder_rotation(25.0, 55.0, 30.0, degrees=True)


def constant(pose):
    return lambda t: ReferenceState(pose, np.zeros(3), np.zeros(3))


def seen(pose, pressures, velocity=(0.0, 0.0, 0.0), **more):
    return SimpleNamespace(orientation=pose, angular_velocity=np.array(velocity), pressures=np.array(pressures), **more)


def pressures_of(controller):
    """Pressures that were planned at the last sample."""
    lengths = controller.plant.contractions.lengths(POSE)
    return controller.plant.drive_states(lengths, controller.planned.tensions).pressures


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


def test_pressures_give_the_planned_tensions_back():
    controller = ModelController(PLANT, constant(POSE))
    controller(0.0, seen(POSE, np.zeros(3)))
    tensions, lengths = controller.planned.tensions, controller.plant.contractions.lengths(POSE)
    pressures = pressures_of(controller)
    found = np.array(
        [PLANT_tension(i, length, p) for i, (length, p) in enumerate(zip(lengths, pressures, strict=True))]
    )
    np.testing.assert_allclose(found, tensions, atol=1e-5)
    pulling = tensions > 1e-3
    assert pulling.sum() == 2
    law = muscle_model("tang-optimised", 0.25)
    x = 0.25 + 0.154 - lengths[2]
    assert float(law.unchecked_force(x, pressures[2])) == pytest.approx(tensions[2], abs=1e-4)


def PLANT_tension(i, length, pressure):
    from exo_pin.control.plant.equations.drive_kernels import tension

    return tension(PLANT.tables.law, PLANT.tables.muscles[i], i, length, 0.0, pressure, 0.0)[0]


def test_duty_of_a_pressure_that_is_reached_balances_the_flows():
    controller = ModelController(PLANT, constant(POSE))
    controller(0.0, seen(POSE, np.zeros(3)))
    commands = controller(0.01, seen(POSE, pressures_of(controller)))
    fill, vent = PLANT.units[0].paths
    for command, pressure in zip(commands, pressures_of(controller), strict=True):
        if not -1.0 < command < 1.0:
            assert pressure == 0.0
            continue
        p, share = pressure + ATMOSPHERE, 0.5 * (1.0 + command)
        inflow = mass_flow(4e5 + ATMOSPHERE, p, fill.conductance, fill.critical_ratio)
        outflow = mass_flow(p, ATMOSPHERE, vent.conductance, vent.critical_ratio)
        assert share * inflow == pytest.approx((1.0 - share) * outflow, rel=1e-9)


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
    np.testing.assert_allclose(
        controller._integral, 0.01 / 0.5 * (0.1 * turn + controller.planned.missing_moment), atol=1e-14
    )


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


def test_air_ahead_is_that_of_the_tensions_under_the_load():
    """Change of the air in the muscles, by their pressures and volumes, from now to one period of the pulses later."""
    from exo_pin.control.plant.equations.drive_kernels import air_volume, tension

    load = ep.Load([1.0, 0.5, -2.0], at=[0.0, 0.02, -0.25])
    reference, period, at = ep.experiment("held-abduction").reference, 0.05, 3.0
    flows = []
    for given in (load, None):
        plant = ep.Plant(PLANT.mechanism, load=given)
        controller = ModelController(plant, reference, FeedbackGains(air_ahead=True))
        exo, t, mass = ep.ShoulderExo.from_mechanism(plant.mechanism), plant.tables, []
        for time in (at, at + period):
            state = reference(time)
            lengths = exo.inverse_kinematics(state.orientation).lengths
            least, greatest = plant.force_limits(lengths)
            motion = ep.Motion(state.angular_velocity, state.angular_acceleration)
            tensions = tensions_for_motion(plant.mechanism, state.orientation, motion, greatest, least, load).tensions
            pressures = plant.drive_states(lengths, tensions).pressures
            volumes = [
                air_volume(row, tension(t.law, row, i, lengths[i], 0.0, pressures[i], 0.0)[2])[0]
                for i, row in enumerate(t.muscles)
            ]
            mass.append((pressures + ATMOSPHERE) * volumes / (GAS_CONSTANT * REFERENCE_TEMPERATURE))
        flows.append((mass[1] - mass[0]) / period)
        if given is not None:
            np.testing.assert_allclose(controller._needed_flows(at), flows[0], rtol=1e-9)
        else:
            assert np.abs(controller._needed_flows(at) - flows[0]).max() > 0.1 * np.abs(flows[0]).max()


def held_while_a_limb_tears(beyond, faults=True, lower_in=np.inf):
    """The opening design in a pose that its others hold without limb 1, which tears after 0.3 s."""
    exo = ep.load("four-linear-actuators-worn")
    hold = Turn(exo.pose(60, 20, 10), np.array([0.0, 0.0, 1e-9]), 0.3)
    gains = replace(gains_for(exo.mechanism), lost_beyond=beyond, lower_in=lower_in)
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


@pytest.mark.full
def test_a_limb_that_is_whole_does_not_count_as_torn():
    plain, asked = (held_while_a_limb_tears(beyond, faults=False) for beyond in (np.inf, 0.01))
    np.testing.assert_array_equal(asked.error, plain.error)
    exo = ep.load("four-linear-actuators-worn")
    gains, moves = replace(gains_for(exo.mechanism), lost_beyond=0.01), reference_of("flexion", "left")
    runs = [
        Experiment("lift", "lift", exo.mechanism, moves, "model", options_for(exo.mechanism), feedback=each).run()
        for each in (gains, None)
    ]
    np.testing.assert_array_equal(runs[0].error, runs[1].error)


def test_without_a_reading_the_arm_is_taken_to_be_at_the_reference():
    lost, there = (ModelController(PLANT, constant(POSE)) for _ in range(2))
    away = ep.shoulder_rotation(10.0, 20.0, 20.0, degrees=True)
    commands = lost(0.0, seen(away, np.full(3, 1e5), lost=True))
    np.testing.assert_allclose(commands, there(0.0, seen(POSE, np.full(3, 1e5))), atol=1e-12)


@pytest.mark.parametrize(
    "gains", [{"stiffness": -1.0}, {"damping": np.nan}, {"integral_time": 0.0}, {"lost_beyond": 0.0}, {"lower_in": 0.0}]
)
def test_bad_input_is_refused(gains):
    with pytest.raises(InvalidInput):
        FeedbackGains(**gains)
    with pytest.raises(InvalidInput):
        ModelController(PLANT, "abduction")
