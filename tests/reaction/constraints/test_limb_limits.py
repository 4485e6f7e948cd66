"""Limbs within limits in a query: verdicts, weights, mirror images, actuators."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sockets import following
from wrists import map_of, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import Weights
from exo_pin.wrist import holding

DEGREES = {"degrees": True}


PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.mark.parametrize("kind", ["tensions", "cone"])
def test_relief_is_what_one_limit_must_give(kind):
    rng, finite = np.random.default_rng(54), 0
    cone = following(muscle_compression=60.0, faces=8) if kind == "cone" else None
    question = {"split": "minimal", "constraint_bounds": 5.0, "cone": cone}
    while finite < 12:
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


def test_three_limbs_pull_only_agree_with_the_closed_form():
    exo = ep.load("prototype").worn_by(PERSON).replace(limbs=None)
    poses = Rotation.random(300, np.random.default_rng(56))
    answer = exo.reaction(poses, limits="pull")
    f = map_of(exo.mechanism, poses).actuator_forces
    np.testing.assert_array_equal(answer.status == "beyond_limits", (f < 0).any(axis=1))
    held = answer.held
    # In poses that cannot be held, too: these are the forces that would be needed.
    np.testing.assert_allclose(answer.actuator_forces, f, rtol=1e-9)
    assert not answer.can_hold[~held].any()
    np.testing.assert_array_equal(answer.infeasibility.infeasible, ~held)
    # Tension may be what is limited as well.
    tight = exo.reaction(poses, limits=(-50, 50))
    np.testing.assert_array_equal(tight.status == "beyond_limits", (np.abs(f) > 50).any(axis=1))


@pytest.mark.parametrize("n", [3, 4, 6])
def test_exact_moment_set_agrees_with_the_program(n):
    mechanism = random_mechanism(np.random.default_rng(57 + n), n)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    poses = regular_poses(mechanism, np.random.default_rng(58), 150)
    for lower, upper in ((0.0, np.inf), (2.0, 120.0), (-np.inf, 30.0)):
        closed = holding(mechanism, poses, lower=lower, upper=upper)
        answer = exo.reaction(poses, limits=(lower, upper))
        np.testing.assert_array_equal(closed.holdable, answer.held)
        if answer.infeasibility is None:
            continue
        bad = answer.infeasibility.infeasible
        # The moment that is missing is at least the worst face's shortfall, and the reliefs are the same.
        size = np.linalg.norm(answer.infeasibility.missing_wrench[bad][:, 3:], axis=1)
        assert (size >= -closed.margin[bad] * (1 - 1e-9)).all()
        for k in np.flatnonzero(bad):
            f = answer.infeasibility.closest_actuator_forces[k]
            J = exo.jacobian(poses[int(k)])
            M = -J.T @ f  # on the arm
            y = closed.direction[k]
            # Tension's moment in the kernel's sense is b × s f, the opposite of what it puts on the arm.
            reach = np.where(J @ y > 0, upper, lower)
            gain = np.where(np.abs(J @ y) <= 1e-12, 0.0, J @ y)
            assert np.isfinite(M).all()
            assert (gain * np.where(gain == 0, 0.0, reach)).sum() < np.inf


def test_margin_is_the_moment_that_is_held_besides():
    mechanism = random_mechanism(np.random.default_rng(60), 6)
    poses = regular_poses(mechanism, np.random.default_rng(61), 60)
    closed = holding(mechanism, poses, lower=-30, upper=200)
    rng = np.random.default_rng(62)
    assert closed.holdable.sum() > 10
    for k in np.flatnonzero(closed.holdable):
        pose, margin = poses[int(k)], closed.margin[k]
        axis = rng.normal(size=(50, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        within = ep.Load(np.zeros((50, 3)), 0.999 * margin * axis)
        same = Rotation.concatenate([pose] * 50)
        assert holding(mechanism, same, load=within, lower=-30, upper=200).holdable.all()
        beyond = ep.Load([0, 0, 0], 1.001 * margin * closed.direction[k])
        assert not holding(mechanism, pose, load=beyond, lower=-30, upper=200).holdable


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


def test_weights_trade_shear_for_compression():
    mechanism = random_mechanism(np.random.default_rng(65), 6, ["SPS"] * 6)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    poses = regular_poses(mechanism, np.random.default_rng(66), 40)
    cone = following()
    plain = exo.reaction(poses, split="minimal", limits=(1, 300))
    equal = exo.reaction(poses, split="minimal", limits=(1, 300), weights=Weights(glenoid=cone))
    shear = exo.reaction(poses, split="minimal", limits=(1, 300), weights=Weights(shear=25, glenoid=cone))
    tense = exo.reaction(poses, split="minimal", limits=(1, 300), weights=Weights(tension=0.1))
    held = plain.held
    assert held.sum() > 5
    np.testing.assert_allclose(equal.shoulder_force[held], plain.shoulder_force[held], atol=1e-6)

    def sideways(answer):
        return np.linalg.norm(cone.components(answer.shoulder_force[held], pose=poses[held])[:, 1:], axis=1)

    assert (sideways(shear) <= sideways(plain) + 1e-9).all()
    assert (sideways(shear) < 0.9 * sideways(plain)).any()
    sizes = [np.linalg.norm(answer.actuator_forces[held], axis=1) for answer in (tense, plain)]
    assert (sizes[0] <= sizes[1] + 1e-9).all()
    assert tense.optimum.unique[held].all()
    # Scaling all weights alike changes nothing.
    alike = exo.reaction(poses, split="minimal", limits=(1, 300), weights=Weights(7, 7))
    np.testing.assert_allclose(alike.shoulder_force[held], plain.shoulder_force[held], atol=1e-6)


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


def test_cables_and_wrist_at_a_pose_in_one_call(capsys):
    """D.1 beside D.2: 3SPS+S and 3UPU of the same points."""
    exo = ep.load("prototype").worn_by(PERSON)
    cables = exo.replace(limbs=(ep.Limb("SPS"),) * 3)
    pose = ep.shoulder_rotation(60, 30, 0, **DEGREES)
    own, other = exo.reaction(pose), cables.reaction(pose, split="minimal")
    np.testing.assert_allclose(own.shoulder_force, other.shoulder_force, atol=1e-9)
    assert cables.reaction(pose, split="minimal").certificate.shoulder_force.all()
    bounded = exo.reaction(pose, split="minimal", constraint_bounds=(-40, 40), limits="none")
    assert bounded.magnitude < other.magnitude


def test_an_infeasible_answer_explains_itself():
    exo = ep.load("prototype").worn_by(PERSON).replace(limbs=None)
    answer = exo.reaction(ep.shoulder_rotation(30, 20, 0, **DEGREES), limits="pull")
    assert answer.status == "beyond_limits"
    text = str(answer)
    for part in ("cannot hold", "Limb 1 is at its least force, 0.0 N"):
        assert part in text.replace("\n  ", " ")
    about = re.search(r"about \(([^)]*)\)", " ".join(text.split()))[1]
    assert np.linalg.norm([float(part) for part in about.split(",")]) == pytest.approx(1.0, abs=0.01)
    assert '"blocking"' in answer.to_json()
    stack = exo.reaction(ep.shoulder_rotation([30, 84], [20, 40], 0, **DEGREES), limits="pull")
    assert "within all known limits" in str(stack)
    with pytest.raises(ep.InvalidInput, match="index of one pose"):
        stack.infeasibility.explain(5)
    with pytest.raises(ep.InvalidInput, match="one pose"):
        stack.infeasibility.explain()
    out = ep.load("prototype")
    verdict = out.reaction(out.pose([10, 40])).verdict
    assert "a limb would be too short (" in verdict
