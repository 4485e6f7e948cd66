"""The printed tables, and the cells of Tables 3-3a to 3-3c and A-3 from their own coefficients."""

import numpy as np
import pytest

from exo_pin import UnknownName
from exo_pin.muscle import muscle_model, steady_states, table, tables

# Every cell whose error is printed in Table 3-3c, (regulator setting in bar, hung weight in N).
VALID = {
    1.2: (12.74,),
    1.6: (12.74, 22.74),
    2.0: (12.74, 22.74),
    2.4: (12.74, 22.74, 32.74),
    2.8: (12.74, 22.74, 32.74, 42.74),
    3.2: (12.74, 32.74, 52.74),
    3.6: (12.74, 22.74, 32.74, 42.74, 52.74),
    4.0: (12.74, 22.74, 32.74, 42.74, 52.74, 62.74),
}


def grid():
    return table("3-2").values / 1e3, table("3-1").values * 1e5


def test_all_tables_are_there_with_source_and_units():
    assert tables() == ["3-1", "3-2", "3-3a", "3-3b", "3-3c", "3-4", "a-1", "a-2", "a-3", "b-1"]
    for name in tables():
        sheet = table(name)
        assert "Tang" in sheet.source
        assert sheet.units
        assert sheet.title.startswith(f"Table {name.upper() if name[0] in 'ab' else name},")
        assert {len(row) for row in sheet.printed} == {len(sheet.columns)}


@pytest.mark.parametrize("name", ["3-1", "3-2", "3-3a", "3-3b", "3-3c"])
def test_grid_tables_have_the_shape_of_the_experiment(name):
    sheet = table(name)
    np.testing.assert_array_equal(sheet.row_numbers, np.arange(1, 11) * 4 / 10)
    np.testing.assert_allclose(sheet.column_numbers, 12.74 + 10 * np.arange(7))


def test_missing_cells_are_the_printed_strokes():
    for name, gaps in (
        ("3-1", {(1.6, 52.74), (2.0, 12.74), (3.2, 22.74), (3.2, 42.74)}),
        ("3-3c", {(3.2, 22.74), (3.2, 42.74)}),
    ):
        sheet = table(name)
        missing = {(sheet.row_numbers[i], sheet.column_numbers[j]) for i, j in np.argwhere(~sheet.present)}
        assert missing == gaps
        assert all(sheet.printed[i][j] == "/" for i, j in np.argwhere(~sheet.present))


def test_cells_are_stored_as_printed():
    assert table("3-3c").printed[3][1] == "21.14(-2.7%)"
    assert table("3-3b").printed[0][0] == "-2.09()"
    assert table("3-4").printed[0][0] == "224.93, -91.31, 6.86 -1.01,0.80"
    assert table("a-1").printed[0][0] == "5.01"
    assert table("a-2").row("excitation")[0] == 51.962
    np.testing.assert_array_equal(table("3-4").groups[6, 4], [228.93, -90.45, 6.90, -1.01, 0.80])
    assert np.isnan(table("b-1").groups[5, 1]).all()


def test_notes_name_the_misprints():
    assert any("22.14 must be meant" in note for note in table("3-3c").notes)
    assert any("-5.01 must be meant" in note for note in table("a-1").notes)
    assert any("1e-5" in note for note in table("a-2").notes)


def test_valid_cells_are_26_of_which_25_have_data():
    errors = table("3-3c").errors_percent
    printed = {
        (float(table("3-3c").row_numbers[i]), float(table("3-3c").column_numbers[j]))
        for i, j in np.argwhere(np.isfinite(errors))
    }
    assert printed == {(bar, weight) for bar, weights in VALID.items() for weight in weights}
    assert len(printed) == 26
    states = steady_states(valid_only=True)
    assert len(states.force) == 25
    with_data = set(zip(np.round(states.regulator / 1e5, 1).tolist(), states.force.tolist(), strict=True))
    assert printed - with_data == {(2.0, 12.74)}
    assert len(steady_states().force) == 66


@pytest.mark.parametrize(("which", "name", "tolerance"), [("3-3a", "tang-3-3a", 0.25), ("3-3b", "tang-3-25", 0.03)])
def test_every_cell_of_3_3a_and_3_3b_comes_out(which, name, tolerance):
    x, p = grid()
    gap = muscle_model(name).unchecked_force(x, p) - table(which).values
    checked = np.isfinite(gap)
    # 70 cells less the two never measured and the two that the table prints without data.
    assert checked.sum() == 66
    assert np.abs(gap[checked]).max() < tolerance


def test_valid_cells_of_3_3c_come_out_but_for_the_named_one():
    x, p = grid()
    sheet = table("3-3c")
    gap = muscle_model("tang-optimised").unchecked_force(x, p) - sheet.values
    valid = np.isfinite(sheet.errors_percent) & np.isfinite(gap)
    assert valid.sum() == 25
    off = [(sheet.rows[i], sheet.columns[j]) for i, j in np.argwhere(valid & (np.abs(gap) > 0.03))]
    assert off == [("1.6", "22.74")]
    # Its own error of -2.7 % says what was meant: 22.14 N.
    assert abs(sheet.values[3, 1] + gap[3, 1] - 22.14) < 0.03
    assert sheet.errors_percent[3, 1] == round(100 * ((sheet.values[3, 1] + gap[3, 1]) / 22.74 - 1), 1)


def test_cells_outside_the_region_of_3_3c_are_those_of_3_3a():
    first, third = table("3-3a"), table("3-3c")
    outside = np.isnan(third.errors_percent) & third.present
    assert outside.sum() == 42
    np.testing.assert_allclose(third.values[outside], first.values[outside], atol=0.0101)
    x, p = grid()
    gap = np.abs(muscle_model("tang-optimised").unchecked_force(x, p) - third.values)[outside & np.isfinite(x)]
    assert np.median(gap) > 1.0


@pytest.mark.parametrize(("name", "powers"), [("tang-3-3a", (1, 1)), ("tang-optimised", (1, 0))])
def test_lost_minus_signs_are_needed(name, powers):
    states = steady_states(valid_only=True)
    model = muscle_model(name)
    as_printed = type(model)(
        coefficients=model.coefficients | {powers: -model.coefficients[powers]},
        name="as printed",
        reference_length=0.3,
        validity=model.validity,
    )
    right, wrong = (
        np.abs(m.unchecked_force(states.contraction, states.pressure) - states.force).max() for m in (model, as_printed)
    )
    assert right < 2.5
    assert wrong > 50


def test_relaxation_gives_table_a_3_and_excitation_does_not():
    sheet = table("a-3")
    x, p = sheet.row("contraction_mm") / 1e3, sheet.row("pressure_bar") * 1e5
    printed = sheet.row("calculated_force_N")
    assert len(x) == 10
    assert np.abs(muscle_model("tang-relaxation").unchecked_force(x, p) - printed).max() < 0.5
    assert np.abs(muscle_model("tang-excitation").unchecked_force(x, p) - printed).max() > 15


def test_arrays_are_frozen_and_unknown_names_listed():
    with pytest.raises(ValueError, match="read-only"):
        steady_states().force[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        table("3-1").values[0, 0] = 1.0
    with pytest.raises(UnknownName, match="3-3a"):
        table("3-5")
    with pytest.raises(UnknownName, match="pressure_bar"):
        table("a-3").row("pressure")
