"""The least shoulder force within bounds, against exhaustive answers and by its own meaning."""

import itertools

import numpy as np
import pytest
from wrists import (
    PERSON,
    regular_poses,
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
