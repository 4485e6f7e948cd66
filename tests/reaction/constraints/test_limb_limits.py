"""Limbs within limits in a query: reliefs, side forces within tensions, the mirror image."""

import numpy as np
import pytest
from sockets import following
from wrists import random_mechanism, regular_poses

import exo_pin as ep


@pytest.mark.parametrize("kind", ["tensions", "cone"])
def test_relief_is_what_one_limit_must_give(kind):
    rng, finite = np.random.default_rng(54), 0
    cone = following(muscle_compression=60.0, faces=8) if kind == "cone" else None
    question = {"split": "minimal", "constraint_bounds": 5.0, "cone": cone}
    while finite < 5:
        exo = ep.ShoulderExo.from_mechanism(random_mechanism(rng, int(rng.integers(3, 7))))
        pose = regular_poses(exo.mechanism, rng, 1, margin=0.03)[0]
        low = rng.uniform(-20.0, 20.0, exo.mechanism.limb_count)
        high = low + rng.uniform(1.0, 40.0, low.size)
        missing = exo.reaction(pose, limits=(low, high), **question).infeasibility
        if missing is None:
            continue
        scale = np.abs(exo.reaction(pose, limits="none").actuator_forces).max()
        for i in range(low.size):
            if missing.blocking[i] == 0:
                assert np.isinf(missing.relief[i])
                continue

            def held_with(give, i=i, low=low, high=high, sign=missing.blocking[i], exo=exo, pose=pose):
                one = give * (np.arange(low.size) == i)
                ends = (low - one, high) if sign < 0 else (low, high + one)
                return bool(exo.reaction(pose, limits=ends, **question).held)

            if np.isinf(missing.relief[i]):
                assert not held_with(1e3 * scale)
                continue
            assert held_with(missing.relief[i] * (1.0 + 1e-6) + 1e-6 * scale)
            if 1e-2 * scale < missing.relief[i] < 1e3 * scale:
                finite += 1
                assert not held_with(missing.relief[i] * (1.0 - 1e-3))


def test_side_forces_within_chosen_tensions():
    """|g_i| <= |f_i| with more than three limbs is convex once they only pull."""
    mechanism = random_mechanism(np.random.default_rng(63), 5)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    poses = regular_poses(mechanism, np.random.default_rng(64), 150)
    with pytest.raises(ep.NonConvexBound, match="pull"):
        exo.reaction(poses, split="minimal", constraint_bounds="actuator")
    answer = exo.reaction(poses, split="minimal", constraint_bounds="actuator", limits="pull")
    held = answer.held
    assert held.sum() > 20
    excess = np.abs(answer.constraint_forces[held]) - answer.actuator_forces[held]
    assert (excess <= 1e-9 * np.abs(answer.actuator_forces[held]).max(axis=1, keepdims=True)).all()
    without = exo.reaction(poses, split="minimal", constraint_bounds=(0, 0), limits="pull")
    assert (answer.magnitude[held] <= without.magnitude[held] * (1 + 1e-9)).all()
    assert (answer.magnitude[held] < 0.9 * without.magnitude[held]).any()


@pytest.mark.parametrize("split", ["spherical", "minimal"])
@pytest.mark.full
def test_right_shoulder_with_limits_and_socket_is_the_mirror_image(split):
    from mirror_image import MIRROR, mirrored

    left = ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(67), 5, ["SPS"] * 5))
    right = left.mirrored()
    poses = regular_poses(left.mechanism, np.random.default_rng(68), 25)
    options = {
        "limits": (0, 400),
        "split": split,
        "cone": following(muscle_compression=150),
    }
    a, b = left.reaction(poses, **options), right.reaction(mirrored(poses), **options)
    np.testing.assert_array_equal(a.status, b.status)
    held = a.held
    assert 3 < held.sum() < 25
    np.testing.assert_allclose(b.actuator_forces[held], a.actuator_forces[held], atol=1e-6)
    np.testing.assert_allclose(b.shoulder_force[held], a.shoulder_force[held] @ MIRROR, atol=1e-6)
    np.testing.assert_allclose(
        b.infeasibility.missing_wrench[~held][:, :3],
        a.infeasibility.missing_wrench[~held][:, :3] @ MIRROR,
        atol=1e-6,
    )
