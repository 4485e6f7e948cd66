"""None"""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, MissingData, UnknownName
from exo_pin.workspace import Criteria, free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation.descent import Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Merit
from exo_pin.workspace.optimisation.optimise import _designed
from exo_pin.workspace.optimisation.ranking import FullGrid
from exo_pin.workspace.optimisation.starting_designs import joints_and_variables
from exo_pin.workspace.optimisation.stroke_fitting import fitted_strokes, stroke_windows
from exo_pin.wrist import BodyShape

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")


CABLE = ep.Actuator("cable", pull_limit=400.0)


LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))


def start(actuator=CABLE, limb_count=4, side="left"):
    return starting_design(actuator, ARM if side == "left" else ARM.mirrored(), limb_count, side)


def merit(mechanism=None, criteria=LIMITS):
    mechanism = start() if mechanism is None else mechanism
    poses = lifting_poses(mechanism.side, counts=(3, 3, 2))
    return Merit(DesignVariables(mechanism, free_joints(mechanism.limb_count)), poses, criteria)


def test_stroke_window_takes_all_lengths_where_the_family_allows_it():
    lengths = np.random.default_rng(0).uniform(0.3, 0.4, (50, 4))
    weights = np.full(50, 0.02)
    windows = stroke_windows(start(), lengths, weights)
    np.testing.assert_allclose(windows, np.stack([lengths.min(axis=0), lengths.max(axis=0)], axis=-1))
    fitted = fitted_strokes(start(), lengths, weights)
    assert all(limb.stroke is not None for limb in fitted.limbs)
    # A muscle of at most 0.4 m goes down to 0.31 m; a window lower down would lose more poses at its upper end.
    muscle = start(ep.Actuator("pneumatic muscle", pull_limit=400.0))
    longest = stroke_windows(muscle, lengths, weights)[:, 1]
    assert (longest > 0.36).all()


def test_merit_falls_as_criteria_are_met():
    judge, rng = merit(), np.random.default_rng(3)
    points = rng.uniform(0.0, 1.0, (30, judge.variables.count))
    found = [judge.evaluate(point, {}) for point in points]
    shares = np.array([each.objectives["index"] for each in found])
    merits = np.array([each.merit for each in found])
    assert np.ptp(shares) > 0.1
    least = np.argsort(merits)
    assert shares[least[:5]].mean() > shares.mean() > shares[least[-10:]].mean()
    # It is the same number the second time.
    assert judge.evaluate(points[0], {}).merit == merits[0]


def test_search_needs_the_data_of_a_criterion_that_is_named():
    with pytest.raises(MissingData, match=r"no limit given \(largest_shoulder_force"):
        merit(criteria=Criteria(names=("shoulder_force",)))


@pytest.mark.full
def test_a_broken_off_run_goes_on_with_the_same_numbers():
    pytest.importorskip("cmaes")
    judge = merit()
    whole = Descent(judge, {}, (1, 0))
    whole.run(144)
    first = Descent(judge, {}, (1, 0))
    first.run(72)
    second = Descent(judge, {}, (1, 0), first.stored())
    second.run(144)
    assert second.done == whole.done == 144
    # cmaes stores its matrix without the half that symmetry gives, so to rounding.
    assert second.value == pytest.approx(whole.value, rel=1e-9)
    np.testing.assert_allclose(second.best, whole.best, rtol=1e-6, atol=1e-9)


@pytest.mark.full
def test_optimise_reports_what_pinocchio_confirms(tmp_path):
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    exo = ep.ShoulderExo.from_mechanism(start())
    options = {
        "constraints": LIMITS, "poses": lifting_poses(counts=(3, 3, 2)), "seed": 3, "run_length": 96,
        "finer_step": 20.0, "storage": tmp_path / "study.db",
    }  # fmt: skip
    found = ep.optimise(exo, free_joints(4), budget=96, **options)
    check = found.best_candidate.check
    assert check.pinocchio_poses > 0
    assert check.pinocchio_difference < 1e-6
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


def test_search_without_a_pose_inside_reports_a_design():
    """|F_s| of at most 0.1 N nowhere: mean and peak are NaN, and no run is on the front."""
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    found = ep.optimise(
        ep.ShoulderExo.from_mechanism(start()), free_joints(4), lifting_poses(counts=(2, 2, 2)),
        ["index", "mean_shoulder_force"], LIMITS.replace(largest_shoulder_force=0.1), budget=48, run_length=24,
        finer_step=45.0,
    )  # fmt: skip
    assert all(np.isnan(run.objectives["mean_shoulder_force"]) for run in found.runs)
    assert len(found.front) == 1
    assert found.best.workspace(20.0, LIMITS).index >= 0.0
    assert not found.best_candidate.check.works


