"""Searches as a whole: what they report, which studies are the same, pictures of them."""

from dataclasses import replace

import numpy as np
import pytest
from small_searches import GENERATION, searched

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName
from exo_pin.workspace import CRITERIA, Criteria, free_joints, lifting_poses, starting_design
from exo_pin.wrist import BodyShape

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")


CABLE = ep.Actuator("cable", pull_limit=400.0)


LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))


def start(actuator=CABLE, limb_count=4, side="left"):
    return starting_design(actuator, ARM if side == "left" else ARM.mirrored(), limb_count, side)


@pytest.mark.full
def test_optimise_reports_what_pinocchio_confirms(tmp_path):
    exo = ep.ShoulderExo.from_mechanism(start())
    options = {
        "constraints": LIMITS, "poses": lifting_poses(counts=(3, 3, 2)), "seed": 3, "run_length": 96,
        "finer_step": 20.0, "storage": tmp_path / "study.db",
    }  # fmt: skip
    found = ep.optimise(exo, free_joints(4), budget=96, **options)
    check = found.best_candidate.check
    assert found.best.limbs[0].stroke is not None
    assert check.workspace.index == found.best.workspace(4.0, LIMITS).index
    # The same study again: nothing is left to do.
    again = ep.optimise(exo, free_joints(4), budget=96, **options)
    assert again.evaluations == found.evaluations
    assert again.runs == found.runs
    # And from another start of Python the same numbers.
    more = ep.optimise(exo, free_joints(4), budget=96, **{**options, "storage": None})
    assert more.runs[0].point == found.runs[0].point
    with pytest.raises(InvalidInput, match="searches something else"):
        ep.optimise(exo, free_joints(4), budget=96, **{**options, "seed": 4})
    with pytest.raises(UnknownName):
        ep.optimise(exo, free_joints(4), objectives=["beauty"])


@pytest.mark.full
def test_study_of_other_data_is_refused(tmp_path):
    exo = ep.ShoulderExo.from_mechanism(start())
    query = {
        "exo": exo, "variables": free_joints(4), "poses": lifting_poses(counts=(3, 3, 2)), "constraints": LIMITS,
        "budget": 24, "run_length": 24, "finer_step": 45.0, "storage": tmp_path / "study.db",
    }  # fmt: skip
    ep.optimise(**query)
    changes = {
        "data of the design": {"exo": exo.worn_by(ep.Arm.from_anthropometry(1.75, 90, sex="male"))},
        "data of the poses": {"poses": lifting_poses(counts=(3, 2, 3))},
        "fit_strokes": {"fit_strokes": False},
        "objectives": {"objectives": "worst_margin"},
        "criteria": {"constraints": LIMITS.replace(least_gap=0.001)},
        "centre_offset": {"centre_offset": [0.0, 0.0, 0.01]},
        "start": {"refine": True},
        "run_length": {"run_length": 48},
        "variables": {"variables": free_joints(4) | {"A[1].radius": (0.1, 0.2)}},
    }
    for named, change in changes.items():
        with pytest.raises(InvalidInput, match=f"searches something else: .*{named}"):
            ep.optimise(**{**query, **change})
    # Where numbers are from, and what computers round, is the same search.
    points = exo.geometry.base_points * (1.0 + 1e-12)
    again = ep.optimise(
        **{
            **query,
            "exo": exo.replace(
                title="another", sources={"arm": "elsewhere"}, geometry=exo.geometry.replace(base_points=points)
            ),
        }
    )
    assert len(again.runs) == 1


@pytest.mark.full
def test_front_is_drawn_among_its_runs():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    found = ep.optimise(
        ep.load("four-cables"),
        free_joints(4),
        lifting_poses(counts=(2, 2, 2)),
        objectives=("index", "mean_shoulder_force"),
        constraints=LIMITS,
        budget=96,
        run_length=24,
        finer_step=30.0,
    )
    shares = [each["index"] for each in found.values]
    assert found.spread == (min(shares), max(shares))
    assert f"{100 * max(shares):.1f} %." in str(found).splitlines()[1]
    ax = found.plot().axes[0]
    runs, front = (np.array(drawn.get_xydata()) for drawn in ax.lines)
    assert len(runs) == len(found.runs) == 4
    assert sorted(front[:, 0]) == sorted(each.index for each in found.front)
    assert "mean |F_s|" in ax.get_ylabel()
    alone = ep.optimise(
        ep.load("four-cables"), free_joints(4), lifting_poses(counts=(2, 2, 2)), budget=24, finer_step=30.0
    )
    assert "merit" in alone.plot().axes[0].get_ylabel()


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("budget", "length", "runs"), [(1, 24, [24]), (24, 10, [24]), (24, 48, [24]), (100, 48, [48, 48]), (71, 48, [48])]
)
def test_a_budget_is_used_by_whole_generations(budget, length, runs):
    assert [run.evaluations for run in searched(budget=budget, run_length=length).runs] == runs


@pytest.mark.usefixtures("plain")
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


PATH = ep.CentrePath([0.0, 1.6, np.pi], [[0, 0, 0], [-0.027, -0.011, 0.024], [-0.046, -0.048, 0.054]])


def cables():
    return ep.ShoulderExo.from_mechanism(starting_design(ep.Actuator("cable", pull_limit=400.0), ARM, 4))


@pytest.mark.full
def test_result_of_a_search_is_checked_with_every_offset(tmp_path):
    options = {
        "constraints": LIMITS, "poses": lifting_poses(counts=(3, 3, 2)), "seed": 3, "budget": 96, "run_length": 96,
        "finer_step": 20.0, "storage": tmp_path / "study.db",
    }  # fmt: skip
    found = ep.optimise(cables(), free_joints(4), centre_offset=(None, PATH), **options)
    candidate = found.best_candidate
    assert [check.centre_offset for check in candidate.checks] == [None, PATH]
    still, moving = (found.best.workspace(4.0, LIMITS, centre_offset=centre).index for centre in (None, PATH))
    assert [check.workspace.index for check in candidate.checks] == [still, moving]
    assert candidate.index == min(still, moving)
    assert candidate.check is candidate.checks[0]
    assert "moves with the arm, by at most 86 mm" in str(found)
    # Cables take any length from 30 mm on, so that hardly a pose of any offset is lost to the strokes that were fitted.
    for check in candidate.checks:
        beyond = check.workspace.margins["stroke"] < 0.0
        assert beyond.mean() < 1e-3
        assert (check.workspace.lengths[beyond].min(axis=-1) < 0.03).all()
    with pytest.raises(InvalidInput, match="centre_offset"):
        ep.optimise(cables(), free_joints(4), centre_offset=PATH, **options)
