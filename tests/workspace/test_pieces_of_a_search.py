"""What a search is made of, piece by piece: merit, windows of strokes, runs, ranking, words."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.workspace import CRITERIA, Criteria, starting_design
from exo_pin.workspace.optimisation.descent import GENERATION, Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Evaluation, Merit, check_objectives, judged
from exo_pin.workspace.optimisation.optimise import _weights
from exo_pin.workspace.optimisation.optimised import Candidate, Optimised
from exo_pin.workspace.optimisation.ranking import reported
from exo_pin.workspace.optimisation.stored_study import SearchRun
from exo_pin.workspace.optimisation.stroke_fitting import fitted_strokes, stroke_windows, window_margin

NAN = np.nan
ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")


def sketch(actuator=None, count=3):
    return starting_design(actuator or ep.Actuator("cable", pull_limit=400.0), ARM, count)


def test_merit_and_objectives_of_four_poses():
    share = np.array([0.4, 0.3, 0.2, 0.1])
    limits = Criteria(largest_shoulder_force=200.0)
    margins = {
        "singularity": np.array([0.07, 0.01, -0.10, NAN]),  # aim 0.03, scale 0.08, most 2
        "forces": np.array([3.0, 0.5, -20.0, NAN]),  # aim 1, scale 5
        "shoulder_force": np.array([150.0, 180.0, NAN, -300.0]),  # scale 200, most 1
    }
    force = np.array([50.0, 20.0, NAN, 500.0])
    broken = [0.0, 0.02 / 0.08 + 0.5 / 5.0, 0.13 / 0.08 + 2.0 + 1.0, 2.0 + 2.0 + 1.0]
    plain = share @ (broken + 0.3 * np.array([0.0, 0.0, 1.0, 1.0]))
    others = {"contact_force": 300.0, "device_mass": 1.5}

    def merit(**weights):
        return judged(margins, force, share, limits, others, weights)

    found = merit()
    assert found.merit == pytest.approx(plain)
    assert found.objectives == pytest.approx(
        {
            "index": 0.7,
            "mean_shoulder_force": (0.4 * 50.0 + 0.3 * 20.0) / 0.7,
            "peak_shoulder_force": 50.0,
            "median_moment_margin": 1.75,
            "worst_margin": 0.1,
            **others,
        }
    )
    # Forces of more than 100 N, and those that are not known, count 100 N; 100 N, 10 N m and 1 kg count as one.
    carried = 0.4 * 50.0 + 0.3 * 20.0 + 0.3 * 100.0
    costs = {
        "mean_shoulder_force": carried / 100.0,
        "peak_shoulder_force": 0.5,
        "median_moment_margin": -0.175,
        "worst_margin": -0.1,
        "contact_force": 3.0,
        "device_mass": 1.5,
    }
    for name, cost in costs.items():
        assert merit(**{name: 0.5}).merit == pytest.approx(plain + 0.5 * cost)
    assert merit(**dict.fromkeys(costs, 2.0)).merit == pytest.approx(plain + 2.0 * sum(costs.values()))


def test_merit_without_a_pose_inside():
    margins = {"singularity": np.array([-0.01, -0.5])}
    found = judged(
        margins, np.full(2, NAN), np.array([0.5, 0.5]), Criteria(), {"contact_force": NAN, "device_mass": 0.0}, {}
    )
    assert found.objectives["index"] == 0.0
    for name in ("mean_shoulder_force", "peak_shoulder_force", "median_moment_margin", "worst_margin"):
        assert np.isnan(found.objectives[name])
    plain = 0.5 * (0.5 + 2.0) + 0.3
    assert found.merit == pytest.approx(plain)
    # What is not known costs as much as 2 kN, and nothing where more is better.
    for name, cost in (
        ("peak_shoulder_force", 20.0),
        ("contact_force", 20.0),
        ("worst_margin", 0.0),
        ("median_moment_margin", 0.0),
    ):
        again = judged(
            margins,
            np.full(2, NAN),
            np.array([0.5, 0.5]),
            Criteria(),
            {"contact_force": NAN, "device_mass": 0.0},
            {name: 1.0},
        )
        assert again.merit == pytest.approx(plain + cost)
    assert check_objectives("index") == ("index",)


def windows_by_scan(family, travel, lengths, weights):
    """The longest length of least shortfall, of the quantiles."""
    share, least = {"pneumatic muscle": (0.75, 0.04), "linear": (0.5, 0.1), "cable": (0.0, 0.03)}[family]
    best = None
    for quantile in (1.0, 0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5):
        end = sorted(lengths)[round(quantile * (len(lengths) - 1))]
        begin = max(share * end + (1.0 - share) * least, min(lengths), -np.inf if travel is None else end - travel)
        cost = 0.0
        for length, weight in zip(lengths, weights, strict=True):
            out = max(begin - length, length - end, 0.0)
            cost += weight * (min(out, 0.1) / 0.1 + (out > 0.0))
        if best is None or cost < best[0] - 1e-12:
            best = cost, begin, max(end, begin)
    return best[1:]


@pytest.mark.parametrize("travel", [None, 0.08])
@pytest.mark.parametrize("family", ["pneumatic muscle", "linear", "cable"])
def test_windows_are_those_of_a_scan(family, travel):
    push = 400.0 if family == "linear" else None
    mechanism = sketch(ep.Actuator(family, pull_limit=400.0, push_limit=push, travel_limit=travel))
    rng = np.random.default_rng(5)
    lengths = rng.uniform([0.3, 0.2, 0.12], [0.42, 0.5, 0.16], (40, 3)) + 0.02 * rng.standard_exponential((40, 3))
    weights = rng.dirichlet(np.ones(40))
    found = stroke_windows(mechanism, lengths, weights)
    expected = [windows_by_scan(family, travel, column.tolist(), weights) for column in lengths.T]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    margin = [min(min(x - lo, hi - x) for x, (lo, hi) in zip(row, found, strict=True)) for row in lengths]
    np.testing.assert_allclose(window_margin(found, lengths), margin)
    # The fitted strokes take these windows, and a limb whose stroke is given keeps it.
    fitted = fitted_strokes(mechanism, lengths, weights, is_given=[False, True, False])
    assert fitted.limbs[1].stroke is mechanism.limbs[1].stroke
    for limb, (short, long) in zip(np.array(fitted.limbs, dtype=object)[[0, 2]], found[[0, 2]], strict=True):
        ends = limb.length_range
        assert ends[1] == pytest.approx(long)
        assert ends[0] <= short + 1e-9
        assert travel is None or ends[1] - ends[0] <= travel + 1e-9
    bare = mechanism.replace(limbs=[ep.Limb("SPS")] * 3)
    with pytest.raises(MissingData, match="actuator of limb 1"):
        stroke_windows(bare, lengths, weights)


def bowl(at):
    """A merit that is least, 0, at one share of the range of each of three variables."""
    space = DesignVariables(
        sketch(), {"A[1].radius": (0.1, 0.3), "A[1].elevation": (-1.0, 1.0), "B[1].drop": (0.1, 0.2)}
    )
    low, high = space.bounds.T
    asked = []

    def generation(points, weights):
        asked.extend(points)
        shares = [(np.array(list(space.values(point).values())) - low) / (high - low) for point in points]
        return [float(((share - at) ** 2).sum()) for share in shares]

    return SimpleNamespace(variables=space, generation=generation), asked


def test_a_run_keeps_its_best_and_counts():
    pytest.importorskip("cmaes", reason="needs the extra optimise: pip install '.[optimise]'")
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


def judged_design(index, merit=1.0, force=10.0):
    return Evaluation(merit, {"index": index, "mean_shoulder_force": force})


def test_which_designs_are_reported():
    designs = [
        judged_design(0.5, 3.0, 9.0),
        judged_design(0.7, 2.0, 9.0),
        judged_design(0.7, 1.0, 5.0),
        judged_design(0.9, 4.0, 20.0),
    ]
    assert reported(designs, ("index",), False) == [3]
    assert reported(designs[:3], ("index",), False) == [2]
    assert reported(designs, ("mean_shoulder_force",), False) == [2]
    assert reported(designs, ("index", "mean_shoulder_force"), False) == [3, 2]
    assert reported([], ("index",), False) == reported([], ("mean_shoulder_force",), True) == []
    # The start goes before a run that is as good, whatever its merit; not before a better one.
    equal = [judged_design(0.7, 2.0), judged_design(0.7, 1.0), judged_design(0.6, 2.0)]
    assert reported(equal, ("index",), True) == [0]
    assert reported(equal, ("index",), False) == [1]
    alike = [judged_design(0.7, 1.0), judged_design(0.9, 1.0)]
    assert reported(alike[::-1], ("mean_shoulder_force",), True) == [0]
    assert reported([judged_design(0.7, 2.0), *alike], ("mean_shoulder_force",), True) == [1]
    lost = [judged_design(0.0, 3.0, NAN), judged_design(0.0, 2.0, NAN)]
    assert reported(lost, ("index", "mean_shoulder_force"), False) == [1]


def test_weights_of_the_runs():
    assert _weights(("index",), 0, 5) == {"mean_shoulder_force": 0.05}
    assert _weights(("device_mass",), 0, 5) == {"device_mass": 1.0}
    several = ("index", "device_mass", "worst_margin")
    drawn = np.array([list(_weights(several, 1, number).values()) for number in range(200)])
    assert set(_weights(several, 1, 0)) == {"device_mass", "worst_margin"}
    assert 0.01 <= drawn.min() < 0.012
    assert 0.8 < drawn.max() <= 1.0
    assert np.log10(drawn).mean() == pytest.approx(-1.0, abs=0.1)
    assert _weights(several, 1, 3) == _weights(several, 1, 3) != _weights(several, 2, 3)


def candidate(number, *indices, works=True, **objectives):
    checks = tuple(SimpleNamespace(works=works, workspace=SimpleNamespace(index=index)) for index in indices)
    exo = ep.load("four-cables")
    return Candidate(exo, SearchRun(number, [0.5], 0.1, {}, 24), checks, {"index": min(indices), **objectives})


def test_words_of_what_was_found():
    first, second = candidate(2, 0.9, 0.8, device_mass=1.25), candidate(4, 0.85, 0.85, works=False, device_mass=0.5)
    runs = (SearchRun(2, [0.5], 0.1, {}, 48), SearchRun(4, [0.5], 0.2, {}, 24))
    names, values = ("index", "device_mass"), ({"index": 0.8}, {"index": 0.85})
    found = Optimised((first, second), runs, names, values, stopped=True)
    assert (first.index, first.check, first.works, second.works) == (0.8, first.checks[0], True, False)
    assert found.best_candidate is second
    assert found.best is second.design
    assert found.evaluations == 72
    assert found.spread == (0.8, 0.85)
    lines = str(found).splitlines()
    assert lines[:3] == [
        "2 runs, 72 designs evaluated, 2 reported.",
        "Inside on the full grid, over the runs: 80.0 to 85.0 %.",
        "The search was stopped by hand: this is the best so far.",
    ]
    assert "Run 2 (index 0.8, device_mass 1.25 on the full grid): the design works." in lines
    assert "Run 4 (index 0.85, device_mass 0.5 on the full grid)." in lines
    assert any(line.startswith("Moving mass besides the arm: ") for line in lines)
    start = candidate(-1, 0.8, device_mass=2.0)
    one = str(Optimised((second,), runs[1:], names, values[1:], start))
    assert one.startswith(
        "1 run, 24 designs evaluated, 1 reported.\nThe start: 80.0 % of the full grid. The best: 85.0 %.\n"
    )
    assert "device_mass: 2 of the start, 0.5 of the best." in one
    assert "stopped by hand" not in one
    kept = str(Optimised((start,), runs[1:], ("index",), values[1:], start))
    assert "The best: 80.0 %, which is the start: no run was better." in kept
    assert "The start (index 0.8 on the full grid): the design works." in kept


def test_contact_force_is_exact_in_the_best_third_of_a_generation():
    """The others get what the surrogate misses in these on average."""
    asked = []

    def evaluate(point, weights, is_exact=True):
        asked.append((float(point), is_exact))
        return Evaluation(point + (10.0 + point if is_exact else 0.0), {})

    fake = SimpleNamespace(contact=object(), evaluate=evaluate)
    points = [5.0, 1.0, 4.0, 2.0, 3.0, 6.0, 7.0]
    found = Merit.generation(fake, points, {"contact_force": 1.0})
    exact = {1.0: 12.0, 2.0: 14.0, 3.0: 16.0}
    assert found == [exact.get(point, point + 12.0) for point in points]
    assert [point for point, is_exact in asked if is_exact] == [1.0, 2.0, 3.0]
    assert Merit.generation(fake, points, {}) == [10.0 + 2.0 * point for point in points]


def test_a_design_that_cannot_be_built_is_the_worst():
    space = SimpleNamespace(values=lambda point: {}, design=lambda _: refuse())

    def refuse():
        raise InvalidInput("no such design")

    found = Merit.evaluate(SimpleNamespace(variables=space), np.zeros(1), {})
    assert found.merit == 100.0
    assert np.isnan(list(found.objectives.values())).all()
    # Worse than the worst of designs that can be built.
    assert sum(each.most for each in CRITERIA.values()) + 0.3 < found.merit