@pytest.mark.full
def test_study_of_other_data_is_refused(tmp_path):
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    exo = ep.ShoulderExo.from_mechanism(start())
    query = {
        "exo": exo, "variables": free_joints(4), "poses": lifting_poses(counts=(3, 3, 2)), "constraints": LIMITS,
        "budget": 24, "run_length": 24, "finer_step": 45.0, "storage": tmp_path / "study.db",
    }  # fmt: skip
    ep.optimise(**query)
    changes = {
        "data of the design": {"exo": exo.worn_by(ep.Arm.from_anthropometry(1.75, 90, sex="male"))},
        "data of the poses": {"poses": lifting_poses(counts=(3, 3, 2), lifting_weight=0.9)},
        "fit_strokes": {"fit_strokes": False},
        "objectives": {"objectives": "worst_margin"},
    }
    for named, change in changes.items():
        with pytest.raises(InvalidInput, match=f"searches something else: {named}"):
            ep.optimise(**{**query, **change})


@pytest.mark.full
def test_best_of_one_objective_has_the_least_of_it():
    """Merits of runs are compared, so all runs must weigh the objective alike."""
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    found = ep.optimise(
        ep.ShoulderExo.from_mechanism(start()), free_joints(4), lifting_poses(counts=(3, 3, 2)),
        "mean_shoulder_force", LIMITS, seed=0, budget=192, run_length=48, finer_step=30.0,
    )  # fmt: skip
    full = FullGrid(LIMITS, (None,), {"mean_shoulder_force": 1.0})
    judge = merit()
    merits = [full.evaluate(_designed(judge, run, (None,))).merit for run in found.runs]
    assert len(set(merits)) == len(merits) == 4
    assert found.front[0].run.number == found.runs[int(np.argmin(merits))].number


def test_objectives_on_the_full_grid_are_those_of_the_workspace():
    exo, path = ep.load("four-cables"), ep.CentreOffset.together([0.01, 0.0, 0.0])
    values = FullGrid(LIMITS, (None, path), {}).evaluate(exo.mechanism).objectives
    both = [exo.workspace(criteria=LIMITS, centre_offset=offset) for offset in (None, path)]
    assert values["index"] == min(each.index for each in both)
    forces = np.concatenate([each.magnitude[each.inside] for each in both])
    moments = np.concatenate([each.margins["forces"][each.inside] for each in both])
    assert values["mean_shoulder_force"] == pytest.approx(forces.mean())
    assert values["peak_shoulder_force"] == forces.max() < 150.0
    assert values["median_moment_margin"] == np.median(moments)


@pytest.mark.full
@pytest.mark.parametrize("objectives", ["mean_shoulder_force", ("index", "mean_shoulder_force")])
def test_the_start_is_a_candidate_by_every_objective(objectives):
    """Numbers of the full grid decide: the start is returned unless a run is better by what was asked."""
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    exo = ep.load("four-cables")
    found = ep.optimise(
        exo, joints_and_variables(exo.mechanism, {}, True), lifting_poses(counts=(2, 2, 2)), objectives, LIMITS,
        seed=1, budget=48, run_length=24, refine=True, finer_step=45.0,
    )  # fmt: skip
    runs = [each["mean_shoulder_force"] for each in found.values]
    start = found.start.objectives
    if objectives == "mean_shoulder_force":
        full = FullGrid(LIMITS, (None,), {"mean_shoulder_force": 1.0})
        (best,) = found.front
        assert full.evaluate(best.design.mechanism).merit <= full.evaluate(exo.mechanism).merit
        return
    better = [
        force for each, force in zip(found.values, runs, strict=True)
        if each["index"] >= start["index"] and force <= start["mean_shoulder_force"]
    ]  # fmt: skip
    assert (found.start in found.front) == (not better)
    words = f"mean_shoulder_force: {start['mean_shoulder_force']:.4g} of the start"
    assert words in str(found)


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


