"""Winches and linear actuators: motion against two other engines, energy, static ends, motor, stops, faults."""

import warnings
from dataclasses import fields, replace

import mujoco
import numpy as np
import pytest
from drive_plants import SMOOTH, held, integrated, limb_mjcf
from plant_chain import chain_run
from scipy.integrate import solve_ivp

import exo_pin as ep
from exo_pin import InvalidInput, MissingData, UnknownName, control
from exo_pin.control.plant.equations.drive_kernels import motor_force, motor_rates, motor_tension
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


def test_play_is_that_of_the_design_unless_given_and_lies_on_the_side_of_the_load():
    exo = ep.load("three-linear-actuators")
    limbs = [replace(limb, actuator=replace(limb.actuator, play=4e-4)) for limb in exo.limbs]
    stated, given = ep.Plant(exo.replace(limbs=limbs)), ep.Plant(exo, ep.PlantOptions(play=5e-4))
    assert [drive.play for drive in stated.drives] == [4e-4] * 3
    assert [drive.play for drive in ep.Plant(exo).drives] == [0.0] * 3
    lengths, tensions = exo.inverse_kinematics(exo.pose(20)).lengths, np.array([30.0, -20.0, 0.0])
    at = given.drive_states(lengths, tensions).positions
    found = [
        motor_tension(d.row(), length, 0.0, s, 0.0)[0] for d, length, s in zip(given.drives, lengths, at, strict=True)
    ]
    np.testing.assert_allclose(found, tensions, atol=1e-9)
    np.testing.assert_allclose(at, lengths - tensions / given.drives[0].stiffness - 2.5e-4 * np.sign(tensions))
    with pytest.raises(InvalidInput, match="play"):
        ep.PlantOptions(play=-1e-3)


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


@pytest.mark.full
@pytest.mark.parametrize("name", [MOTORS[0], pytest.param(MOTORS[1], marks=pytest.mark.full), "four-muscle-cables"])
@pytest.mark.parametrize(
    "options", [pytest.param(SMOOTH, id="smooth"), pytest.param(None, id="with friction", marks=pytest.mark.full)]
)
def test_the_closed_chain_moves_as_the_minimal_coordinates(name, options):
    plant, tensions, start = held(name, options, spin=SPIN)
    command = shaken(plant, tensions) if plant.motors.all() else lambda t, measured: [0.1, -0.2, 0.3, 0.0]
    own = plant.simulate(command, 0.06, start, rtol=1e-11)
    other, opening = chain_run(plant, command, 0.06, start, 1e-9)
    assert own.status == other.status == "completed"
    assert opening.max() < 1e-9
    assert (own.rotations * other.rotations.inv()).magnitude().max() < 1e-8
    np.testing.assert_allclose(other.tensions, own.tensions, atol=1e-4)
    np.testing.assert_allclose(other.drive_positions, own.drive_positions, atol=1e-9)
    np.testing.assert_allclose(other.tension_work, own.tension_work, atol=1e-7)


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


@pytest.mark.full
@pytest.mark.parametrize(("name", "duration"), [("four-cables", 0.5), ("three-linear-actuators", 0.3)])
def test_a_long_motion_of_the_closed_chain(name, duration):
    plant, tensions, start = held(name, None, spin=SPIN)
    own = plant.simulate(shaken(plant, tensions), duration, start, rtol=1e-11)
    other, _ = chain_run(plant, shaken(plant, tensions), duration, start, 1e-9)
    assert (own.rotations * other.rotations.inv()).magnitude().max() < 1e-6


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


def row_of(name="four-cables", **changes):
    plant = ep.Plant(ep.load(name))
    drive = plant.drives[0]
    return replace(drive, parameters=replace(drive.parameters, **changes)).row(), drive


def test_the_motor_obeys_current_and_voltage_limits():
    row, drive = row_of(no_load_speed=0.6, stall_ratio=4.0)
    limit = drive.force_limit
    assert motor_force(row, 1e4, 0.0) == limit
    assert motor_force(row, -1e4, 0.0) == -limit
    # At three quarters of the speed without load stall force and current limit meet.
    assert motor_force(row, 1e4, 0.45) == pytest.approx(limit)
    assert motor_force(row, 1e4, 0.525) == pytest.approx(0.5 * limit)
    assert motor_force(row, 1e4, 0.6) == pytest.approx(0.0, abs=1e-9)
    assert motor_force(row, 1e4, 0.7) < 0.0
    assert motor_force(row, 1e4, -0.7) == limit
    assert motor_force(row, 12.5, 0.3) == 12.5
    # Voltage times current: P = U I with I = F/k_m and U = R I + k_m v, whatever k_m.
    force, v = 150.0, 0.2
    power = motor_rates(row, np.array([force, 1.0, 0.0, 1.0]), 0.5, 0.0, 0.5, -v, 0.0)[5]
    constant = 7.0
    resistance = 0.6 * constant**2 / (4.0 * limit)
    current = force / constant
    assert power == pytest.approx((resistance * current + constant * v) * current)


