"""Muscles that pull a cable over a tackle: force and travel against the muscle's own law, energy, air, files."""

from dataclasses import replace

import numpy as np
import pytest
from drive_plants import held

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.control.plant.equations.drive_kernels import air_volume, tension
from exo_pin.design import Tackle
from exo_pin.muscle import muscle_model
from exo_pin.muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE


def plant_with(count=3, ratio=2.0, **options):
    mechanism = ep.load("four-muscle-cables").mechanism
    limbs = [
        replace(limb, actuator=replace(limb.actuator, tackle=replace(limb.actuator.tackle, count=count, ratio=ratio)))
        for limb in mechanism.limbs
    ]
    return ep.Plant(mechanism.replace(limbs=limbs), ep.PlantOptions(pulley_friction=0.0, **options))


def test_the_cable_has_the_bundle_s_force_over_the_ratio_and_its_travel_times_it():
    plant, model = plant_with(count=3, ratio=2.0), muscle_model("tang-optimised", 0.55)
    table = plant.tables
    for i, drive in enumerate(plant.drives):
        for contraction in (0.03, 0.08, 0.12):
            pull = tension(table.law, table.muscles[i], i, drive.longest - 2.0 * contraction, 0.0, 3e5, 0.0)
            assert pull[0] == pytest.approx(3.0 * model.force(contraction, 3e5) / 2.0, rel=1e-9)
            assert pull[2] == pytest.approx(contraction, abs=1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.05])
def test_the_cable_gets_the_power_of_the_muscles_less_what_they_lose(friction):
    plant = plant_with(muscle_damping=None)
    table, drive = plant.tables, plant.drives[0]
    row = table.muscles[0].copy()
    row[-1] = friction
    length, speed, pressure = drive.longest - 0.15, -0.08, 3e5
    pull, loss, *_ = tension(table.law, row, 0, length, speed, pressure, 1.0)
    muscles = 3.0 * muscle_model("tang-optimised", 0.55).force(0.075, pressure)
    assert pull * -speed + loss == pytest.approx(muscles * 0.04, rel=1e-9)
    assert pull == pytest.approx((1.0 - friction) * muscles / 2.0, rel=1e-9)
    # The other way the pulleys hold back the cable.
    assert tension(table.law, row, 0, length, -speed, pressure, -1.0)[0] == pytest.approx(
        (1.0 + friction) * muscles / 2.0
    )


def test_a_ratio_of_one_and_a_single_muscle_are_the_muscle_in_line():
    prototype = ep.load("prototype").mechanism
    limbs = []
    for limb in prototype.limbs:
        stroke, law = limb.stroke, limb.actuator
        tackle = Tackle(1.0, stroke.nominal_length, law.force_law, law.supply_pressure)
        limbs.append(replace(limb, actuator=ep.Actuator("cable", tackle=tackle)))
    over = ep.Plant(prototype.replace(limbs=limbs), ep.PlantOptions(pulley_friction=0.0))
    line = ep.Plant(prototype)
    pose = ep.thesis_rotation(60, -20, -15, degrees=True)
    a, b = (
        p.simulate(lambda t, measured: [-0.4, -1.0, 0.6], 0.5, p.state(pose, pressures=[1e5, 0.0, 2e5]))
        for p in (over, line)
    )
    np.testing.assert_array_equal(a.rotations.as_quat(), b.rotations.as_quat())
    np.testing.assert_array_equal(a.tensions, b.tensions)


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


def test_no_air_is_lost_and_energy_is_accounted_for():
    plant, _, start = held("four-muscle-cables")
    run = plant.simulate(lambda t, measured: [0.3, -0.2, 0.1, -0.4], 0.5, start, rtol=1e-10)
    rows, count = plant.tables.muscles, [drive.count for drive in plant.drives]
    volumes = np.array([[air_volume(rows[i], float(x))[0] for i, x in enumerate(k)] for k in run.bladder_contractions])
    mass = (count * (run.pressures + ATMOSPHERE) * volumes).sum(axis=1) / (GAS_CONSTANT * REFERENCE_TEMPERATURE)
    np.testing.assert_allclose(mass - mass[0], run.air_used - run.air_vented, atol=1e-10)
    assert np.abs(run.energy_residual).max() < 1e-6 * run.kinetic_energy.max()
    assert run.drive_loss[-1].sum() > 0.0


def test_a_tackle_survives_its_file(tmp_path):
    exo = ep.load("four-muscle-cables")
    exo.save(tmp_path / "mine.toml")
    again = ep.load(str(tmp_path / "mine.toml"))
    assert [limb.actuator.tackle for limb in again.limbs] == [limb.actuator.tackle for limb in exo.limbs]
    assert [limb.actuator.tackle.count for limb in again.limbs] == [15, 7, 8, 3]


@pytest.mark.parametrize(
    "make",
    [
        lambda: Tackle(0.5, 0.55, "tang-optimised", 4e5),
        lambda: Tackle(2.0, -0.55, "tang-optimised", 4e5),
        lambda: Tackle(2.0, 0.55, "tang-optimised", 4e5, count=0),
        lambda: Tackle(2.0, 0.55, "tang-optimised", 4e5, count=1.5),
        lambda: Tackle(2.0, 0.55, "", 4e5),
        lambda: ep.Actuator("linear", tackle=Tackle(2.0, 0.55, "tang-optimised", 4e5)),
    ],
)
def test_bad_tackles_are_refused(make):
    with pytest.raises(InvalidInput):
        make()
