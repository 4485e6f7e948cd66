"""The model "best", chosen by cross-validation on the printed data, with its figures."""

import runpy
import tomllib
from importlib.resources import files

import numpy as np
import pytest
from places import SCRIPTS

from exo_pin.muscle import identify_static, muscle_model, muscle_models, steady_states


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(SCRIPTS / "fitted_laws.py"))


def test_best_is_the_chosen_form_and_has_its_figures(script):
    """Of the 25 cells that the thesis calls valid, and of the region found: better than the second order."""
    figures = tomllib.loads((files("exo_pin.muscle") / "parameters" / "best.toml").read_text())["identification"]
    every, best = steady_states(), muscle_model("best")
    inside = ~np.ma.getmaskarray(best.force(every.contraction, every.pressure, outside="mark"))
    for states, least, second in (
        (steady_states(valid_only=True), 0.40681, 0.60696),
        (every.select(inside), figures["leave_one_out_rms_N"], figures["second_order_leave_one_out_rms_N"]),
    ):
        columns = states.contraction, states.pressure, states.force
        found, plain = script["chosen"](*columns), identify_static(*columns, 0.3)
        assert " ".join(f"x{i}P{j}" for i, j in found.powers) == figures["winner"]
        np.testing.assert_allclose([found.leave_one_out_rms, plain.leave_one_out_rms], [least, second], rtol=2e-5)
    assert inside.sum() == figures["measurements"] == 27


def test_shipped_fits_are_what_a_refit_gives(script):
    fresh = script["refit"]()
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
