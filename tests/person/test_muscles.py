"""Strengths of the source and curves of OpenSim."""

import numpy as np
import pytest

from exo_pin.person import MUSCLES
from exo_pin.person.limb.muscle_table import active_curve, muscle_table, passive_curve, velocity_curve


def test_table_has_the_strengths_of_the_source():
    table = dict(zip(MUSCLES, muscle_table().force, strict=True))
    # Doubled in MyoArm.
    assert (table["INFSP"], table["TMIN"], table["TMAJ"]) == (1075.8, 269.5, 144.0)
    assert table["SUPSP"] == 499.2
    assert len(MUSCLES) == len(set(MUSCLES)) == 26


@pytest.mark.parametrize(
    ("curve", "at", "values"),
    [
        # OpenSim 4.6, at points between the table's.
        (active_curve, [0.515, 0.735, 1.02, 1.18, 1.42], [0.2009, 0.8961, 0.9999, 0.7872, 0.3031]),
        (passive_curve, [0.9, 1.12, 1.37, 1.58, 1.8], [0.0, 0.0101, 0.1501, 0.6478, 2.0074]),
        (velocity_curve, [-0.55, -0.12, 0.06, 0.6], [0.1286, 0.5825, 1.1874, 1.3470]),
    ],
)
def test_curves_are_those_of_opensim(curve, at, values):
    assert np.abs(curve(np.array(at)) - values).max() < 0.005
