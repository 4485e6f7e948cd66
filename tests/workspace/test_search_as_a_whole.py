"""A search from its call to its result, with checks on the full grid that take no time."""

from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import Criteria, starting_design
from exo_pin.workspace.optimisation.descent import GENERATION
from exo_pin.workspace.optimisation.merit import Evaluation, Merit
from exo_pin.workspace.optimisation.stored_study import SearchRun
from exo_pin.workspace.optimisation.stroke_fitting import fitted_strokes

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

pytestmark = pytest.mark.usefixtures("plain")

module = import_module("exo_pin.workspace.optimisation.optimise")
ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
BOUNDS = {"A[1].radius": (0.1, 0.3), "A[2].elevation": (-1.0, 1.0)}
CENTRE = ep.CentreOffset.together([0.0, 0.004, 0.0])


def height(mechanism):
    """Of the second joint on the frame, as a share: what stands for the index here."""
    points = mechanism.geometry.base_points
    return float(0.5 + 0.5 * points[1, 2] / np.linalg.norm(points[1]))


class Grid:
    """In place of the full grid: the index is the height of a joint, the mass its first joint's distance."""

    made = []  # noqa: RUF012 - of one test

    def __init__(self, criteria, centres, weights, contact, step):
        self.made.append((criteria, centres, weights, contact))

    def evaluate(self, mechanism):
        mass = float(np.linalg.norm(mechanism.geometry.base_points[0]))
        return Evaluation(mass, {"index": height(mechanism), "device_mass": mass})


@pytest.fixture
def search(monkeypatch):
    """Searches in two variables over three poses; returns what was found, and notes bars and checks."""
    bars, checks = [], []

    def recheck(mechanism, reaction, criteria, finer, *, centre_offset, step):
        assert step == 4.0
        checks.append((mechanism, finer, centre_offset))
        return SimpleNamespace(works=True, workspace=SimpleNamespace(index=height(mechanism)))

    def track(items, what, show, total):
        bars.append((what, show, total))
        return items

    monkeypatch.setattr(Grid, "made", [])
    for name, value in {"FullGrid": Grid, "recheck": recheck, "track": track}.items():
        monkeypatch.setattr(module, name, value)
    exo = ep.ShoulderExo.from_mechanism(starting_design(ep.Actuator("cable", pull_limit=400.0), ARM, 3))

    def asked(**changes):
        given = {
            "variables": BOUNDS, "poses": exo.pose([0.0, 40.0, 80.0]), "constraints": Criteria(names=("singularity",)),
            "budget": 2 * GENERATION, "run_length": GENERATION, "fit_strokes": False, "finer_step": 30.0,
        }  # fmt: skip
        return ep.optimise(exo, **(given | changes))

    asked.exo, asked.bars, asked.checks = exo, bars, checks
    return asked


def test_the_best_of_all_runs_is_checked_and_returned(search):
    found = search(budget=3 * GENERATION, progress=True)
    assert [(run.number, run.evaluations) for run in found.runs] == [(k, GENERATION) for k in range(3)]
    assert (found.stopped, found.start, found.objectives) == (False, None, ("index",))
    # Three runs are three rows of the full grid, and the best of them is the one that is checked.
    assert len(found.values) == 3
    shares = [each["index"] for each in found.values]
    (best,) = found.front
    assert best.index == best.objectives["index"] == max(shares)
    assert best.run is found.runs[int(np.argmax(shares))]
    assert [(step, centre) for _, step, centre in search.checks] == [(30.0, None)]
    assert search.bars == [("runs", True, 3)]
    ((_, centres, weights, contact),) = Grid.made
    assert (centres, weights, contact) == ((None,), {"mean_shoulder_force": 0.05}, None)
    # The design is that of the best point of its run.
    point = np.array(best.run.point)
    radius = 0.1 + 0.2 * 0.5 * (1.0 - np.cos(np.pi * point[0]))
    assert np.linalg.norm(best.design.geometry.base_points[0]) == pytest.approx(radius)
    assert all(limb.stroke is None for limb in best.design.limbs)


def test_weights_of_the_full_grid_are_those_of_the_first_run(search):
    search(objectives=("index", "device_mass"), seed=5)
    expected = 10.0 ** np.random.default_rng((5, 0, 1)).uniform(-2.0, 0.0)
    assert Grid.made[0][2] == {"device_mass": pytest.approx(expected)}


