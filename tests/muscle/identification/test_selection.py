"""The model "best", chosen by cross-validation on the printed data, with its figures."""

import runpy
import tomllib
from importlib.resources import files

import numpy as np
import pytest
from places import SCRIPTS

from exo_pin.muscle import NotIdentifiable, find_region, muscle_model, muscle_models, select_model, steady_states, table

SECOND_ORDER = "x2P1 x1P1 x0P1 x2P0 x1P0 x0P0"
WINNER = "x3P1 x2P1 x1P1 x0P1 x0P0 x0P2"


@pytest.fixture(scope="module")
def selection():
    states = steady_states(valid_only=True)
    return select_model(states.contraction, states.pressure, states.force, 0.3)


def test_best_beats_the_second_order_law(selection):
    assert selection.winner.name == WINNER
    assert len(selection.winner.powers) == 6
    winner, second = selection.winner.leave_one_out_rms, selection.score(SECOND_ORDER).leave_one_out_rms
    np.testing.assert_allclose([winner, second], [0.40681, 0.60696], atol=1e-5)


@pytest.mark.full
def test_choosing_flatters_the_winner_and_it_still_is_ahead(selection):
    """With the choice repeated without each cell."""
    states = steady_states(valid_only=True)
    again = select_model(states.contraction, states.pressure, states.force, 0.3, nested=True)
    np.testing.assert_allclose(again.nested_rms, 0.51660, atol=1e-5)
    assert again.nested_rms < selection.score(SECOND_ORDER).leave_one_out_rms


def test_it_wins_on_the_region_found_too():
    states = steady_states()
    best = muscle_model("best")
    inside = ~np.ma.getmaskarray(best.force(states.contraction, states.pressure, outside="mark"))
    # The region's own ranges take in its 27 cells and no cell that the tables reject beside them.
    assert inside.sum() == 27
    states = states.select(inside)
    found = select_model(states.contraction, states.pressure, states.force, 0.3)
    assert found.winner.name == WINNER
    figures = [found.winner.leave_one_out_rms, found.score(SECOND_ORDER).leave_one_out_rms]
    np.testing.assert_allclose(figures, [0.38093, 0.74054], atol=1e-5)


@pytest.mark.full
def test_shipped_figures_are_those_of_the_selection():
    figures = tomllib.loads((files("exo_pin.muscle") / "parameters" / "best.toml").read_text())["identification"]
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, 0.3)
    chosen = states.select(region.selected)
    found = select_model(chosen.contraction, chosen.pressure, chosen.force, 0.3, nested=True)
    assert figures["measurements"] == 27
    assert figures["winner"] == found.winner.name
    fresh = [found.winner.leave_one_out_rms, found.nested_rms, found.score(SECOND_ORDER).leave_one_out_rms]
    shipped = [figures[k] for k in ("leave_one_out_rms_N", "nested_rms_N", "second_order_leave_one_out_rms_N")]
    np.testing.assert_allclose(shipped, fresh, rtol=1e-6)
    assert shipped[1] < shipped[2]


def test_what_the_notes_say_of_table_a_3():
    sheet = table("a-3")
    x, p = sheet.row("contraction_mm") / 1e3, sheet.row("pressure_bar") * 1e5
    more = muscle_model("best").force(x, p, outside="mark") - 42.3
    assert more.count() == 7
    assert 4.1 < more.min() < more.max() < 5.0
    assert any("4.1 to 5.0 N" in note for note in muscle_model("best").notes)


def test_shipped_fits_are_what_a_refit_gives():
    fresh = runpy.run_path(str(SCRIPTS / "fitted_laws.py"))["refit"]()
    assert set(fresh) == {n for n in muscle_models() if not n.startswith("tang-")}
    x, p = np.meshgrid(np.linspace(0.013, 0.075, 9), np.linspace(1.3e5, 4e5, 7))
    for name, model in fresh.items():
        shipped = muscle_model(name)
        np.testing.assert_allclose(shipped.unchecked_force(x, p), model.unchecked_force(x, p), rtol=1e-6, atol=1e-6)
        assert shipped.validity.basis == model.validity.basis
        np.testing.assert_allclose(shipped.validity.strain, model.validity.strain, rtol=1e-9)
        np.testing.assert_allclose(shipped.validity.pressure, model.validity.pressure, rtol=1e-9)
        np.testing.assert_allclose(shipped.validity.capability, model.validity.capability, rtol=1e-6)
    # The printed sets of Chapter 3 hold in the same region: it was found, not typed in.
    for name in ("tang-3-25", "tang-3-3a", "tang-optimised"):
        np.testing.assert_allclose(muscle_model(name).validity.strain, fresh["best"].validity.strain, rtol=1e-9)
        np.testing.assert_allclose(muscle_model(name).validity.capability, fresh["best"].validity.capability, rtol=1e-6)


@pytest.mark.full
def test_a_truth_of_second_order_is_not_overfitted():
    truth = muscle_model("tang-optimised")
    states = steady_states(valid_only=True)
    rng = np.random.default_rng(12)
    exact = truth.unchecked_force(states.contraction, states.pressure)
    forces = [exact + rng.normal(0, 0.4, 25) for _ in range(9)]
    sizes = [len(select_model(states.contraction, states.pressure, f, 0.3).winner.powers) for f in forces]
    assert np.median(sizes) <= 6


def test_nonsense_is_refused():
    rng = np.random.default_rng(13)
    x, p = rng.uniform(0.01, 0.07, 25), rng.uniform(1e5, 4e5, 25)
    # Pulls less with more air and more when shorter: no muscle.
    with pytest.raises(NotIdentifiable, match="behaves like a muscle"):
        select_model(x, p, 80 + 500 * x - 1e-4 * p, 0.3)
    states = steady_states(valid_only=True)
    with pytest.raises(NotIdentifiable, match="nested=True"):
        _ = select_model(states.contraction, states.pressure, states.force, 0.3).nested_rms
