"""Numbers of a stored search: how large they may be, what must be above zero, and what a state gives back."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.workspace.optimisation.descent import GENERATION, Descent

pytest.importorskip("cmaes")

MERIT = SimpleNamespace(variables=SimpleNamespace(count=2))


@pytest.fixture(scope="module")
def state():
    """As of a search that has just begun, told that it has made a generation."""
    return {**Descent(MERIT, {}, (1, 0)).stored(), "value": 3.5, "evaluations": GENERATION}


@pytest.mark.parametrize(
    ("key", "largest"),
    [
        ("mean", 1e6),
        ("step", 1e4),
        ("covariance", 1e12),
        ("step_path", 1e3),
        ("covariance_path", 1e12),
        ("recent_values", 1e12),
    ],
)
def test_states_are_of_sizes_that_a_search_can_have(state, key, largest):
    """Of one number of either sign; the message names it and the limit."""

    def with_last(value):
        given = state[key]
        return {**state, key: [*given[:-1], value] if isinstance(given, list) else value}

    run = Descent(MERIT, {}, (1, 0), with_last(0.999 * largest))
    assert (run.done, run.value) == (GENERATION, 3.5)
    assert run.stored()[key] == with_last(0.999 * largest)[key]
    for beyond in (1.001, -1.001):
        with pytest.raises(InvalidInput, match=f"{key}.*{re.escape(f'{largest:g}')}"):
            Descent(MERIT, {}, (1, 0), with_last(beyond * largest))


@pytest.mark.parametrize("done", [0, GENERATION - 1, GENERATION + 1, -GENERATION])
def test_only_whole_generations_are_stored(state, done):
    with pytest.raises(InvalidInput, match=f"multiple of {GENERATION}"):
        Descent(MERIT, {}, (1, 0), {**state, "evaluations": done})
    assert Descent(MERIT, {}, (1, 0), {**state, "evaluations": 2 * GENERATION})._search.generation == 2


def test_steps_and_variances_are_above_zero(state):
    for key, value in (
        ("step", 0.0),
        ("step", -1.0),
        ("covariance", [1.0, 0.0, 0.0]),
        ("covariance", [-1.0, 0.0, 1.0]),
    ):
        with pytest.raises(InvalidInput, match="above zero"):
            Descent(MERIT, {}, (1, 0), {**state, key: value})
    assert Descent(MERIT, {}, (1, 0), {**state, "covariance": [1e-9, 0.0, 2.0]}).best.tolist() == state["best"]


def test_a_search_starts_at_random_in_the_cube_or_finely_at_a_design():
    drawn = np.array([Descent(MERIT, {}, (seed,)).best for seed in range(40)])
    assert 0.0 <= drawn.min() < 0.1
    assert 0.9 < drawn.max() <= 1.0
    wide, fine = Descent(MERIT, {}, (1, 0)), Descent(MERIT, {}, (1, 0), start=np.array([0.25, 0.75]))
    assert fine.best.tolist() == [0.25, 0.75]
    assert (wide.done, wide.value) == (fine.done, fine.value) == (0, np.inf)
    # A random start looks about, a design is improved.
    assert wide.stored()["step"] > 0.2 > 0.05 > fine.stored()["step"] > 0.0