def test_a_cable_only_pulls_and_its_tension_is_continuous():
    row, drive = row_of(damping_time=5e-3)
    assert motor_tension(row, 0.4, 1.0, 0.41, 0.0) == (0.0, 0.0)
    for speed in (-2.0, 0.0, 2.0):
        near = motor_tension(row, 0.4 + 1e-9, speed, 0.4, 0.0)[0]
        assert 0.0 <= near < 2.1e-9 * drive.stiffness
        assert motor_tension(row, 0.401, speed, 0.4, 0.0)[0] >= 0.0
    rod, actuator = row_of("three-linear-actuators")
    assert motor_tension(rod, 0.4, 0.0, 0.401, 0.0)[0] == pytest.approx(-1e-3 * actuator.stiffness)


def test_inertia_and_stiffness_are_those_of_the_parts():
    winch = control.Winch()
    assert winch.mass == pytest.approx((4.4e-6 * 26.0**2 + 1.4e-5) / 0.02**2)
    assert winch.series_stiffness(0.5) == pytest.approx(5.8e4)
    screw = control.LinearActuator()
    assert screw.mass == pytest.approx((4.4e-6 + 2.3e-6) * (2.0 * np.pi / 0.005) ** 2)


def test_a_linear_actuator_stops_at_the_end_of_its_stroke():
    plant, _, start = held("three-linear-actuators")
    run = plant.simulate(lambda t, measured: [-1.0, -1.0, -1.0], 3.0, start)
    longest = np.array([drive.longest for drive in plant.drives])
    stops = plant.drives[0].parameters.stop_stiffness
    beyond = run.drive_positions.max(axis=0) - longest
    assert beyond.max() > 0.0
    assert beyond.max() < 2.0 * 400.0 / stops + 5e-3
    assert np.abs(run.drive_energy_residual).max() < 1e-5


def test_a_broken_cable_carries_nothing_and_the_run_goes_on():
    plant, tensions, start = held("four-cables")
    run = plant.simulate(lambda t, measured: tensions / 400.0, 1.0, start, faults=ep.Fault("torn", 0, start=0.3))
    after = run.times >= 0.3
    assert run.status == "completed"
    assert run.tensions[~after, 0].min() > 5.0
    assert not run.tensions[after, 0].any()
    before = np.linalg.norm(run.shoulder_force[~after], axis=1).max()
    assert np.linalg.norm(run.shoulder_force[after], axis=1).max() > 2.0 * before
    assert (run.rotations[-1] * start.orientation.inv()).magnitude() > 0.1


def without_current(faults, **changes):
    options = ep.PlantOptions(winch=control.Winch(**changes))
    plant, tensions, start = held("four-cables", options, abduction=60.0)
    run = plant.simulate(lambda t, measured: tensions / 400.0, 0.5, start, faults=faults)
    assert run.status == "completed"
    return run, tensions


def test_a_brake_holds_a_motor_without_current_and_a_slipping_one_lets_it_go():
    every = [ep.Fault("no current", i, start=0.1) for i in range(4)]
    run, tensions = without_current(every)
    after = run.times >= 0.1
    assert not run.motor_forces[after].any()
    # Brakes give way by the presliding displacement over their force.
    assert np.abs(run.drive_positions[-1] - run.drive_positions[0]).max() < 2e-4
    assert (run.rotations[-1] * run.rotations[0].inv()).magnitude() < 5e-3
    free, _ = without_current(every, brake_force=0.0, load_friction=0.0, coulomb=0.0)
    assert (free.rotations[-1] * free.rotations[0].inv()).magnitude() > 0.1
    strongest = int(np.argmax(tensions))
    slips, _ = without_current([ep.Fault("slipping brake", strongest, start=0.1, brake_force=0.2 * tensions.max())])
    assert slips.drive_positions[-1, strongest] - slips.drive_positions[0, strongest] > 0.01
    holds, _ = without_current([ep.Fault("slipping brake", strongest, start=0.1, brake_force=1.5 * tensions.max())])
    assert abs(holds.drive_positions[-1, strongest] - holds.drive_positions[0, strongest]) < 5e-4


def test_a_left_and_a_right_device_are_mirror_images():
    plant, tensions, start = held("four-cables", spin=(0.3, 0.1, 0.2))
    mirror = np.diag([1.0, -1.0, 1.0])
    other = ep.Plant(ep.load("four-cables", side="right"))
    turned = type(start.orientation).from_matrix(mirror @ start.orientation.as_matrix() @ mirror)
    second = replace(start, quaternion=turned.as_quat(), angular_velocity=start.angular_velocity * [-1.0, 1.0, -1.0])
    a, b = (p.simulate(lambda t, measured: tensions / 400.0, 0.5, s) for p, s in ((plant, start), (other, second)))
    np.testing.assert_allclose(b.rotations.as_matrix(), mirror @ a.rotations.as_matrix() @ mirror, atol=1e-6)
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ mirror, atol=1e-3)