@pytest.mark.parametrize(("budget", "length", "runs", "bar"), [(1, 24, [24], 1), (24, 10, [24], 3), (24, 48, [24], 1),
                                                               (100, 48, [48, 48], 3), (71, 48, [48], 2)])  # fmt: skip
def test_a_budget_is_used_by_whole_generations(search, budget, length, runs, bar):
    found = search(budget=budget, run_length=length)
    assert [run.evaluations for run in found.runs] == runs
    assert search.bars == [("runs", False, bar)]


def test_a_stored_search_goes_on_where_it_stands(search, monkeypatch):
    kept, opened = [], module.StoredStudy
    monkeypatch.setattr(
        module, "StoredStudy", lambda *given: kept[0] if kept else kept.append(opened(*given)) or kept[0]
    )
    first = search()
    assert search().runs == first.runs
    assert search(budget=GENERATION).runs == first.runs
    # A bar has as many steps as runs are left: none, and none below zero.
    assert [total for _, _, total in search.bars] == [2, 0, 0]
    more = search(budget=3 * GENERATION)
    assert more.runs[:2] == first.runs
    assert len(more.runs) == 3
    assert search.bars[-1][2] == 1


def stopped_after(monkeypatch, generations):
    """Ctrl-C in the generation that follows so many."""
    made, own = [], Merit.generation

    def generation(self, points, weights):
        if len(made) == generations:
            raise KeyboardInterrupt
        made.append(len(points))
        return own(self, points, weights)

    monkeypatch.setattr(Merit, "generation", generation)


@pytest.mark.parametrize(("generations", "runs"), [(1, [(0, 24)]), (2, [(0, 48)]), (3, [(0, 48), (1, 24)])])
def test_a_search_that_is_stopped_keeps_what_it_has(search, monkeypatch, generations, runs):
    stopped_after(monkeypatch, generations)
    found = search(budget=10 * GENERATION, run_length=2 * GENERATION)
    assert found.stopped
    assert [(run.number, run.evaluations) for run in found.runs] == runs[: len(found.runs)]
    assert sum(run.evaluations for run in found.runs) == generations * GENERATION
    for run in found.runs:
        assert 0.0 <= min(run.point) <= max(run.point) <= 1.0
        assert np.isfinite(run.merit)


def test_a_search_that_is_stopped_before_a_generation_has_nothing(search, monkeypatch):
    stopped_after(monkeypatch, 0)
    with pytest.raises(KeyboardInterrupt):
        search()


def test_the_start_of_a_refinement_is_a_candidate_and_no_run(search):
    """It has evaluated nothing, has the number -1, and is the design itself."""
    found = search(refine=True)
    start = found.start
    np.testing.assert_array_equal(start.design.geometry.base_points, search.exo.geometry.base_points)
    assert (start.run.number, start.run.evaluations) == (-1, 0)
    assert [run.number for run in found.runs] == [0, 1]
    assert len(found.values) == 2
    assert found.evaluations == 2 * GENERATION
    shares = [height(search.exo.mechanism), *(each["index"] for each in found.values)]
    assert found.best_candidate.index == max(shares)
    # The start and what is reported are checked, each once.
    assert len(search.checks) == (1 if shares[0] == max(shares) else 2)
    assert any(mechanism is search.exo.mechanism for mechanism, *_ in search.checks)
    # It is the point of the unit cube whose values are those of the design.
    radius = np.linalg.norm(search.exo.geometry.base_points[0])
    assert 0.1 + 0.1 * (1.0 - np.cos(np.pi * start.run.point[0])) == pytest.approx(radius)
    assert np.isfinite(start.run.merit)


def test_what_a_search_does_unless_it_is_told_otherwise(search, monkeypatch):
    """60,000 designs in runs of 12,000 from anywhere, of seed 0, with strokes that fit, on a second grid of 2°."""
    noted = {}

    def made_runs(study, merit, wanted, seed, budget, length, start, unfinished):
        noted.update(merit=merit, seed=seed, budget=budget, length=length, start=start)
        unfinished.append(SearchRun(0, [0.5] * merit.variables.count, 1.0, {"index": 0.5}, GENERATION))
        return []

    monkeypatch.setattr(module, "_made_runs", made_runs)
    monkeypatch.setattr(module, "with_strokes", lambda mechanism, *_: mechanism)
    found = ep.optimise(search.exo, BOUNDS)
    merit = noted.pop("merit")
    assert noted == {"seed": 0, "budget": 60_000, "length": 12_000, "start": None}
    assert merit.fit_strokes
    assert not merit.variables.by_geometry
    assert len(merit.poses.weights) == 7 * 6 * 6 + 20
    assert [step for _, step, _ in search.checks] == [2.0]
    assert search.bars == [("runs", False, 5)]
    assert (found.start, found.objectives) == (None, ("index",))


