"""A refinement returns nothing worse than what it was given, and keeps its budget."""

from dataclasses import replace

import pytest

import exo_pin as ep
from exo_pin.workspace import CRITERIA, Criteria, free_joints, lifting_poses
from exo_pin.workspace.optimisation.search_poses import DesignVariables

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

#: The designs that are judged by all criteria that their data allow.
PRESETS = ("four-cables", "four-linear-actuators", "three-linear-actuators", "four-muscle-cables")
LIMITS = Criteria(largest_shoulder_force=150.0)
#: Bounds that hold the joints of all of them: distances from the shoulder and from the arm's axis, and drops, m.
WIDE = (0.02, 0.8), (0.0, 0.4), (-0.2, 0.5)


def refined(name, seed, budget, run_length=24):
    exo = ep.load(name)
    poses = lifting_poses(counts=(2, 2, 2))
    return optimised(exo, poses, seed, budget, run_length)


def optimised(exo, poses, seed, budget, run_length, refine=True):
    return ep.optimise(
        exo,
        free_joints(exo.mechanism.limb_count, *(WIDE if refine else ())),
        poses,
        constraints=LIMITS,
        seed=seed,
        budget=budget,
        run_length=run_length,
        refine=refine,
        finer_step=20.0,
    )


def never_worse(name, seed, budget):
    """Judged on few poses, most refinements are worse on the full grid."""
    found = refined(name, seed, budget)
    given = ep.load(name).workspace(criteria=LIMITS).index
    assert found.start.index == given
    best = found.best_candidate
    assert best.index >= given
    assert best.design.workspace(criteria=LIMITS).index == best.index
    assert f"The start: {100 * given:.1f} % of the full grid." in str(found)
    assert ("which is the start" in str(found)) == (best is found.start)
    assert found.evaluations <= max(budget, 24)
    return best is found.start


@pytest.mark.parametrize("name", PRESETS[:2])
def test_a_refinement_is_not_worse_than_its_start(name):
    never_worse(name, 1, 24)


@pytest.mark.full
def test_the_budget_is_kept_by_whole_generations():
    exo, poses = ep.load("four-cables"), lifting_poses(counts=(2, 2, 2))
    found = optimised(exo, poses, 1, 100, 60, refine=False)
    assert [run.evaluations for run in found.runs] == [48, 48]
    assert found.start is None
    assert found.best_candidate.index == max(
        candidate.design.workspace(criteria=LIMITS).index for candidate in found.front
    )


def test_a_search_that_is_stopped_by_hand_has_the_best_so_far(monkeypatch, tmp_path):
    own, calls = CRITERIA["singularity"], []

    def counted(at):
        calls.append(at)
        if len(calls) == 60:
            raise KeyboardInterrupt
        return own.margin(at)

    exo, poses = ep.load("four-cables"), lifting_poses(counts=(2, 2, 2))
    monkeypatch.setitem(CRITERIA, "singularity", replace(own, margin=counted))
    found = optimised(exo, poses, 1, 96, 96, refine=False)
    assert found.stopped
    assert "stopped by hand" in str(found)
    assert [run.evaluations for run in found.runs] == [48]
    assert found.best_candidate.design.workspace(criteria=LIMITS).index == found.best_candidate.index
    # Before the first generation there is nothing.
    calls[:] = [None] * 40
    with pytest.raises(KeyboardInterrupt):
        optimised(exo, poses, 1, 96, 96, refine=False)


def test_a_refined_design_is_within_its_bounds_and_may_be_at_them():
    design = ep.load("four-linear-actuators").mechanism
    name = "A[1].radius"
    value = DesignVariables(design, {name: (0.01, 0.9)}).of_design()[name]
    for low, high in ((value, value + 0.1), (value - 0.1, value), (value + 1e-10, 0.9), (0.01, value - 1e-10)):
        assert DesignVariables(design, {name: (low, high)}).of_design(True)[name] == pytest.approx(value, abs=1e-9)
    for low, high in ((value + 1e-4, 0.9), (0.01, value - 1e-4)):
        variables = DesignVariables(design, {name: (low, high)})
        assert variables.of_design()[name] == min(max(value, low), high)
        with pytest.raises(ep.InvalidInput, match=f"expected bounds that hold the design.* is {value:g}, outside"):
            variables.of_design(True)
