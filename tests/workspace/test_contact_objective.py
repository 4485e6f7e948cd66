"""The wearer's contact force as an objective of a search."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import Criteria, lifting_poses
from exo_pin.workspace.optimisation.merit import Evaluation, Merit, study_description
from exo_pin.workspace.optimisation.search_poses import ContactObjective, DesignVariables
from exo_pin.wrist import BodyShape

pytest.importorskip("myo_sim")
pytest.importorskip("clarabel")

PERSON = ep.Person(1.75, 75.0, "male")
LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")), least_tension=5.0)
POSES = lifting_poses(counts=(3, 3, 2))


@pytest.fixture(scope="module")
def objective():
    return ContactObjective(PERSON, POSES, ep.ShoulderExo, LIMITS)


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


pytestmark = pytest.mark.usefixtures("plain")


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


def test_a_study_is_of_one_person_and_so_many_poses(objective):
    space = DesignVariables(ep.load("four-cables").mechanism, {"A[1].radius": (0.1, 0.6)})
    merit = Merit(space, POSES, LIMITS, contact=objective)
    told = study_description(merit, ("contact_force",), 0, 24, False, (None,))
    assert told["contact"] == {"person": repr(PERSON), "poses": len(objective.bare)}