def test_search_over_muscle_lengths_prefers_the_length_that_fits():
    """One limb whose length goes from 0.3 to 0.38 m: a muscle of 0.34 m reaches both, one of 0.2 m neither."""
    muscle = start(ep.Actuator("pneumatic muscle", pull_limit=400.0), 3)
    space = DesignVariables(muscle, {"nominal_length[1]": (0.1, 0.6)})
    judge = Merit(space, lifting_poses(counts=(3, 3, 2)), Criteria(names=("stroke",)))
    lengths = judge.lengths(muscle)[:, 0]
    good = space.point({"nominal_length[1]": float(lengths.max()) - 0.04})
    bad = space.point({"nominal_length[1]": 0.5 * float(lengths.min())})
    assert judge.evaluate(good, {}).merit < judge.evaluate(bad, {}).merit


@pytest.mark.parametrize("name", ["four-linear-actuators", "four-cables-worn", "four-muscle-cables"])
def test_bounds_of_a_refinement_hold_its_start(name):
    """Joints half a metre from the shoulder, as those of the default bounds (0.25 m) would not be."""
    mechanism = ep.load(name).mechanism
    space = DesignVariables(mechanism, joints_and_variables(mechanism, {}, refine=True))
    space.require_design_inside()
    again = space.design(space.values(space.point(space.of_design())))
    np.testing.assert_allclose(again.geometry.base_points, mechanism.geometry.base_points, atol=1e-9)
    np.testing.assert_allclose(again.geometry.platform_points, mechanism.geometry.platform_points, atol=1e-9)


def test_a_start_outside_given_bounds_is_refused():
    exo = ep.load("four-linear-actuators")
    bounds = joints_and_variables(exo.mechanism, {}, refine=True, base_radius=(0.12, 0.25))
    assert bounds["A[1].radius"] == (0.12, 0.25)
    with pytest.raises(InvalidInput, match=r"its A\[1\].radius is 0.5048"):
        ep.optimise(exo, bounds, refine=True, budget=24)


def test_limbs_with_mass_in_a_search():
    exo = ep.load("four-cables")
    rod = ep.LimbBody.rod(0.2, 0.1, 0.01)
    heavy = exo.replace(
        limbs=[ep.Limb("SPS", rod, rod, stroke=each.stroke, actuator=each.actuator) for each in exo.limbs]
    )
    poses = lifting_poses(counts=(3, 3, 2))
    weights = {"mean_shoulder_force": 1.0}
    values = []
    for design in (exo, heavy):
        space = DesignVariables(design.mechanism, free_joints(4))
        values.append(Merit(space, poses, LIMITS).evaluate(space.point(space.of_design()), weights).objectives)
    assert values[1]["mean_shoulder_force"] > values[0]["mean_shoulder_force"] + 0.5


def test_worst_margin_by_hand():
    exo = ep.load("four-cables")
    names = ("singularity", "forces", "shoulder_force", "clearance")
    limits = Criteria(names=names, largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))
    poses = lifting_poses(counts=(3, 3, 2))
    space = DesignVariables(exo.mechanism, {"A[1].radius": (0.12, 0.3)})
    found = Merit(space, poses, limits, fit_strokes=False).evaluate(space.point(space.of_design()), {})
    margins = exo.workspace(poses.poses, limits)
    inside = margins.inside
    # In units of 0.08, 5 N m, the limit of 150 N and 30 mm.
    scales = {"singularity": 0.08, "forces": 5.0, "shoulder_force": 150.0, "clearance": 0.03}
    least = min(float((margins.margins[name][inside] / scale).min()) for name, scale in scales.items())
    assert found.objectives["worst_margin"] == pytest.approx(least, rel=1e-6)


def test_spare_length_costs_no_pose():
    """A linear actuator that is at its family's limit is not made longer, for then its shortest length would rise."""
    linear = start(ep.Actuator("linear", pull_limit=400.0, push_limit=400.0), 3)
    lengths = np.tile([[0.35], [0.45], [0.60]], (1, 3))  # 0.35 = 0.60/2 + 0.1/2
    for spare in (0.0, 0.002):
        stroke = fitted_strokes(linear, lengths, np.full(3, 1 / 3), spare).limbs[0].stroke
        ends = [stroke.end_fitting + ratio * stroke.nominal_length for ratio in (stroke.shortest, stroke.longest)]
        assert ends == pytest.approx([0.35, 0.60], abs=1e-9)
    # Where there is room the spare is taken at both ends.
    shorter = np.tile([[0.45], [0.50], [0.60]], (1, 3))
    roomy = fitted_strokes(linear, shorter, np.full(3, 1 / 3), 0.002).limbs[0].stroke
    ends = [roomy.end_fitting + ratio * roomy.nominal_length for ratio in (roomy.shortest, roomy.longest)]
    assert ends == pytest.approx([0.448, 0.602], abs=1e-9)