@pytest.mark.parametrize(
    ("make", "error"),
    [
        (lambda: control.Winch(drum_radius=0.0), InvalidInput),
        (lambda: control.Winch(coulomb=-1.0), InvalidInput),
        (lambda: control.LinearActuator(lead=float("nan")), InvalidInput),
        (lambda: control.LinearActuator(stiffness=0.0), InvalidInput),
        (lambda: ep.PlantOptions(winch=control.LinearActuator()), InvalidInput),
        (lambda: ep.Fault("slipping brake", 0), InvalidInput),
        (lambda: ep.Fault("no current", 0, brake_force=3.0), InvalidInput),
        (lambda: ep.Fault("no power", 0), UnknownName),
        (lambda: held("four-cables")[0].simulate(print, 1.0, faults=ep.Fault("burst", 0)), InvalidInput),
        (lambda: ep.Plant(ep.load("prototype")).simulate(print, 1.0, faults=ep.Fault("no current", 0)), InvalidInput),
        (lambda: held("four-cables")[0].state(drive_positions=[0.1]), InvalidInput),
        (lambda: held("four-cables")[0].held(ep.shoulder_rotation(0, 0, 0), [1.0, 2.0]), InvalidInput),
    ],
)  # fmt: skip
def test_bad_input_is_refused(make, error):
    with pytest.raises(error):
        make()


def test_a_cable_without_a_force_limit_is_missing_data():
    mechanism = ep.load("four-cables").mechanism
    limbs = [replace(limb, actuator=ep.Actuator("cable")) for limb in mechanism.limbs]
    with pytest.raises(MissingData, match=r"limbs\[3\].actuator.pull_limit"):
        ep.Plant(mechanism.replace(limbs=limbs))


@pytest.mark.parametrize(
    ("name", "kind"), [("four-cables", control.Winch), ("three-linear-actuators", control.LinearActuator)]
)
def test_every_estimate_of_a_drive_is_listed_with_its_basis(name, kind):
    listed = {each.name.partition(".")[2]: each for each in ep.Plant(ep.load(name)).assumptions}
    for item in fields(kind):
        assert listed[item.name].basis.startswith("estimate: ")
        assert f"{getattr(kind(), item.name):g}" in listed[item.name].value
    assert not any("air" in each.basis for each in listed.values())


def test_a_speed_limit_of_the_design_is_no_estimate():
    exo = ep.load("four-cables")
    fast = [replace(limb, actuator=replace(limb.actuator, speed_limit=0.8)) for limb in exo.limbs]
    listed = {}
    for count in (0, 3, 4):
        plant = ep.Plant(exo.replace(limbs=[*fast[:count], *exo.limbs[count:]]))
        listed[count] = {each.name for each in plant.assumptions}
        assert [drive.parameters.no_load_speed for drive in plant.drives] == [0.8] * count + [0.6] * (4 - count)
    assert listed[0] == listed[3] == listed[4] | {"winch.no_load_speed"}
    assert "winch.no_load_speed" not in listed[4]


def test_presets_that_make_a_plant_are_named_where_one_does_not():
    with pytest.raises(MissingData) as caught:
        ep.Plant(ep.load("scenario-one"))
    assert caught.value.missing[:2] == ("limbs[0].actuator.force_law", "limbs[0].stroke.end_fitting")
    named = str(caught.value).partition("presets with all of it: ")[2].split(", ")
    assert {"prototype", *MOTORS} < set(named)
    for name in named:
        ep.Plant(ep.load(name))


def test_only_the_given_numbers_of_a_drive_are_no_estimates():
    options = ep.PlantOptions(winch=control.Winch(coulomb=3.0, gear_ratio=30.0), stop_damping=2.0)
    given = {each.name for each in ep.Plant(ep.load("four-cables"), options).assumptions if each.basis == "given"}
    assert given == {"winch.coulomb", "winch.gear_ratio"}


@pytest.mark.parametrize(("design", "field"), [("four-cables", "winch"), ("four-linear-actuators", "linear_actuator")])
def test_drives_of_damping_far_beyond_critical_are_named_before_they_run(design, field):
    """At critical damping of a mass on a spring, d² = 4 k m, the ratio is one; named are drives beyond ten."""
    exo, options = ep.load(design), ep.PlantOptions()
    own = getattr(options, field)
    critical = 2.0 * np.sqrt(own.mass / max(drive.stiffness for drive in ep.Plant(exo).drives))
    for times, told in ((1.0, False), (9.9, False), (20.0, True)):
        made = replace(own, damping_time=times * critical)
        plant = ep.Plant(exo, options.replace(**{field: made}))
        assert max(drive.damping_ratio for drive in plant.drives) == pytest.approx(times)
        start = plant.held(exo.pose(30), exo.reaction(exo.pose(30)).actuator_forces)
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            assert plant.simulate(lambda t, seen: np.zeros(4), 1e-3, start).status == "completed"
        assert len(found) == told
        assert all(str(each.message).startswith("The damping of the spring is up to 20 times") for each in found)
