"""Runs of a search: what they keep and count, and how large the numbers of a stored one may be."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import starting_design
from exo_pin.workspace.optimisation.descent import GENERATION, Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables

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


def bowl(at):
    """A merit that is least, 0, at one share of the range of each of three variables."""
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male")
    design = starting_design(ep.Actuator("cable", pull_limit=400.0), arm, 3)
    bounds = {"A[1].radius": (0.1, 0.3), "A[1].elevation": (-1.0, 1.0), "B[1].drop": (0.1, 0.2)}
    space = DesignVariables(design, bounds)
    low, high = space.bounds.T
    asked = []

    def generation(points, weights):
        asked.extend(points)
        shares = [(np.array(list(space.values(point).values())) - low) / (high - low) for point in points]
        return [float(((share - at) ** 2).sum()) for share in shares]

    return SimpleNamespace(variables=space, generation=generation), asked


def test_a_run_keeps_its_best_and_counts():
    at = np.array([0.2, 0.9, 0.5])
    merit, asked = bowl(at)
    run, calls = Descent(merit, {}, (3, 0)), []
    assert run.value == np.inf
    assert run.run(12 * GENERATION, lambda: calls.append(run.done) or True)
    assert run.done == len(asked) == 12 * GENERATION
    assert calls == list(range(GENERATION, run.done + 1, GENERATION))
    values = merit.generation(list(asked), {})
    assert run.value == min(values)
    assert run.value < 1e-2
    assert np.mean(values[-GENERATION:]) < 0.5 * np.mean(values[:GENERATION])
    assert ((run.best >= 0.0) & (run.best <= 1.0)).all()
    assert merit.generation([run.best], {})[0] == pytest.approx(run.value, abs=1e-12)
    # It starts near a design that is given, and anywhere without one.
    for start, spread in ((None, (0.1, 0.6)), (np.full(3, 0.5), (0.01, 0.04))):
        merit, asked = bowl(at)
        assert Descent(merit, {}, (3, 0), start=start).run(1) is True
        assert len(asked) == GENERATION
        assert spread[0] < np.std(asked, axis=0).mean() < spread[1]
        assert start is None or np.abs(np.mean(asked, axis=0) - 0.5).max() < 0.03
    # Whoever says no ends it.
    merit, asked = bowl(at)
    assert Descent(merit, {}, (3, 0)).run(10 * GENERATION, lambda: False) is False
    assert len(asked) == GENERATION


def test_a_broken_off_run_goes_on_with_the_same_numbers():
    merit, _ = bowl(np.array([0.2, 0.9, 0.5]))
    whole, first = Descent(merit, {}, (1, 0)), Descent(merit, {}, (1, 0))
    whole.run(6 * GENERATION)
    first.run(3 * GENERATION)
    second = Descent(merit, {}, (1, 0), first.stored())
    second.run(6 * GENERATION)
    assert second.done == whole.done == 6 * GENERATION
    # cmaes stores its matrix without the half that symmetry gives, so to rounding.
    assert second.value == pytest.approx(whole.value, rel=1e-9)
    np.testing.assert_allclose(second.best, whole.best, rtol=1e-6, atol=1e-9)
