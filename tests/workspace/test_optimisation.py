import json
import subprocess
import sys
import time

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.core.errors import InvalidInput, MissingData, UnknownName
from exo_pin.workspace import BodyShape, Criteria, free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation.descent import Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Merit
from exo_pin.workspace.optimisation.stored_study import StoredStudy
from exo_pin.workspace.optimisation.stroke_fitting import fitted_strokes, stroke_windows

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
CABLE = ep.Actuator("cable", pull_limit=400.0)
LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.from_height(1.75))


def start(actuator=CABLE, limb_count=4, side="left"):
    return starting_design(actuator, ARM if side == "left" else ARM.mirrored(), limb_count, side)


def merit(mechanism=None, criteria=LIMITS):
    mechanism = start() if mechanism is None else mechanism
    poses = lifting_poses(mechanism.side, counts=(3, 3, 2))
    return Merit(DesignVariables(mechanism, free_joints(mechanism.limb_count)), poses, criteria)


def test_joints_by_hand():
    space = DesignVariables(start(limb_count=3), free_joints(3))
    values = dict.fromkeys(space.names, 0.0)
    values |= {"A[1].radius": 0.2, "A[1].azimuth": np.pi / 2, "A[1].elevation": np.pi / 6}
    values |= {"B[1].radius": 0.1, "B[1].azimuth": np.pi, "B[1].drop": 0.25}
    for i in (2, 3):
        values |= {f"A[{i}].radius": 0.2, f"A[{i}].azimuth": float(i), f"B[{i}].radius": 0.1, f"B[{i}].drop": 0.2}
    geometry = space.design(values).geometry
    np.testing.assert_allclose(geometry.base_points[0], [0.0, 0.2 * np.cos(np.pi / 6), 0.1], atol=1e-12)
    np.testing.assert_allclose(geometry.platform_points[0], [-0.1, 0.0, -0.25], atol=1e-12)
    right = DesignVariables(start(limb_count=3, side="right"), free_joints(3)).design(values).geometry
    np.testing.assert_allclose(right.base_points[:, 1], -geometry.base_points[:, 1])


def test_points_and_values_are_each_others_inverse():
    space = DesignVariables(start(), free_joints(4))
    rng = np.random.default_rng(0)
    for _ in range(5):
        values = {name: rng.uniform(*pair) for name, pair in zip(space.names, space.bounds, strict=True)}
        again = space.values(space.point(values))
        assert again == pytest.approx(values)
    outside = space.values(rng.uniform(-3.0, 3.0, space.count))
    for (low, high), value in zip(space.bounds, outside.values(), strict=True):
        assert low - 1e-12 <= value <= high + 1e-12


def test_circles_keep_their_dimensions():
    exo = ep.load("prototype")
    space = DesignVariables(exo.mechanism, {"r_A": (0.05, 0.18), "alpha[2]": (0.5, 1.0), "alpha_B[3]": (1.6, 2.1)})
    circles = space.design({"r_A": 0.1, "alpha[2]": 0.7, "alpha_B[3]": 1.8}).geometry.circles
    changed = (circles.r_A, circles.alpha_A[1], circles.alpha_B[1], circles.alpha_B[2])
    assert changed == pytest.approx((0.1, 0.7, 0.7, 1.8))
    assert circles.alpha_A[2] == exo.geometry.circles.alpha_A[2]


@pytest.mark.parametrize(
    ("bounds", "error"),
    [
        ({"A[1].height": (0.0, 1.0)}, UnknownName),
        ({"A[9].radius": (0.1, 0.2)}, InvalidInput),
        ({"r_A": (0.1, 0.2)}, InvalidInput),
        ({"A[1].radius": (0.2, 0.1)}, InvalidInput),
        ({}, InvalidInput),
    ],
)
def test_wrong_variables_are_refused(bounds, error):
    with pytest.raises(error):
        DesignVariables(start(), bounds)


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
    with pytest.raises(MissingData, match="body"):
        merit(criteria=Criteria(names=("clearance",)))


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


def test_optimise_reports_what_pinocchio_confirms(tmp_path):
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    exo = ep.ShoulderExo.from_mechanism(start())
    options = {
        "constraints": LIMITS, "poses": lifting_poses(counts=(3, 3, 2)), "seed": 3, "run_length": 480,
        "finer_step": 10.0, "storage": tmp_path / "study.db",
    }  # fmt: skip
    found = ep.optimise(exo, free_joints(4), budget=480, **options)
    check = found.best_candidate.check
    assert check.pinocchio_poses > 0
    assert check.pinocchio_difference < 1e-6
    assert found.best.limbs[0].stroke is not None
    assert check.workspace.index == found.best.workspace(4.0, LIMITS).index
    # The same study again: nothing is left to do.
    again = ep.optimise(exo, free_joints(4), budget=480, **options)
    assert again.evaluations == found.evaluations
    assert again.runs == found.runs
    # And from another start of Python the same numbers.
    more = ep.optimise(exo, free_joints(4), budget=480, **{**options, "storage": None})
    assert more.runs[0].point == found.runs[0].point
    with pytest.raises(InvalidInput, match="searches something else"):
        ep.optimise(exo, free_joints(4), budget=480, **{**options, "seed": 4})
    with pytest.raises(UnknownName):
        ep.optimise(exo, free_joints(4), objectives=["beauty"])


_WORKER = """
import sys
import exo_pin as ep
sys.path.insert(0, {tests!r})
from test_optimisation import LIMITS, start
from exo_pin.workspace import free_joints, lifting_poses
ep.optimise(
    ep.ShoulderExo.from_mechanism(start()), free_joints(4), poses=lifting_poses(counts=(3, 3, 2)), constraints=LIMITS,
    seed=1, budget=100_000, run_length=100_000, storage={path!r},
)
"""


@pytest.mark.full
def test_run_of_a_killed_worker_is_taken_up(tmp_path, monkeypatch):
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    from pathlib import Path

    from exo_pin.workspace.optimisation import stored_study

    path = str(tmp_path / "study.db")
    code = _WORKER.format(tests=str(Path(__file__).parent), path=path)
    worker = subprocess.Popen([sys.executable, "-c", code])
    try:
        states, end = set(), time.monotonic() + 240.0
        while len(states - {None}) < 2 and time.monotonic() < end and worker.poll() is None:
            time.sleep(0.5)
            states.add(_stored_state(path))
        assert len(states - {None}) >= 2
    finally:
        worker.kill()
        worker.wait()
    monkeypatch.setattr(stored_study, "STALE", 0.0)
    description = _description(path)
    study = StoredStudy(path, "study", ("index",), description)
    trial, state = study.take()
    assert trial.number == 0
    taken = Descent(merit(), {}, (1, 0), state)
    assert taken.done > 0


def _stored_state(path):
    import optuna

    try:
        study = optuna.load_study(study_name="study", storage=f"sqlite:///{path}")
        trials = study.get_trials()
    except Exception:  # not yet written
        return None
    states = [trial.user_attrs.get("state") for trial in trials]
    return next((state for state in states if state), None)


def _description(path):
    import optuna

    study = optuna.load_study(study_name="study", storage=f"sqlite:///{path}")
    return json.loads(study.user_attrs["description"])
