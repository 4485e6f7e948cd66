"""What a search makes small, of designs that it was given or has found: their margins, weighed by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import BodyShape
from exo_pin.workspace import Criteria, lifting_poses
from exo_pin.workspace.optimisation.merit import OBJECTIVES, Merit, judged
from exo_pin.workspace.optimisation.search_poses import DesignVariables, SearchPoses
from exo_pin.workspace.optimisation.starting_designs import fitted_strokes

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

LIMITS = Criteria(
    names=("singularity", "forces", "shoulder_force", "clearance"), largest_shoulder_force=150.0,
    body=BodyShape.of(ep.Wearer(1.75, 75, "male")),
)  # fmt: skip
#: Of each criterion: what counts as one, from where on it counts as met, and the most that it counts.
COUNTS = {
    "singularity": (0.08, 0.03, 2.0), "forces": (5.0, 1.0, 2.0), "shoulder_force": (150.0, 0.0, 1.0),
    "clearance": (0.03, 0.003, 2.0),
}  # fmt: skip
POSES = lifting_poses(counts=(3, 3, 2))


def searched(objectives="index", exo=None, **changes):
    """A search of one generation from a design, whose strokes stay as they are."""
    given = {
        "variables": {"A[1].radius": (0.1, 0.6), "B[2].drop": (0.05, 0.4)}, "poses": POSES, "constraints": LIMITS,
        "budget": 24, "run_length": 24, "fit_strokes": False, "refine": True, "finer_step": 45.0,
    }  # fmt: skip
    exo = ep.load("four-cables") if exo is None else exo
    return ep.optimise(exo, objectives=objectives, **(given | changes))


def merit_by_hand(found, share):
    """How far the poses are from meeting all criteria, weighed by their shares, and the objectives in these poses."""
    broken, units = 0.0, []
    for name, margin in found.margins.items():
        scale, aim, most = COUNTS[name]
        own = np.clip((aim - margin) / scale, 0.0, most)
        broken = broken + np.where(np.isnan(margin), most, own)
        units.append(margin / scale)
    inside, force = found.inside, found.magnitude
    held = share * inside
    objectives = {
        "index": held.sum(),
        "mean_shoulder_force": np.sum(held[inside] * force[inside]) / held.sum(),
        "peak_shoulder_force": force[inside].max(),
        "median_moment_margin": np.median(found.margins["forces"][inside]),
        "worst_margin": np.min(units, axis=0)[inside].min(),
    }
    carried = share @ np.where(np.isnan(force), 100.0, np.minimum(force, 100.0))
    return float(share @ (broken + 0.3 * ~inside)), objectives, carried


def costs(objectives, carried):
    """100 N, 10 N m and 1 kg count as one; forces that are not known count 100 N."""
    return {
        "mean_shoulder_force": carried / 100.0,
        "peak_shoulder_force": objectives["peak_shoulder_force"] / 100.0,
        "median_moment_margin": -objectives["median_moment_margin"] / 10.0,
        "worst_margin": -objectives["worst_margin"],
    }


def check(run, design, weights):
    merit, objectives, carried = merit_by_hand(design.workspace(POSES.poses, LIMITS), POSES.weights)
    for name, value in objectives.items():
        assert run.objectives[name] == pytest.approx(value, rel=1e-6), name
    known = costs(objectives, carried) | {"device_mass": run.objectives["device_mass"]}
    more = sum(weight * known[name] for name, weight in weights.items())
    assert run.merit == pytest.approx(merit + more, rel=1e-6)
    return objectives


def test_merit_and_objectives_of_the_start_and_of_the_best_design():
    """The start counts by its coverage alone; a search for coverage also counts a little of the force."""
    exo = ep.load("four-cables")
    found = searched(exo=exo, seed=1, refine=True)
    before = check(found.start.run, exo, {})
    assert 0.3 < before["index"] < 1.0
    assert 0.0 < before["worst_margin"] < 0.2
    again = searched(seed=4, refine=False)
    check(again.best_candidate.run, again.best, {"mean_shoulder_force": 0.05})
    assert again.start is None


def test_objectives_are_of_the_poses_inside_by_their_weights():
    """A force that is not known counts in none of them."""
    margins = {"forces": np.array([3.0, 1.0, 9.0, -2.0]), "stroke": np.array([0.01, 0.02, 0.03, 0.9])}
    force, share = np.array([10.0, 30.0, np.nan, 90.0]), np.array([0.4, 0.2, 0.1, 0.3])
    found = judged(margins, force, share, Criteria(), {}, {}).objectives
    assert found["index"] == pytest.approx(0.7)
    assert found["mean_shoulder_force"] == pytest.approx((0.4 * 10.0 + 0.2 * 30.0) / 0.6)
    assert found["peak_shoulder_force"] == 30.0
    assert found["median_moment_margin"] == 3.0
    assert found["worst_margin"] == pytest.approx(0.2)
    none = judged(margins, np.full(4, np.nan), share, Criteria(), {}, {}).objectives
    assert np.isnan([none["mean_shoulder_force"], none["peak_shoulder_force"]]).all()


def test_what_is_not_known_is_no_gain_or_a_force_that_nobody_bears():
    nothing = dict.fromkeys(OBJECTIVES, np.nan)
    cost = {
        name: judged({"stroke": np.array([-1.0])}, np.array([np.nan]), np.ones(1), Criteria(), nothing, weights).merit
        for name, weights in [("", {}), *((name, {name: 1.0}) for name in OBJECTIVES)]
    }
    more = {name: value - cost[""] for name, value in cost.items() if value != cost[""]}
    # Of |F_s| 100 N count over all poses; the others as 2,000 of their units.
    assert more == {"mean_shoulder_force": 1.0, **dict.fromkeys(("peak_shoulder_force", "contact_force"), 20.0),
                    "device_mass": 2000.0}  # fmt: skip


def linear():
    return ep.load("four-linear-actuators").mechanism


def muscles():
    """Four that pull, by the law and with the strokes of the prototype."""
    own, cables = ep.load("prototype").limbs[0], ep.load("four-cables").mechanism
    return cables.replace(limbs=[replace(each, actuator=own.actuator, stroke=own.stroke) for each in cables.limbs])


@pytest.mark.parametrize("made", [linear, muscles])
@pytest.mark.parametrize("rule", ["each", "not all short"])
def test_a_design_counts_as_it_is_with_the_strokes_that_fit(made, rule):
    """By the rule that is asked, also where no force depends on the stroke; and its contact force is that of it."""
    limits, point = Criteria(names=("forces", "stroke"), stroke_rule=rule), np.array([0.3])
    contact = SimpleNamespace(exact=lambda design: 30.0, surrogate=lambda design: design.geometry.base_points.sum())

    def merit(design, **more):
        return Merit(DesignVariables(design, {"A[1].radius": (0.1, 0.2)}), POSES, limits, **more)

    free = merit(made(), contact=contact)
    design = free.variables.design(free.variables.values(point))
    fitted = merit(fitted_strokes(design, free.lengths(design), POSES.weights), fit_strokes=False)
    found, again = free.evaluate(point, {}, is_exact=False), fitted.evaluate(point, {})
    assert found.merit == pytest.approx(again.merit, rel=1e-9)
    for each in ("index", "worst_margin"):
        assert found.objectives[each] == pytest.approx(again.objectives[each], rel=1e-9, nan_ok=True)
    assert found.objectives["contact_force"] == design.geometry.base_points.sum()
    assert free.evaluate(point, {}).objectives["contact_force"] == 30.0
    assert np.isnan(again.objectives["contact_force"])


def test_objectives_on_the_full_grid_are_those_of_the_workspace():
    """Every pose counts once with each offset; the index is the least of them."""
    exo, path = ep.load("four-cables"), ep.CentreOffset.together([0.01, 0.0, 0.0])
    values = searched(exo=exo, centre_offset=(None, path)).start.objectives
    both = [exo.workspace(criteria=LIMITS, centre_offset=offset) for offset in (None, path)]
    assert values["index"] == min(each.index for each in both)
    forces = np.concatenate([each.magnitude[each.inside] for each in both])
    moments = np.concatenate([each.margins["forces"][each.inside] for each in both])
    assert values["mean_shoulder_force"] == pytest.approx(forces.mean())
    assert values["peak_shoulder_force"] == forces.max() < 150.0
    assert values["median_moment_margin"] == np.median(moments)


@pytest.mark.parametrize("weights", [[1.0, -0.1], [0.0, 0.0], [1.0], [1.0, 1.0, 1.0], [[1.0, 1.0]], [1.0, np.nan]])
def test_poses_of_a_search_have_a_weight_each(weights):
    poses = POSES.poses[:2]
    assert SearchPoses(poses, [3.0, 1.0]).weights.tolist() == [0.75, 0.25]
    with pytest.raises(ep.InvalidInput, match="weight"):
        SearchPoses(poses, weights)
