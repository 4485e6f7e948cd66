"""Plots: drawn without warnings, with the data and labels that they are for."""

import dataclasses

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.muscle import (
    PressureStep,
    dynamic_model,
    muscle_model,
    simulate,
    steady_states,
)
from exo_pin.view.plots.muscle_plots import plot_force_map, plot_responses

PNG = b"\x89PNG"


def test_force_map(tmp_path):
    figure = plot_force_map(muscle_model("best"), steady_states())
    axis = figure.axes[0]
    assert axis.get_xlabel() == "contraction, mm"
    assert axis.get_ylabel() == "pressure, bar"
    points = sum(len(c.get_offsets()) for c in axis.collections if type(c).__name__ == "PathCollection")
    assert points == 66
    figure.savefig(tmp_path / "map.png", dpi=50)
    assert (tmp_path / "map.png").read_bytes().startswith(PNG)
    plot_force_map(muscle_model("best", 0.15)).savefig(tmp_path / "short.png", dpi=50)
    with pytest.raises(InvalidInput, match="scaled"):
        plot_force_map(muscle_model("best", 0.15), steady_states())


@pytest.mark.parametrize("stronger", [1e-3, 1.0, 21.0, 1e4])
def test_steps_of_the_force_map_fit_its_range(stronger):
    """A muscle of 0.07 N or 700 kN has as many steps as one of 70 N, and each has its number."""
    best = muscle_model("best")
    everywhere = dataclasses.replace(best.validity, capability=None)
    stiffer = {k: stronger * c for k, c in best.coefficients.items()}
    model = dataclasses.replace(best, coefficients=stiffer, validity=everywhere)
    figure = plot_force_map(model)
    steps = figure.axes[1].get_yticks()
    assert 5 <= len(steps) <= 12
    np.testing.assert_allclose(np.diff(steps), steps[1] - steps[0])
    assert len({text.get_text() for text in figure.axes[1].get_yticklabels()}) == len(steps)
    force = model.force(*np.meshgrid([0.03, 0.05, 0.07], [2e5, 4e5]), outside="mark")
    assert steps[0] <= np.min(force)
    assert np.max(force) <= steps[-1]


def test_responses(tmp_path):
    times, step = np.linspace(0, 1.5, 301), PressureStep(0.0, 3.634e5, 0.1, 0.1)
    names = ("tang-3-31", "tang-constant-friction")
    made = {name: simulate(dynamic_model(name), 22.74 / 9.81, step, times, outside="mark") for name in names}
    figure = plot_responses(made)
    top, bottom = figure.axes
    labels = [text.get_text() for text in top.get_legend().get_texts()]
    assert labels[0].startswith("tang-3-31: overshoot")
    np.testing.assert_array_equal(top.get_lines()[0].get_ydata(), 1e3 * made["tang-3-31"].contraction)
    assert bottom.get_ylabel() == "pressure, bar"
    figure.savefig(tmp_path / "responses.png", dpi=50)
    with pytest.raises(InvalidInput, match="one to three"):
        plot_responses({})


def test_responses_that_do_not_settle_or_move_say_so():
    times, model = np.linspace(0, 1.5, 151), dynamic_model("tang-3-31")
    made = {
        name: simulate(model, mass, PressureStep(0.0, 3e5), times, outside="mark")
        for name, mass in (("light", 3.0), ("heavy", 50.0))
    }
    assert np.isinf(made["light"].settling_time())
    labels = [text.get_text() for text in plot_responses(made).axes[0].get_legend().get_texts()]
    assert labels == [
        f"light: overshoot {100 * made['light'].overshoot:.0f} %, has not settled",
        "heavy: ends where it began",
    ]
