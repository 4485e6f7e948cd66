"""A search from its call to its result, with checks on grids so coarse that they take no time."""

from dataclasses import replace

import numpy as np
import pytest
from small_searches import ARM, EXO, GENERATION, searched

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import CRITERIA, Criteria, starting_design

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

pytestmark = pytest.mark.usefixtures("plain")

CENTRE = ep.CentreOffset.together([0.0, 0.004, 0.0])


def test_the_best_of_all_runs_is_checked_and_returned():
    found = searched(budget=3 * GENERATION, run_length=GENERATION)
    assert [(run.number, run.evaluations) for run in found.runs] == [(k, GENERATION) for k in range(3)]
    assert (found.stopped, found.start, found.objectives) == (False, None, ("index",))
    # Three runs are three rows of the full grid, and the best of them is the one that is checked.
    shares = [each["index"] for each in found.values]
    assert len(shares) == 3
    (best,) = found.front
    limits = Criteria(names=("singularity",))
    assert best.index == best.objectives["index"] == max(shares) == best.design.workspace(90.0, limits).index
    assert best.run in [run for run, share in zip(found.runs, shares, strict=True) if share == max(shares)]
    # The design is that of the best point of its run.
    radius, elevation = 0.5 - 0.5 * np.cos(np.pi * np.array(best.run.point))
    first, second = best.design.geometry.base_points[:2]
    assert np.linalg.norm(first) == pytest.approx(0.1 + 0.2 * radius)
    assert np.arcsin(second[2] / np.linalg.norm(second)) == pytest.approx(2.0 * elevation - 1.0)
    np.testing.assert_allclose(best.design.geometry.platform_points, EXO.geometry.platform_points, atol=1e-15)
    assert all(limb.stroke is None for limb in best.design.limbs)


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


def test_the_start_of_a_refinement_is_a_candidate_and_no_run():
    """It has evaluated nothing, has the number -1, and is the design itself."""
    found = searched(refine=True, budget=2 * GENERATION, run_length=GENERATION)
    start = found.start
    np.testing.assert_array_equal(start.design.geometry.base_points, EXO.geometry.base_points)
    assert (start.run.number, start.run.evaluations) == (-1, 0)
    assert [run.number for run in found.runs] == [0, 1]
    assert (len(found.values), found.evaluations) == (2, 2 * GENERATION)
    assert found.best_candidate.index == max(start.index, *(each["index"] for each in found.values))
    # It is the point of the unit cube whose values are those of the design.
    radius = np.linalg.norm(EXO.geometry.base_points[0])
    assert 0.1 + 0.1 * (1.0 - np.cos(np.pi * start.run.point[0])) == pytest.approx(radius)
    # Its runs begin beside it, with small steps: no point is far from it after one generation.
    assert all(abs(run.point[0] - start.run.point[0]) < 0.2 for run in found.runs)


def test_every_centre_is_checked():
    (candidate,) = searched(centre_offset=(None, CENTRE), budget=GENERATION).front
    limits = Criteria(names=("singularity",))
    shares = [candidate.design.workspace(90.0, limits, centre_offset=centre).index for centre in (None, CENTRE)]
    assert [check.workspace.index for check in candidate.checks] == shares


@pytest.mark.parametrize("family", ["linear", "pneumatic muscle"])
def test_strokes_that_are_fitted_take_lengths_of_their_family(family):
    """Half of a linear actuator and 75 % of a muscle is left when it is short, of what is not its dead length."""
    share, dead = {"linear": (0.5, 0.1), "pneumatic muscle": (0.75, 0.04)}[family]
    actuator = ep.Actuator(family, pull_limit=400.0, push_limit=400.0 if family == "linear" else None)
    exo = ep.ShoulderExo.from_mechanism(starting_design(actuator, ARM, 3))
    (candidate,) = searched(exo=exo, fit_strokes=True, budget=GENERATION).front
    lengths = candidate.design.inverse_kinematics(exo.pose([0.0, 40.0, 80.0])).lengths
    for limb, own in zip(candidate.design.limbs, lengths.T, strict=True):
        low, high = limb.length_range
        assert low >= share * high + (1.0 - share) * dead - 1e-9
        assert ((own >= low - 1e-9) & (own <= high + 1e-9)).any()


@pytest.mark.parametrize("wrong", [0, -1, True, 24.0, "24"])
@pytest.mark.parametrize("label", ["budget", "run_length"])
def test_numbers_of_designs_are_whole_and_above_zero(label, wrong):
    with pytest.raises(InvalidInput, match=label):
        searched(**{label: wrong})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"objectives": ()}, "at least one objective"),
        ({"objectives": ["beauty"]}, "beauty"),
        ({"name": ""}, "name of a study"),
        ({"name": 3}, "name of a study"),
        ({"variables": {}}, "mapping"),
        ({"variables": {"A[1].height": (0.0, 1.0)}}, "height"),
        ({"variables": {"A[9].radius": (0.1, 0.2)}}, "9"),
        ({"variables": {"r_A": (0.1, 0.2)}}, "circle"),
        ({"variables": {"A[1].radius": (0.2, 0.1)}}, "A.1..radius"),
        ({"variables": {"A[1].radius": (0.1, 0.2), "A[1].radius_mm": (100.0, 200.0)}}, "each variable once"),
        ({"variables": {"end_fitting[3]": (0.0, 0.1), "nominal_length[1]": (0.3, 0.5)}}, r"nominal_length\[3\]"),
    ],
)
def test_what_cannot_be_searched_is_refused(changes, words):
    with pytest.raises(InvalidInput, match=words):
        searched(**changes)


def test_bounds_of_a_refinement_hold_its_design_to_a_micrometre():
    exact = float(np.hypot(0.15, 0.1))
    words = "hold the design that is refined"
    for low, high, error in (
        (exact + 0.9e-6, 0.3, None), (0.1, exact - 0.9e-6, None), (exact + 2e-6, 0.3, words), (0.1, exact - 2e-6, words)
    ):  # fmt: skip
        given = {"variables": {"A[1].radius": (low, high)}, "refine": True, "budget": 1, "poses": EXO.pose(0.0)}
        if error is None:
            assert searched(**given).start is not None
            continue
        with pytest.raises(InvalidInput, match=error):
            searched(**given)
