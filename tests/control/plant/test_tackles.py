"""Muscles that pull a cable over a tackle: force and travel against the muscle's own law, energy, air, files."""

import numpy as np
from drive_plants import held

from exo_pin.control.plant.equations.drive_kernels import air_volume
from exo_pin.muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE


def test_no_air_is_lost_and_energy_is_accounted_for():
    plant, _, start = held("four-muscle-cables")
    run = plant.simulate(lambda t, measured: [0.3, -0.2, 0.1, -0.4], 0.5, start, rtol=1e-10)
    rows, count = plant.tables.muscles, [drive.count for drive in plant.drives]
    volumes = np.array([[air_volume(rows[i], float(x))[0] for i, x in enumerate(k)] for k in run.bladder_contractions])
    mass = (count * (run.pressures + ATMOSPHERE) * volumes).sum(axis=1) / (GAS_CONSTANT * REFERENCE_TEMPERATURE)
    np.testing.assert_allclose(mass - mass[0], run.air_used - run.air_vented, atol=1e-10)
    assert np.abs(run.energy_residual).max() < 1e-6 * run.kinetic_energy.max()
    assert run.drive_loss[-1].sum() > 0.0
