"""The two programs of the model-based controller against the reaction query and other solvers."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import tensions_for_motion

FOUR, THREE = ep.load("four-cables"), ep.load("prototype")
POSES = [FOUR.pose(flexion=f, abduction=a) for f, a in ((0, 30), (40, 20), (70, 10), (20, 70))]


@pytest.mark.parametrize("pose", POSES)
def test_possible_motion_has_the_tensions_of_the_reaction_query(pose):
    motion = ep.Motion([0.3, -0.2, 0.4], [1.0, 2.0, -1.5])
    greatest = np.full(4, 400.0)
    found = tensions_for_motion(FOUR.mechanism, pose, motion, greatest)
    assert np.linalg.norm(found.missing_moment) < 1e-9
    # Through Pinocchio and ProxSuite.
    best = FOUR.reaction(pose, motion, split="minimal", constraint_bounds=(0.0, 0.0), limits=(0.0, 400.0))
    np.testing.assert_allclose(np.linalg.norm(found.shoulder_force), best.magnitude, rtol=1e-6)
    np.testing.assert_allclose(found.tensions, best.actuator_forces, atol=1e-4)


def test_impossible_moment_is_met_as_nearly_as_by_bounded_least_squares():
    random = np.random.default_rng(8)
    for _ in range(20):
        pose = Rotation.from_rotvec(random.normal(size=3) * 0.5)
        motion = ep.Motion(random.normal(size=3), 20.0 * random.normal(size=3))
        greatest, least = random.uniform(20.0, 60.0, 3), random.uniform(0.0, 5.0, 3)
        found = tensions_for_motion(THREE.mechanism, pose, motion, greatest, least)
        assert (found.tensions >= least - 1e-12).all()
        assert (found.tensions <= greatest + 1e-12).all()
        arms = THREE.jacobian(pose).T
        moment = found.missing_moment + arms @ found.tensions
        other = lsq_linear(arms, moment, (least, greatest), method="bvls", tol=1e-14)
        np.testing.assert_allclose(found.missing_moment, moment - arms @ other.x, atol=1e-8)
        # The moment itself: Newton and Euler of the arm, by the package's other way.
        answer = THREE.reaction(pose, motion)
        if answer.has_answer:
            np.testing.assert_allclose(moment, arms @ answer.actuator_forces, atol=1e-8)
