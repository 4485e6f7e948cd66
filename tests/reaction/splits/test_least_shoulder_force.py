"""The least shoulder force within bounds, against exhaustive answers and by its own meaning."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import (
    PERSON,
    random_mechanism,
    regular_poses,
)

import exo_pin as ep
from exo_pin.exo import ShoulderExo
from exo_pin.numerics import least_force
from exo_pin.reaction import SPLITS


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


class Programs(type(SPLITS["spherical"])):
    """The same split with a quadratic program for every pose."""

    name = "spherical by programs"

    def choose_within(self, poses, rows, answer):
        """Leave all poses to the program."""
        return rows


@pytest.mark.parametrize("limbs", [3, 4, 5, 6, 7, 8])
@pytest.mark.parametrize("offset", [None, (0.01, -0.008, 0.012)])
def test_tensions_within_limits_agree_with_the_program(limbs, offset):
    rng = np.random.default_rng(100 * limbs + (offset is not None))
    exo = ShoulderExo.from_mechanism(random_mechanism(rng, n=limbs))
    poses = regular_poses(exo.mechanism, rng, 40, margin=0.05)
    free = exo.reaction(poses, centre_offset=offset)
    largest, typical = np.abs(free.actuator_forces).max(), np.quantile(np.abs(free.actuator_forces), 0.8)
    held = bound = 0
    for limit in ((0.0, np.inf), (-typical, typical), (-2.0 * largest, 2.0 * largest)):
        options = {"centre_offset": offset, "limits": limit}
        exact, program = exo.reaction(poses, **options), exo.reaction(poses, split=Programs(), **options)
        np.testing.assert_array_equal(exact.status, program.status)
        good = exact.held
        np.testing.assert_allclose(
            exact.actuator_forces[good], program.actuator_forces[good], rtol=0, atol=1e-9 * largest
        )
        f = exact.actuator_forces[good]
        assert ((limit[0] <= f) & (f <= limit[1])).all()
        assert (exact.residual[exact.has_answer] <= 1e-9).all()
        assert (exact.optimum.kkt[good] <= 1e-8).all()
        assert exact.optimum.unique[good].all()
        assert not exact.constraint_forces[good].any()
        held += good.sum()
        bound += ((f == limit[0]) | (f == limit[1])).any(axis=1).sum()
    assert held >= 40
    assert bound >= 5 or limbs == 3


def test_a_displaced_device_has_the_forces_of_least_sum_of_squares():
    rng = np.random.default_rng(4)
    for count, split in [(4, "minimal"), (5, "minimal"), (4, "standalone"), (6, "standalone")]:
        angles = rng.uniform(0.0, 5.0, count)
        geometry = ep.WristGeometry.from_circles(0.2, 0.1, 0.1, 0.15, angles, angles + rng.uniform(-1.0, 1.0, count))
        exo = ep.ShoulderExo(geometry, ep.Arm(3.0, [0.02, 0.0, -0.25]), limbs=[ep.Limb("UPU")] * count)
        found = exo.reaction(
            Rotation.random(random_state=count), split=split, centre_offset=rng.uniform(-0.02, 0.02, 3)
        )
        state = found.source.poses.state.row(0)
        balance = np.hstack([state.moment_of_f, state.moment_of_g])
        shoulder = np.hstack([state.shoulder_of_f, state.shoulder_of_g])
        # F_s = 0 can be reached in all of these: the shortest forces that balance arm and shoulder.
        rows, target = np.vstack([balance, shoulder]), np.concatenate([state.moment, -state.shoulder])
        shortest = np.linalg.lstsq(rows, target, rcond=1e-12)[0]
        forces = np.concatenate([found.actuator_forces, found.constraint_forces])
        np.testing.assert_allclose(forces, shortest, rtol=1e-8, atol=1e-8 * np.abs(shortest).max())
