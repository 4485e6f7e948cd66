"""Valves in time: exact switching, mean flow of the pulses, commands taken over, faults."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, MissingData, UnknownName
from exo_pin.control.plant.simulation import DriveSchedule
from exo_pin.muscle import ConstantFriction, Supply, Valve, ValveUnit
from exo_pin.muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE

VALVE = Valve(2e-10, 0.4)


def unit(**options):
    return ValveUnit(VALVE, VALVE, **options)


def open_times(valves, duration):
    """Time integral of the openings of fill and vent path, shape (n, 2), s, and the instants of switching."""
    total, time, instants = np.zeros((len(valves.units), 2)), 0.0, []
    valves.start(0.0)
    while time < duration - 1e-9:
        end = min(valves.next_switch(time), duration)
        total += (end - time) * valves.flows(time)[:, [0, 2]] / VALVE.conductance
        time = end
        valves.start(time)
        instants.append(time)
    return total, instants


@pytest.mark.parametrize("layout", ["3/2", "fill and vent"])
def test_valves_are_open_for_their_share_to_rounding(layout):
    shares = np.array([-1.0, -0.37, 0.0, 0.123456789, 0.9, 1.0])
    units = tuple(unit(layout=layout) for _ in shares)
    valves = DriveSchedule(units)
    valves.commands = shares
    total, instants = open_times(valves, 1.0)
    np.testing.assert_allclose(total, [each.shares(u) for each, u in zip(units, shares, strict=True)], atol=1e-8)
    first = units[3].shares(shares[3])[0] / 20.0
    assert np.abs(np.array(instants) - first).min() < 1e-15


def test_a_command_is_taken_over_at_the_start_of_a_period():
    valves = DriveSchedule((unit(), unit(modulation="averaged")))
    valves.commands = np.array([0.0, 0.0])
    valves.start(0.0)
    valves.commands = np.array([1.0, 1.0])
    valves.start(0.03)
    assert valves.flows(0.03)[:, 2].tolist() == [VALVE.conductance, 0.0]
    valves.start(0.05)
    assert valves.flows(0.05)[:, 0].tolist() == [VALVE.conductance, VALVE.conductance]


def test_pulses_fill_as_their_mean_while_the_flow_is_choked(prototype):
    """Into a stretched muscle, whose volume does not change: m = ρ_0 C p_s share t, by either modulation."""
    low = Supply(15e5)
    found = []
    for modulation in ("switched", "averaged"):
        plant = ep.Plant(
            prototype.replace(gravity=(0.0, 0.0, 0.0)),
            ep.PlantOptions(supply=low, valves=unit(layout="fill and vent", modulation=modulation)),
        )
        run = plant.simulate(lambda t, seen: [0.0, 0.35, 0.0], 0.2, plant.state())
        found.append(run.air_used)
    expected = 1.185 * VALVE.conductance * low.absolute * 0.35 * run.times
    np.testing.assert_allclose(found[1], expected, rtol=1e-8, atol=1e-15)
    # Switched, the mean over whole periods.
    np.testing.assert_allclose(found[0][::5], expected[::5], rtol=1e-7, atol=1e-15)
    assert np.abs(found[0] - expected).max() > 0.1 * expected[5]


def test_a_shut_valve_keeps_the_air(prototype, abducted):
    plant = ep.Plant(prototype, ep.PlantOptions(valves=unit(layout="fill and vent")))
    run = plant.simulate(lambda t, seen: [0.0, 0.0, 0.0], 0.5, plant.state(abducted, pressures=1e5))
    assert not run.air_used.any()
    assert not run.air_vented.any()
    # Isothermal: the pressure goes as one over the volume, which the limb's motion changes.
    assert run.pressures.min() > 0.5e5
    assert np.ptp(run.pressures[:, 0]) > 1e3


def test_a_higher_exponent_makes_stiffer_air(prototype, abducted):
    swing = []
    for kappa in (1.0, 1.4):
        options = ep.PlantOptions(valves=unit(layout="fill and vent"), polytropic_exponent=kappa)
        plant = ep.Plant(prototype, options)
        start = plant.state(abducted, [0.0, 1.0, 0.0], 1e5)
        run = plant.simulate(lambda t, seen: [0.0, 0.0, 0.0], 0.05, start, sample_rate=1000.0)
        swing.append(np.log(run.pressures[-1] + ATMOSPHERE) - np.log(run.pressures[0] + ATMOSPHERE))
    moved = np.abs(swing[0]) > 1e-3
    assert moved.any()
    np.testing.assert_allclose(swing[1][moved] / swing[0][moved], 1.4, rtol=0.05)


HOLD = {"valves": unit(layout="fill and vent"), "shoulder_viscous": 0.1}


@pytest.fixture(scope="module")
def holding(prototype, abducted):
    plant = ep.Plant(prototype, ep.PlantOptions(**HOLD))
    return plant, plant.rest([1e5, 0.0, 3.5e5], near=abducted)


def test_a_leak_empties_a_muscle_at_the_valve_s_rate(holding):
    plant, start = holding
    leak = ep.Fault("leak", 2, start=0.2, leak=Valve(5e-11, 0.5))
    run = plant.simulate(lambda t, seen: [0.0, 0.0, 0.0], 2.0, start, faults=leak)
    before = run.times <= 0.2
    assert run.status == "completed"
    assert not run.air_vented[before].any()
    # Choked as long as it is above twice the atmosphere.
    choked = (run.times > 0.2) & (run.pressures[:, 2] > ATMOSPHERE + 2e4)
    rate = 1.185 * 5e-11 * (run.pressures[:, 2] + ATMOSPHERE)
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(run.times))])
    place = np.flatnonzero(choked)
    gone = run.air_vented[place] - run.air_vented[place[0]]
    np.testing.assert_allclose(gone, passed[place] - passed[place[0]], rtol=1e-4, atol=1e-13)
    assert np.linalg.norm(run.shoulder_force[-1] - run.shoulder_force[0]) > 1.0


@pytest.mark.parametrize("kind", ["burst", "torn"])
def test_the_arm_falls_when_a_muscle_bursts_and_the_force_is_reported(holding, kind):
    plant, start = holding
    run = plant.simulate(lambda t, seen: [0.0, 0.0, 0.0], 1.5, start, faults=[ep.Fault(kind, 2, start=0.1)])
    assert run.status == "completed"
    falls = ep.shoulder_angles(run.rotations, degrees=True)[:, 1]
    assert falls[0] > 50.0
    assert falls[-1] < 20.0
    assert run.pressures[-1, 2] < 1e3
    assert run.air_vented[-1] * GAS_CONSTANT * REFERENCE_TEMPERATURE > 1.0
    force = np.linalg.norm(run.shoulder_force, axis=1)
    assert np.isfinite(force).all()
    assert force.max() > force[0]
    if kind == "torn":
        assert not run.tensions[run.times > 0.1, 2].any()
    assert np.abs(run.energy_residual).max() < 1e-6


def test_a_stuck_valve_does_not_hear_the_controller(holding):
    plant, start = holding
    heard = []

    def controller(t, seen):
        heard.append(t)
        return [0.0, 0.0, -1.0]

    stuck = ep.Fault("stuck valve", 2, start=0.1, end=0.5, command=1.0)
    run = plant.simulate(controller, 0.8, start, faults=stuck)
    assert len(heard) == 80
    place = np.searchsorted(run.times, [0.05, 0.12, 0.48, 0.52, 0.8])
    steps = np.diff(run.pressures[place, 2])
    assert np.sign(steps[[1, 3]]).tolist() == [1.0, -1.0]
    assert run.pressures[10, 2] < run.pressures[0, 2]
    assert run.commands[:, 2].max() == -1.0


def test_the_controller_sees_what_the_sensor_says(holding):
    plant, start = holding
    seen = []

    def controller(t, measured):
        seen.append(measured.contraction_ratios)
        return [0.0, 0.0, 0.0]

    def sensor(t, exact):
        return exact._replace(contraction_ratios=exact.contraction_ratios + 1.0)

    run = plant.simulate(controller, 0.03, start, sensor=sensor)
    np.testing.assert_allclose(seen, run.contraction_ratios[:3] + 1.0, atol=1e-9)
    stroke = plant.mechanism.limbs[0].stroke
    expected = 1.0 - (run.lengths[:, 0] - stroke.end_fitting) / stroke.nominal_length
    np.testing.assert_allclose(run.contraction_ratios[:, 0], expected, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "error"),
    [
        (lambda exo: ep.Plant("prototype"), InvalidInput),
        (lambda exo: ep.Plant(ep.load("appendix-d")), MissingData),
        (lambda exo: ep.Plant(exo.replace(arm=None)), MissingData),
        (lambda exo: ep.Plant(exo, load=ep.Load([0, 0, -1], frame="arm")), InvalidInput),
        (lambda exo: ep.Plant(exo, ep.PlantOptions(valves=[unit()] * 2)).simulate(print, 1.0), InvalidInput),
        (lambda exo: ep.PlantOptions(polytropic_exponent=2.0), InvalidInput),
        (lambda exo: ep.PlantOptions(braid_stiffness=float("nan")), InvalidInput),
        (lambda exo: ep.PlantOptions(muscle_friction=2.5), InvalidInput),
        (lambda exo: ep.PlantOptions().replace(colour=1), UnknownName),
        (lambda exo: ep.Fault("rust", 0), UnknownName),
        (lambda exo: ep.Fault("leak", 0), InvalidInput),
        (lambda exo: ep.Fault("burst", 0, start=2.0, end=1.0), InvalidInput),
        (lambda exo: ep.Plant(exo).state(pressures=[1e5, 1e5]), InvalidInput),
        (lambda exo: ep.Plant(exo).state(pressures=-1e5), InvalidInput),
        (lambda exo: ep.Plant(exo).simulate(lambda t, m: [0, np.nan, 0], 1.0, ep.Plant(exo).state()), InvalidInput),
        (lambda exo: ep.Plant(exo).simulate(lambda t, m: [0, 0], 1.0, ep.Plant(exo).state()), InvalidInput),
        (lambda exo: ep.Plant(exo).simulate(lambda t, m: [0] * 3, -1.0, ep.Plant(exo).state()), InvalidInput),
        (lambda exo: ep.Plant(exo).simulate(print, 1.0, faults=ep.Fault("burst", 3)), InvalidInput),
    ],
)
def test_bad_input_is_refused(prototype, make, error):
    with pytest.raises(error):
        make(prototype)


def test_every_estimate_is_listed(prototype):
    names = [item.name for item in ep.Plant(prototype).assumptions]
    assert names[:3] == list(prototype.mechanism.estimated)
    assert {"supply", "valves", "polytropic_exponent", "dead_volume", "braid_stiffness", "muscle_damping"} <= set(names)
    changed = ep.PlantOptions(muscle_friction=ConstantFriction(), shoulder_coulomb=0.1, second_flange=True)
    names = [item.name for item in ep.Plant(prototype, changed).assumptions]
    assert {"presliding", "shoulder_presliding"} <= set(names)
    assert not any("stop" in name for name in names)
    assert all(item.basis and item.value for item in ep.Plant(prototype).assumptions)


def test_what_was_given_is_no_estimate(prototype):
    unit = ep.PlantOptions().valves
    other = ep.PlantOptions(dead_volume=1e-5, stop_damping=2.0, valves=[unit, unit, replace(unit, restrictor=None)])
    usual, changed = ({item.name: item for item in ep.Plant(prototype, o).assumptions} for o in (None, other))
    given = {"dead_volume", "stop_stiffness, stop_damping", "valves", "valves.layout"}
    assert {name for name, item in changed.items() if item.basis == "given"} == given
    assert not any(item.basis == "given" for item in usual.values())
    # Both kinds of valves are listed.
    assert changed["valves"].value.count("fill") == 2
    assert "1.2 N m" in usual["stop_stiffness, stop_damping"].basis
    heavy = prototype.replace(arm=replace(prototype.mechanism.arm, mass=2.0 * prototype.mechanism.arm.mass))
    assert "2.5 N m" in ep.Plant(heavy).assumptions[-1].basis
