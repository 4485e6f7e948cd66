"""What a search makes small, of designs that it was given or has found: their margins, weighed by hand."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import BodyShape
from exo_pin.workspace import Criteria, free_joints, lifting_poses, starting_design

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


@pytest.mark.parametrize(
    "objective", ["worst_margin", "device_mass", *(
        pytest.param(name, marks=pytest.mark.full)
        for name in ("mean_shoulder_force", "peak_shoulder_force", "median_moment_margin")
    )],
)  # fmt: skip
def test_one_objective_counts_once_in_every_run(objective):
    found = searched(objective, refine=False, budget=48)
    assert len(found.runs) == 2
    check(found.best_candidate.run, found.best, {objective: 1.0})


def test_several_objectives_have_weights_of_their_own_in_every_run():
    """Drawn evenly in their logarithm from a hundredth to one, by the seed and the number of the run."""
    names = ("index", "device_mass", "worst_margin")
    found = searched(names, refine=False, budget=72, seed=5)
    for candidate in found.front:
        rng = np.random.default_rng((5, candidate.run.number, 1))
        weights = {name: 10.0 ** rng.uniform(-2.0, 0.0) for name in names[1:]}
        check(candidate.run, candidate.design, weights)
    # None of the front is beaten by another run, and whatever is not on it is.
    rows = np.array([[value["index"], -value["device_mass"], value["worst_margin"]] for value in found.values])
    beaten = [any((other >= row).all() and (other > row).any() for other in rows) for row in rows]
    front = {candidate.run.number for candidate in found.front}
    assert front == {run.number for run, lost in zip(found.runs, beaten, strict=True) if not lost}
    shares = [candidate.objectives["index"] for candidate in found.front]
    assert shares == sorted(shares, reverse=True)


def test_what_no_pose_has_counts_as_much_as_two_kilonewtons():
    """|F_s| of at most 0.1 N nowhere: mean and peak are NaN, no run is on a front, and one is reported all the same."""
    limits = LIMITS.replace(largest_shoulder_force=0.1)
    exo, none = ep.load("four-cables"), dict.fromkeys(("index", "mean_shoulder_force"))
    found = searched(tuple(none), constraints=limits, budget=48, refine=False)
    assert len(found.front) == 1
    assert not found.best_candidate.works
    for run in found.runs:
        assert run.objectives["index"] == 0.0
        assert np.isnan([run.objectives[name] for name in ("mean_shoulder_force", "worst_margin")]).all()
    alone = searched("peak_shoulder_force", constraints=limits, refine=False)
    other = searched("worst_margin", constraints=limits, refine=False)
    assert all(run.objectives["index"] == 0.0 for run in (*alone.runs, *other.runs))
    # The same designs are tried: both searches start at the same place and weigh nothing that they know.
    assert alone.runs[0].point == other.runs[0].point
    assert alone.runs[0].merit == pytest.approx(other.runs[0].merit + 20.0)
    assert exo.workspace(POSES.poses, limits).index == 0.0


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


@pytest.mark.full
def test_limbs_with_mass_in_a_search():
    exo, rod = ep.load("four-cables"), ep.LimbBody.rod(0.2, 0.1, 0.01)
    limbs = [ep.Limb("SPS", rod, rod, stroke=each.stroke, actuator=each.actuator) for each in exo.limbs]
    forces = [
        searched(exo=design).start.run.objectives["mean_shoulder_force"] for design in (exo, exo.replace(limbs=limbs))
    ]
    assert forces[1] > forces[0] + 0.5


def test_a_search_over_muscle_lengths_finds_the_length_that_fits():
    """One limb's length goes over a range of which a muscle of its middle reaches most, and others little."""
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male")
    muscle = starting_design(ep.Actuator("pneumatic muscle", pull_limit=400.0), arm, 3)
    exo = ep.ShoulderExo.from_mechanism(muscle)
    found = searched(
        exo=exo, variables={"nominal_length[1]": (0.1, 0.6)}, constraints=("stroke",), fit_strokes=True, refine=False,
        budget=48, run_length=48,
    )  # fmt: skip
    lengths, limb = exo.inverse_kinematics(POSES.poses).lengths[:, 0], found.best.limbs[0]

    def reached(times):
        stroke = replace(limb.stroke, nominal_length=times * limb.stroke.nominal_length)
        low, high = replace(limb, stroke=stroke).length_range
        return POSES.weights @ ((lengths >= low) & (lengths <= high))

    assert reached(1.0) > max(reached(0.7), reached(1.4))


def test_a_search_needs_the_data_of_a_criterion_that_is_named():
    with pytest.raises(ep.MissingData, match=r"no limit given \(largest_shoulder_force"):
        searched(variables=free_joints(4), constraints=("shoulder_force",), refine=False)


@pytest.mark.parametrize("name", ["mean_shoulder_force", "peak_shoulder_force", "median_moment_margin"])
def test_an_objective_that_the_named_criteria_leave_unknown_is_refused(name):
    with pytest.raises(ep.InvalidInput, match=f"'{name}' needs 'forces'.* got stroke, singularity"):
        searched(objectives=name, constraints=("stroke", "singularity"))


def test_what_the_contact_force_needs():
    exo, person = ep.load("four-cables"), ep.Person(1.75, 75.0, "male")
    with pytest.raises(ep.MissingData, match="person"):
        ep.optimise(exo, free_joints(4), objectives=["contact_force"], budget=24)
    rod = ep.LimbBody.rod(0.1, 0.1, 0.01)
    heavy = exo.replace(limbs=[ep.Limb("SPS", rod, rod, actuator=limb.actuator) for limb in exo.limbs])
    with pytest.raises(ep.InvalidInput, match="mass"):
        ep.optimise(heavy, free_joints(4), objectives=["contact_force"], person=person, budget=24)
    with pytest.raises(ep.InvalidInput):
        ep.optimise(exo, free_joints(4), objectives=["contact_force"], person=person.arm, budget=24)
