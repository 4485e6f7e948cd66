"""A table of forces as a law, against SciPy's interpolation and differences."""

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from exo_pin.muscle import ForceTable, Validity, muscle_model

STRAINS, PRESSURES = (0.0, 0.04, 0.1, 0.18, 0.25), (0.0, 1e5, 2.5e5, 4e5)
LIMITS = Validity(strain=(0.0, 0.25), pressure=(0.0, 4e5))


def sampled(strains=STRAINS, pressures=PRESSURES, validity=LIMITS):
    """Forces of a published law at entries of a table."""
    law = muscle_model("best")
    x, p = np.meshgrid(np.array(strains) * law.reference_length, pressures, indexing="ij")
    return ForceTable(
        name="sheet",
        reference_length=law.reference_length,
        validity=validity,
        strains=strains,
        pressures=pressures,
        forces=law.unchecked_force(x, p),
    )


def test_a_table_is_straight_between_its_entries():
    law, rng = sampled(), np.random.default_rng(1)
    strain, pressure = rng.uniform(0.0, 0.25, 400), rng.uniform(0.0, 4e5, 400)
    x = strain * law.reference_length
    own = RegularGridInterpolator((STRAINS, PRESSURES), np.array(law.forces))(np.stack([strain, pressure], axis=1))
    np.testing.assert_allclose(law.force(x, pressure, "mark").data, own, rtol=1e-12, atol=1e-12)
    x_at, p_at = np.meshgrid(np.array(STRAINS) * law.reference_length, PRESSURES, indexing="ij")
    np.testing.assert_allclose(law.force(x_at, p_at, "mark").data, law.forces, rtol=1e-12, atol=1e-12)
    # Away from borders of cells, differences are the derivatives.
    h = 1e-7
    inside = np.min(np.abs(strain[:, None] - STRAINS), axis=1) > 1e-4
    slope = (law.unchecked_force(x + h, pressure) - law.unchecked_force(x - h, pressure)) / (2 * h)
    np.testing.assert_allclose(law.stiffness(x, pressure, "mark").data[inside], slope[inside], rtol=1e-5, atol=1e-3)
    inside = np.min(np.abs(pressure[:, None] - PRESSURES), axis=1) > 10.0
    gain = (law.unchecked_force(x, pressure + 1.0) - law.unchecked_force(x, pressure - 1.0)) / 2.0
    np.testing.assert_allclose(law.pressure_gain(x, pressure, "mark").data[inside], gain[inside], rtol=1e-6, atol=1e-12)
    there = law.pressure_for(own, x, "mark")
    known = ~there.mask
    assert known.sum() > 200
    np.testing.assert_allclose(law.force(x[known], there.data[known], "mark").data, own[known], atol=1e-6)
