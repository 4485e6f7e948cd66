"""Properties and curves of the muscles."""

import numpy as np
import pytest

from exo_pin.person import MUSCLES
from exo_pin.person.limb.muscle_table import active_curve, muscle_state, muscle_table, passive_curve, velocity_curve


def test_table_has_the_strengths_of_the_source():
    table = dict(zip(MUSCLES, muscle_table().force, strict=True))
    # Doubled in MyoArm.
    assert (table["INFSP"], table["TMIN"], table["TMAJ"]) == (1075.8, 269.5, 144.0)
    assert table["SUPSP"] == 499.2
    assert len(MUSCLES) == len(set(MUSCLES)) == 26


def test_scales_act_on_lengths_and_forces():
    one, two = muscle_table(), muscle_table(2.0, 3.0)
    assert np.allclose(two.force, 3.0 * one.force)
    assert np.allclose(two.fibre, 2.0 * one.fibre)
    assert np.allclose(two.tendon, 2.0 * one.tendon)
    assert np.array_equal(two.pennation, one.pennation)
    assert np.allclose(two.volume, 6.0 * one.volume)


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


def test_curves_have_their_marks():
    assert active_curve(np.array([0.2, 1.0, 2.0])) == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    assert velocity_curve(np.array([-2.0, 0.0, 2.0])) == pytest.approx([0.0, 1.0, 1.4], abs=1e-15)
    assert passive_curve(np.array([0.5, 1.0, 1.6405])) == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)
    for curve in (passive_curve, velocity_curve):
        assert (np.diff(curve(np.linspace(-1.5, 2.5, 400))) >= -1e-12).all()


def test_muscle_at_its_optimal_length_has_its_strength_along_the_tendon():
    table = muscle_table()
    state = muscle_state(table, table.tendon + table.fibre * np.cos(table.pennation))
    assert np.allclose(state.fibre, 1.0)
    assert np.allclose(state.active, table.force * np.cos(table.pennation))
    assert np.abs(state.passive).max() < 1e-9


def test_slack_muscle_has_no_force():
    table = muscle_table()
    state = muscle_state(table, 0.9 * table.tendon)
    assert not state.active.any()
    assert not state.passive.any()


def test_shortening_weakens_and_lengthening_strengthens():
    table = muscle_table()
    length = table.tendon + table.fibre
    still, in_, out = (muscle_state(table, length, np.full(len(MUSCLES), v)).active for v in (0.0, -0.1, 0.1))
    assert (in_ < still).all()
    assert (out > still).all()


def test_passive_forces_can_be_left_out():
    table = muscle_table()
    stretched = table.tendon + 1.5 * table.fibre
    assert (muscle_state(table, stretched).passive > 0.2 * table.force).all()
    assert not muscle_state(table, stretched, passive=False).passive.any()
