"""What counts as one in a search, which of two designs is better, and when the contact force is exact, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import CRITERIA, Criteria
from exo_pin.workspace.optimisation import merit
from exo_pin.workspace.optimisation import search_poses as contact_objective
from exo_pin.workspace.optimisation.merit import Evaluation, Merit, check_objectives
from exo_pin.workspace.optimisation.optimised import reported

pytestmark = pytest.mark.usefixtures("plain")


@pytest.mark.parametrize("seed", range(4))
def test_poses_of_the_contact_force_are_drawn_evenly(seed):
    """At the middles of twelve equal parts of the weight; each pose once, and none of no weight."""
    weights = np.random.default_rng(seed).uniform(size=40) * (np.arange(40) % 3 > 0)
    total = np.cumsum(weights)
    expected = [int(np.flatnonzero(total >= (2 * k + 1) / 24 * total[-1])[0]) for k in range(12)]
    found = contact_objective._evenly(weights)
    assert found.tolist() == sorted(set(expected))
    assert (weights[found] > 0.0).all()
    nothing = contact_objective._evenly(np.zeros(5))
    assert (nothing.size, nothing.dtype.kind) == (0, "i")
    assert contact_objective._evenly(np.array([0.0, 2.0, 0.0])).tolist() == [1]


def test_what_counts_as_one_in_a_search():
    """Of the criteria that a search weighs: margins that miss their aim by as much as this, in their units."""
    counted = {
        "joint_angles": (0.5, "rad"), "shoulder_range": (np.inf, "rad"), "stroke": (0.05, "m"),
        "singularity": (0.08, ""), "connected": (0.08, ""), "forces": (5.0, "N m"), "socket": (100.0, "N"),
        "cuff_pull": (100.0, "N"), "cuff_slip": (0.05, "m"), "elbow": (0.05, "m"), "limb_loss": (5.0, "N m"),
        "clearance": (0.03, "m"),
    }  # fmt: skip
    # What a search of cables with a wearer weighs where no limits are given.
    asked = ("stroke", "singularity", "connected", "forces", "clearance")
    mechanism = ep.load("four-cables-worn").mechanism
    share, others = np.array([1.0]), {"contact_force": np.nan, "device_mass": 0.0}
    for name, (scale, unit) in counted.items():
        item = CRITERIA[name]
        assert item.unit == unit
        assert bool(item.missing(mechanism, Criteria(), True)) == (name not in asked)
        if np.isinf(scale):
            continue
        aims = {"joint_angles": 0.05, "singularity": 0.03, "forces": 1.0, "clearance": 0.003}
        least = aims.get(name, 0.0) - 0.5 * scale
        found = merit.judged({name: np.array([least])}, np.array([np.nan]), share, Criteria(), others, {})
        assert found.merit == pytest.approx(0.5 + 0.3 * (least < 0.0)), name
    held = Criteria(largest_shoulder_force=80.0)
    found = merit.judged({"shoulder_force": np.array([-40.0])}, np.array([120.0]), share, held, others, {})
    assert found.merit == pytest.approx(0.5 + 0.3)
    # Without a limit a newton counts as one.
    found = merit.judged({"shoulder_force": np.array([-0.5])}, np.array([1.0]), share, Criteria(), others, {})
    assert found.merit == pytest.approx(0.5 + 0.3)


@pytest.mark.parametrize("name", [name for name in merit.OBJECTIVES if name != "index"])
def test_which_of_two_designs_of_one_index_is_on_the_front(name):
    """More room for moments and a larger worst margin are better; less of forces and of mass is."""
    designs = [merit.Evaluation(1.0, {"index": 0.5, name: value}) for value in (2.0, 1.0)]
    more = name in ("median_moment_margin", "worst_margin", "weakest_rate")
    wanted = check_objectives(["index", name])
    assert reported(designs, wanted, False) == [0 if more else 1]
    better = [merit.Evaluation(1.0, {"index": index, name: 1.0}) for index in (0.5, 0.6)]
    assert reported(better, wanted, False) == [1]


def test_a_run_learns_from_its_generations():
    """Of a bowl of three variables, by whose values the next designs are drawn."""
    pytest.importorskip("cmaes", reason="needs the extra optimise")
    bowl = SimpleNamespace(
        variables=SimpleNamespace(count=3, values=np.asarray, point=np.asarray),
        generation=lambda points, weights: [float(((point - 0.3) ** 2).sum()) for point in points],
    )
    run = merit.Descent(bowl, {}, (0,))
    assert run.run(600)
    np.testing.assert_allclose(run.best, 0.3, atol=1e-3)


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
        raise ep.InvalidInput("no such design")

    found = Merit.evaluate(SimpleNamespace(variables=space), np.zeros(1), {})
    assert found.merit == 100.0
    assert np.isnan(list(found.objectives.values())).all()
    # Worse than the worst of designs that can be built.
    assert sum(each.most for each in CRITERIA.values()) + 0.3 < found.merit
