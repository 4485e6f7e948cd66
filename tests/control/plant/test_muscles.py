"""Muscles of a plant: their braid, tackles and air, valves and leaks."""

import numpy as np
import pytest
from drive_plants import held

import exo_pin as ep
from exo_pin.muscle import ForceTable, Supply, Validity, Valve, ValveUnit, muscle_model, save_parameters, table

VALVE = Valve(2e-10, 0.4)
ATMOSPHERE, DENSITY = 101325.0, 1.185
#: Pa m³ of a kilogram: 1 bar over the density of ISO 6358 at 20 °C.
PER_MASS = 1e5 / DENSITY


def unit(**options):
    return ValveUnit(VALVE, VALVE, **options)


def test_the_braid_is_as_stiff_as_table_a_1_says():
    rows = dict(zip(table("a-1").rows, table("a-1").printed, strict=True))
    x, J = [], []
    for side in "ij":
        for a, b in zip(rows[f"x_{side}_mm"], rows[f"J_{side}_N"], strict=True):
            # x_1 of the relaxation lost its sign in print.
            if a != "/" and (float(a) < 0 or a == "5.01"):
                x.append(-abs(float(a)) * 1e-3)
                J.append(float(b))
    assert len(x) == 6
    fitted = -np.dot(x, J) / np.dot(x, x)
    assert ep.PlantOptions().braid_stiffness == pytest.approx(fitted, rel=1e-3)


def test_a_held_pose_stays_and_is_the_reaction_query_s():
    plant, tensions, start = held("four-muscle-cables", ep.PlantOptions(pulley_friction=0.0))
    run = plant.simulate(lambda t, measured: np.zeros(4), 0.001, start)
    np.testing.assert_allclose(run.tensions[0], tensions, atol=1e-5)
    exact = run.tensions[0]
    answer = ep.load("four-muscle-cables").reaction(start.orientation, limits=(exact - 1e-4, exact + 1e-4))
    np.testing.assert_allclose(answer.shoulder_force, run.shoulder_force[0], atol=1e-3)
    rest = plant.rest(start.pressures, near=start.orientation)
    still = plant.simulate(lambda t, measured: np.zeros(4), 0.001, rest)
    exact, scale = still.tensions[0], still.tensions[0].max()
    answer = ep.load("four-muscle-cables").reaction(rest.orientation, limits=(exact, exact))
    np.testing.assert_allclose(answer.actuator_forces, exact, atol=1e-9 * scale)
    np.testing.assert_allclose(answer.shoulder_force, still.shoulder_force[0], atol=1e-9 * scale)


def air_mass(run):
    """Air in all muscles, kg: that of cylinders as wide as (3-2) says, and of dead volumes."""
    laws = [muscle_model("fitted-chou-hannaford", drive.model.length) for drive in run.plant.drives]
    x, count = run.bladder_contractions, [getattr(drive, "count", 1) for drive in run.plant.drives]
    wide = np.stack([law.diameter(own) for law, own in zip(laws, x.T, strict=True)], axis=1)
    volumes = 0.25 * np.pi * wide**2 * ([law.length for law in laws] - x) + run.plant.options.dead_volume
    return (count * (run.pressures + ATMOSPHERE) * volumes).sum(axis=1) / PER_MASS


def test_no_air_is_lost(prototype, abducted):
    """Of muscles in line behind a small regulator, whose manifold they draw down, and of muscles over tackles."""
    plant = ep.Plant(prototype, ep.PlantOptions(supply=Supply(4e5, Valve(1e-10, 0.3), 50e-6)))
    start = plant.state(abducted, [0.8, -1.2, 2.0], [1e5, 0.0, 1e5])
    run = plant.simulate(lambda t, seen: [-0.4 + 0.5 * t, -1.0, 0.3], 1.0, start, rtol=1e-11)
    assert run.supply_pressure.min() < 3.9e5
    assert run.air_vented[-1] > 1e-5
    total = air_mass(run) + (run.supply_pressure + ATMOSPHERE) * 50e-6 / PER_MASS
    np.testing.assert_allclose(total - total[0], run.air_used - run.air_vented, atol=1e-12)
    plant, _, start = held("four-muscle-cables")
    run = plant.simulate(lambda t, seen: [0.3, -0.2, 0.1, -0.4], 0.5, start, rtol=1e-10)
    np.testing.assert_allclose(air_mass(run) - air_mass(run)[0], run.air_used - run.air_vented, atol=1e-10)
    assert np.abs(run.energy_residual).max() < 1e-6 * run.kinetic_energy.max()


def test_pulses_fill_as_their_mean_while_the_flow_is_choked(prototype):
    """Into a stretched muscle, whose volume does not change: m = ρ_0 C p_s share t over whole periods."""
    low = Supply(15e5)
    options = ep.PlantOptions(supply=low, valves=unit(layout="fill and vent"))
    plant = ep.Plant(prototype.replace(gravity=(0.0, 0.0, 0.0)), options)
    run = plant.simulate(lambda t, seen: [0.0, 0.35, 0.0], 0.2, plant.state())
    expected = 1.185 * VALVE.conductance * low.absolute * 0.35 * run.times
    np.testing.assert_allclose(run.air_used[::5], expected[::5], rtol=1e-7, atol=1e-15)
    assert np.abs(run.air_used - expected).max() > 0.1 * expected[5]


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


def test_a_leak_empties_a_muscle_at_the_valve_s_rate(prototype, abducted):
    options = ep.PlantOptions(valves=unit(layout="fill and vent"), shoulder_viscous=0.1)
    plant = ep.Plant(prototype, options)
    start = plant.rest([1e5, 0.0, 3.5e5], near=abducted)
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


def test_a_table_of_two_rows_is_a_polynomial(tmp_path):
    limits = Validity(strain=(0.0, 0.25), pressure=(0.0, 4e5))
    options = {"strains": [0.0, 0.25], "pressures": [0.0, 4e5], "forces": [[0.0, 240.0], [0.0, 10.0]]}
    save_parameters(ForceTable(name="sheet", reference_length=0.3, validity=limits, **options), tmp_path / "law.toml")
    muscle = ep.Actuator("pneumatic muscle", force_law=(tmp_path / "law.toml").read_text(), supply_pressure=3e5)
    exo = ep.load("four-cables")
    limb = ep.Limb("SPS", stroke=ep.Stroke(0.2, 0.75, 1.0, 0.1), actuator=muscle)
    plant = ep.Plant(exo.replace(limbs=[limb] * 4))
    # At 3 bar and 10 %, 0.02 m shorter than the muscle's 0.2 m and the fitting.
    least, greatest = plant.force_limits(np.full(4, 0.28))
    np.testing.assert_allclose(least, 0.0, atol=1e-12)
    np.testing.assert_allclose(greatest, 0.75 * (240.0 - 0.4 * 230.0), rtol=1e-9)
