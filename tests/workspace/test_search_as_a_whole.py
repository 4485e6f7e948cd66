"""A search from its call to its result, with checks on grids so coarse that they take no time."""

from dataclasses import replace

import numpy as np
import pytest
from small_searches import GENERATION, searched

from exo_pin.workspace import CRITERIA

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

pytestmark = pytest.mark.usefixtures("plain")


@pytest.mark.parametrize(
    ("budget", "length", "runs"), [(1, 24, [24]), (24, 10, [24]), (24, 48, [24]), (100, 48, [48, 48]), (71, 48, [48])]
)
def test_a_budget_is_used_by_whole_generations(budget, length, runs):
    assert [run.evaluations for run in searched(budget=budget, run_length=length).runs] == runs


@pytest.mark.parametrize(("designs", "runs"), [(26, [(0, 24)]), (50, [(0, 48)]), (76, [(0, 48), (1, 24)])])
def test_a_search_that_is_stopped_keeps_what_it_has(monkeypatch, designs, runs):
    """Ctrl-C in the generation that follows; a run that has ended evaluates its best once more."""
    own, calls = CRITERIA["singularity"], []

    def stopped(at):
        calls.append(at)
        if len(calls) == designs:
            raise KeyboardInterrupt
        return own.margin(at)

    monkeypatch.setitem(CRITERIA, "singularity", replace(own, margin=stopped))
    found = searched(budget=10 * GENERATION)
    assert found.stopped
    assert [(run.number, run.evaluations) for run in found.runs] == runs
    for run in found.runs:
        assert 0.0 <= min(run.point) <= max(run.point) <= 1.0
        assert np.isfinite(run.merit)
