"""The wearer's contact force as an objective of a search."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import spearmanr

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.workspace import CRITERIA, Criteria, free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation import contact_objective
from exo_pin.workspace.optimisation.contact_objective import ContactObjective
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Evaluation, Merit
from exo_pin.workspace.pose_offsets import PoseOffsets
from exo_pin.wrist import BodyShape

pytest.importorskip("myo_sim")
pytest.importorskip("clarabel")

PERSON = ep.Person(1.75, 75.0, "male")
LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")), least_tension=5.0)
POSES = lifting_poses(counts=(3, 3, 2))


def start():
    return starting_design(ep.Actuator("cable", pull_limit=400.0), PERSON.arm, 4)


@pytest.fixture(scope="module")
def objective():
    return ContactObjective(PERSON, POSES, ep.ShoulderExo, LIMITS)


def designs(count):
    space, rng = DesignVariables(start(), free_joints(4)), np.random.default_rng(0)
    return [
        space.design({name: rng.uniform(*pair) for name, pair in zip(space.names, space.bounds, strict=True)})
        for _ in range(count)
    ]


def test_limb_forces_of_the_answer_are_within_the_limits_and_no_others_do_better(objective):
    """Against the same person with limb forces given: those of least |F_s|, and the ones of the answer."""
    exo = ep.load("four-cables").worn_by(PERSON)
    bounds = (np.full(4, 5.0), np.full(4, 400.0))
    answer = exo.joint_contact(objective.poses, PERSON, "least_contact", limits=bounds)
    assert objective.exact(exo.mechanism) == pytest.approx(answer.magnitude.mean(), rel=1e-9)
    assert answer.device_forces.min() > 5.0 - 1e-6
    tensions = exo.workspace(objective.poses, Criteria(names=("forces",), least_tension=5.0)).tensions
    held = np.isfinite(tensions).all(axis=1)
    assert held.sum() > 6
    given = exo.joint_contact(objective.poses[held], PERSON, tensions[held])
    assert (answer.magnitude[held] < given.magnitude + 1e-6).all()
    assert answer.magnitude[held].mean() < 0.3 * objective.bare[held].mean()


@pytest.mark.full
def test_contact_force_of_a_device_that_the_torso_holds():
    """The shoulder moves and the centre of the device does not: other limb forces, and another contact force."""
    path = PERSON.centre_path()
    exo = ep.load("four-cables").worn_by(PERSON)
    moving = ContactObjective(PERSON, POSES.at_centres((path,)), ep.ShoulderExo, LIMITS)
    bounds = (np.full(4, 5.0), np.full(4, 400.0))
    answer = exo.joint_contact(moving.poses, PERSON, "least_contact", limits=bounds, centre_offset=path, outside="mark")
    assert moving.exact(exo.mechanism) == pytest.approx(answer.magnitude.mean(), rel=1e-9)
    found = exo.workspace(moving.poses, Criteria(names=("forces",), least_tension=5.0), centre_offset=path)
    assert moving.surrogate(exo.mechanism) == pytest.approx(np.fmin(found.magnitude, moving.bare).mean(), rel=1e-9)
    still = ContactObjective(PERSON, POSES, ep.ShoulderExo, LIMITS)
    assert abs(still.exact(exo.mechanism) / moving.exact(exo.mechanism) - 1.0) > 0.02


@pytest.mark.full
def test_surrogate_ranks_designs_as_the_exact_force_does(objective):
    some = designs(16)
    exact = [objective.exact(each) for each in some]
    surrogate = [objective.surrogate(each) for each in some]
    assert spearmanr(exact, surrogate).statistic > 0.6


def test_generation_computes_the_best_third_exactly(objective):
    merit = Merit(DesignVariables(start(), free_joints(4)), POSES, LIMITS, contact=objective)
    points, weights = list(np.random.default_rng(1).uniform(size=(6, 24))), {"contact_force": 1.0}
    values = np.array(merit.generation(points, weights))
    exact = np.array([merit.evaluate(point, weights).merit for point in points])
    quick = np.array([merit.evaluate(point, weights, is_exact=False).merit for point in points])
    best, others = np.argsort(quick)[:2], np.argsort(quick)[2:]
    np.testing.assert_array_equal(values[best], exact[best])
    np.testing.assert_allclose(values[others], quick[others] + (exact - quick)[best].mean())


@pytest.mark.full
def test_search_for_little_contact_force():
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    found = ep.optimise(
        ep.ShoulderExo.from_mechanism(start()), free_joints(4), POSES, ["index", "contact_force"], LIMITS,
        person=PERSON, seed=0, budget=96, run_length=48, finer_step=30.0,
    )  # fmt: skip
    assert len(found.runs) == 2
    for candidate in found.front:
        force = candidate.run.objectives["contact_force"]
        objective = ContactObjective(PERSON, POSES, ep.ShoulderExo, LIMITS)
        assert force == pytest.approx(objective.exact(candidate.design.mechanism), rel=0.05)


def test_what_it_needs():
    exo = ep.load("four-cables")
    with pytest.raises(MissingData, match="person"):
        ep.optimise(exo, free_joints(4), objectives=["contact_force"], budget=24)
    rod = ep.LimbBody.rod(0.1, 0.1, 0.01)
    heavy = exo.replace(limbs=[ep.Limb("SPS", rod, rod, actuator=limb.actuator) for limb in exo.limbs])
    with pytest.raises(InvalidInput, match="mass"):
        ep.optimise(heavy, free_joints(4), objectives=["contact_force"], person=PERSON, budget=24)
    with pytest.raises(InvalidInput):
        ep.optimise(exo, free_joints(4), objectives=["contact_force"], person=PERSON.arm, budget=24)


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


def test_mean_contact_force_takes_the_bare_arm_where_it_is_better_or_nothing_is_found(monkeypatch):
    fake = SimpleNamespace(
        bare=np.array([100.0, 40.0, 80.0]), poses=None, _matrices=np.zeros((3, 3, 3)), _criteria=Criteria(),
        _offsets=PoseOffsets.none(), _person="wearer",
    )  # fmt: skip
    shoulder = np.array([[30.0, 0.0, 40.0], [0.0, 60.0, 0.0], [np.nan] * 3])
    monkeypatch.setattr(contact_objective, "values_of", lambda *_, **__: SimpleNamespace(shoulder=shoulder))
    assert ContactObjective.surrogate(fake, None) == pytest.approx((50.0 + 40.0 + 80.0) / 3.0)
    monkeypatch.setattr(contact_objective, "require_massless", lambda _: None)
    monkeypatch.setattr(contact_objective, "limb_lengths", lambda *_: None)
    monkeypatch.setattr(contact_objective, "tension_limits", lambda *_: "limits")
    found = SimpleNamespace(magnitude=np.array([70.0, 50.0, np.nan]))
    device = SimpleNamespace(accelerate=lambda _: "record")
    design = SimpleNamespace(device=device, joint_contact=lambda *_, **__: found)
    fake._kind = SimpleNamespace(from_device=lambda _: design)
    assert ContactObjective.exact(fake, None) == pytest.approx((70.0 + 50.0 + 80.0) / 3.0)
