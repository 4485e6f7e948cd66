"""The least shoulder force within bounds, against exhaustive answers and by its own meaning."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import (
    DEGREES,
    MECHANISMS,
    PERSON,
    exo_of,
    random_mechanism,
    regular_poses,
    zero_of_abduction,
)

import exo_pin as ep
from exo_pin.numerics import least_force


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def exhaustive(constant, effect, lower, upper):
    """Least |c + G z| by trying every active set."""
    best = np.inf
    for pattern in itertools.product((-1, 0, 1), repeat=effect.shape[1]):
        pattern = np.array(pattern)
        z = np.where(pattern < 0, lower, np.where(pattern > 0, upper, 0.0))
        if not np.isfinite(z).all():
            continue
        free = pattern == 0
        if free.any():
            rest = constant + effect[:, ~free] @ z[~free]
            z[free] = np.linalg.lstsq(effect[:, free], -rest, rcond=None)[0]
        if (z < lower - 1e-12).any() or (z > upper + 1e-12).any():
            continue
        best = min(best, float(np.linalg.norm(constant + effect @ z)))
    return best


@pytest.mark.parametrize("count", [150, pytest.param(1000, marks=pytest.mark.full)])
def test_least_force_equals_an_exhaustive_answer(count):
    rng = np.random.default_rng(30)
    for case in range(count):
        m = int(rng.integers(1, 6))
        effect = rng.normal(size=(3, m))
        effect /= np.linalg.norm(effect, axis=0)
        if case % 5 == 0 and m >= 3:
            # Three side forces that nearly, or quite, fail to span space.
            effect[:, 2] = effect[:, :2] @ rng.normal(size=2) + 10 ** rng.uniform(-16, -1) * rng.normal(size=3)
        constant = rng.normal(size=3) * 10 ** rng.uniform(-1, 3)
        reach = np.abs(rng.normal(size=m)) * 20
        lower, upper = -reach, reach * rng.uniform(0, 2, size=m)
        if case % 7 == 0:
            upper[0] = np.inf
        answer = least_force(constant, effect, lower, upper)
        assert answer.residual <= 1e-8
        assert (answer.variables >= lower).all()
        assert (answer.variables <= upper).all()
        np.testing.assert_allclose(constant + effect @ answer.variables, answer.force, atol=1e-9)
        best = exhaustive(constant, effect, lower, upper)
        assert abs(np.linalg.norm(answer.force) - best) <= 1e-8 * np.linalg.norm(constant)


def test_minimal_with_bounds_equals_an_exhaustive_answer(prototype):
    rng = np.random.default_rng(31)
    exo = prototype.worn_by(PERSON)
    poses = regular_poses(exo.mechanism, rng, 300)
    lower = -60 * rng.random((300, 3))
    upper = 60 * rng.random((300, 3))
    answer = exo.reaction(poses, split="minimal", constraint_bounds=(lower, upper), limits="none")
    assert (answer.constraint_forces >= lower).all()
    assert (answer.constraint_forces <= upper).all()
    state = exo.inverse_kinematics(poses)
    for k in range(300):
        best = exhaustive(answer.spherical_force[k], state.normals[k].T, lower[k], upper[k])
        assert abs(answer.magnitude[k] - best) <= 1e-8 * np.linalg.norm(answer.spherical_force[k])


def test_actuator_bound(prototype):
    exo = prototype.worn_by(PERSON)
    poses = regular_poses(exo.mechanism, np.random.default_rng(32), 50)
    answer = exo.reaction(poses, split="minimal", constraint_bounds="actuator", limits="none")
    assert (np.abs(answer.constraint_forces) <= np.abs(answer.actuator_forces) * (1 + 1e-12)).all()
    assert (answer.ratio <= 1 + 1e-12).all()
    assert answer.ratio.min() < 0.9
    assert not answer.trivial


def test_unbounded_minimum_is_zero_and_says_that_it_is_trivial(prototype):
    poses = regular_poses(prototype.mechanism, np.random.default_rng(33), 100, margin=1e-3)
    answer = prototype.reaction(poses, split="minimal", limits="none")
    assert answer.magnitude.max() <= 1e-9 * prototype.arm.mass * 9.81
    assert answer.trivial
    assert "trivial" in str(answer)
    infinite = prototype.reaction(poses[:3], split="minimal", constraint_bounds=(-np.inf, np.inf), limits="none")
    assert infinite.trivial
    mixed = exo_of(MECHANISMS["random-3-mixed"]()).reaction(Rotation.identity(), split="minimal")
    assert not mixed.trivial
    assert mixed.magnitude > 1.0
    assert mixed.constraint_forces[[0, 2]].tolist() == [0, 0]


def test_more_limbs_lower_the_shoulder_force():
    mechanism = MECHANISMS["random-5"]().replace(limbs=(ep.Limb("SPS"),) * 5)
    poses = regular_poses(mechanism, np.random.default_rng(34), 30)
    exo = exo_of(mechanism)
    spherical, minimal = exo.reaction(poses), exo.reaction(poses, split="minimal")
    assert (minimal.magnitude < spherical.magnitude).all()
    # Optimal: what is left stands across everything that two self-stresses can do.
    J, state = exo.jacobian(poses), exo.inverse_kinematics(poses)
    for k in range(len(poses)):
        stress = np.linalg.svd(J[k].T)[2][3:].T
        np.testing.assert_allclose(stress.T @ state.directions[k] @ minimal.shoulder_force[k], 0, atol=1e-7)
        np.testing.assert_allclose(J[k].T @ (minimal.actuator_forces[k] - spherical.actuator_forces[k]), 0, atol=1e-9)


@pytest.mark.parametrize(
    ("kinds", "trivial"),
    [(["SPS"] * 6, True), (["UPU"] + ["SPS"] * 4, True), (["UPU", "UPU", "SPS"], False), (["SPS"] * 5, False)],
)
def test_trivial_minimum_is_judged_by_what_is_free(kinds, trivial):
    exo = exo_of(random_mechanism(np.random.default_rng(64), len(kinds), kinds))
    answer = exo.reaction(regular_poses(exo.mechanism, np.random.default_rng(65), 5, margin=0.05), split="minimal")
    assert answer.trivial is trivial
    assert bool(answer.magnitude.max() < 1e-7) is trivial


def test_bounds_of_any_size_keep_their_digits():
    rng = np.random.default_rng(68)
    for _ in range(300):
        effect = rng.normal(size=(3, 3))
        effect /= np.linalg.norm(effect, axis=0)
        constant = rng.normal(size=3) * 100
        reach = np.array([20.0, 20.0, 20.0])
        reach[rng.integers(3)] = 10.0 ** rng.uniform(2, 15)
        answer = least_force(constant, effect, -reach, reach)
        best = exhaustive(constant, effect, -reach, reach)
        assert abs(np.linalg.norm(answer.force) - best) <= 1e-8 * np.linalg.norm(constant)


def test_near_the_surface_the_unbounded_minimum_stays_small(prototype):
    zero = zero_of_abduction(prototype)
    poses = ep.shoulder_rotation(0, zero + np.array([1e-3, 1e-4, 1e-5]), 0, **DEGREES)
    answer = prototype.reaction(poses, split="minimal", limits="none")
    assert (answer.equilibrium_status == "near_singular").all()
    # It is zero to the rounding of the side forces, which are huge there and must cancel.
    assert (answer.magnitude < 1e-15 * np.abs(answer.constraint_forces).max(axis=1)).all()
    assert np.abs(answer.constraint_forces).max() > 1e12