def test_every_centre_is_checked(search):
    found = search(centre_offset=(None, CENTRE), budget=GENERATION)
    assert [centre for *_, centre in search.checks] == [None, CENTRE]
    assert len(found.front[0].checks) == 2


def test_strokes_are_fitted_to_the_poses_of_the_search_and_of_daily_life(search, monkeypatch):
    """Half of the weight has each: the grid of every centre together, and the poses of the search."""
    from exo_pin import study

    grid = search.exo.pose([10.0, 90.0], [20.0, 100.0], [-20.0, 40.0])
    asked = []
    monkeypatch.setattr(study, "adl_box", lambda step, side: asked.append((step, side)) or grid)
    poses = search.exo.pose([0.0, 40.0, 80.0])
    (candidate,) = search(fit_strokes=True, centre_offset=(None, CENTRE), budget=GENERATION).front
    assert asked == [(4.0, "left")]
    geometry = candidate.design.geometry

    def lengths(rotations, shift):
        ends = np.einsum("kij,nj->kni", rotations.as_matrix(), geometry.platform_points + shift)
        return np.linalg.norm(ends - geometry.base_points - shift, axis=-1)

    parts = [lengths(*each) for each in ((grid, 0.0), (grid, CENTRE.base), (poses, 0.0), (poses, CENTRE.base))]
    weights = np.concatenate([np.full(4, 0.5 / 4), np.full(6, 0.5 / 6)])
    expected = fitted_strokes(candidate.design.mechanism, np.concatenate(parts), weights, 0.002)
    for one, other in zip(candidate.design.limbs, expected.limbs, strict=True):
        assert one.length_range == pytest.approx(other.length_range)


class Study:
    """A study whose runs others have for a while."""

    def __init__(self, rooms, taken):
        self.rooms, self.taken, self.finished = list(rooms), list(taken), []

    def room(self, budget, trial=None):
        return 100 if trial is not None else self.rooms.pop(0)

    def take(self, budget):
        return self.taken.pop(0)

    def finish(self, *record):
        self.finished.append(record)


def test_a_worker_waits_for_the_runs_of_others(monkeypatch):
    """It ends when there is no room, and looks again after half a second while others have all there is."""
    naps = []
    monkeypatch.setattr(module, "time", SimpleNamespace(sleep=naps.append))
    study = Study([24, 24, 1, 0], [None, None, None])
    assert list(module._made_runs(study, None, ("index",), 0, 24, 24, None, [])) == []
    assert naps == [0.5, 0.5, 0.5]
    assert study.taken == []


@pytest.mark.parametrize("done", [True, False])
def test_a_run_that_another_worker_has_taken_over_is_not_ended_here(monkeypatch, done):
    point = np.array([0.25, 0.75])

    class Run:
        def __init__(self, merit, weights, seed, state, start):
            self.best, self.done, self.seed = point, 72, seed

        def run(self, budget, store):
            self.budget = budget
            runs.append(self)
            return done

    runs, study = [], Study([24, 0], [(SimpleNamespace(number=4), "state")])
    study.watched = lambda: import_module("contextlib").nullcontext()
    monkeypatch.setattr(module, "Descent", Run)
    merit = SimpleNamespace(evaluate=lambda best, weights: Evaluation(np.float64(1.5), {"index": 0.5}))
    assert list(module._made_runs(study, merit, ("index",), 3, 240, 80, None, [])) == ([4] if done else [])
    assert [(run.seed, run.budget) for run in runs] == [((3, 4), 72)]
    assert len(study.finished) == int(done)
    if done:
        trial, *rest = study.finished[0]
        assert (trial.number, rest) == (4, [[0.25, 0.75], 1.5, {"index": 0.5}, 72])


@pytest.mark.parametrize("wrong", [0, -1, True, 24.0, "24"])
@pytest.mark.parametrize("label", ["budget", "run_length"])
def test_numbers_of_designs_are_whole_and_above_zero(search, label, wrong):
    with pytest.raises(InvalidInput, match=label):
        search(**{label: wrong})


def test_a_search_is_asked_for_something(search):
    with pytest.raises(InvalidInput, match="at least one objective"):
        search(objectives=())
