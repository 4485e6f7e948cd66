"""Movements: derivatives on rotations against an analytic motion, and histories."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import map_of

import exo_pin as ep
from exo_pin.load_case import Movement

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")
A, B = np.array([0.9, 0.0, 0.0]), np.array([0.0, 0.8, 0.3])


def analytic(t):
    """R = exp(A sin 1.3 t) exp(B cos 0.7 t), its ω and η."""
    p, dp, ddp = np.sin(1.3 * t), 1.3 * np.cos(1.3 * t), -1.69 * np.sin(1.3 * t)
    r, dr, ddr = np.cos(0.7 * t), -0.7 * np.sin(0.7 * t), -0.49 * np.cos(0.7 * t)
    first = Rotation.from_rotvec(np.outer(p, A))
    omega = np.outer(dp, A) + first.apply(np.outer(dr, B))
    eta = np.outer(ddp, A) + first.apply(np.outer(ddr, B)) + np.cross(np.outer(dp, A), first.apply(np.outer(dr, B)))
    return first * Rotation.from_rotvec(np.outer(r, B)), omega, eta


def test_derivatives_converge_to_an_analytic_motion():
    errors = []
    for count in (41, 81, 401):
        t = np.linspace(0, 4, count)
        poses, omega, eta = analytic(t)
        motion = Movement.from_samples(t, poses).motion
        errors.append((np.abs(motion.angular_velocity - omega).max(), np.abs(motion.angular_acceleration - eta).max()))
    errors = np.array(errors)
    assert (errors[-1] < [1e-9, 1e-6]).all()
    # Halving the step: seventh order for ω, sixth for η, as far as rounding lets it be seen.
    assert (errors[0] / errors[1] > [100, 50]).all()


def test_derivatives_do_not_know_euler_angles_the_sign_of_quaternions_or_even_spacing():
    rng = np.random.default_rng(80)
    t = np.sort(np.concatenate([np.linspace(0, 4, 200), rng.uniform(0, 4, 60)]))
    turned = Rotation.random(rng=rng)
    poses, omega, eta = analytic(t)
    flipped = Rotation.from_quat((turned * poses).as_quat() * rng.choice([-1, 1], size=(len(t), 1)))
    motion = Movement.from_samples(t, flipped).motion
    np.testing.assert_allclose(motion.angular_velocity, turned.apply(omega), atol=1e-6)
    np.testing.assert_allclose(motion.angular_acceleration, turned.apply(eta), atol=1e-3)
    # A constant turn through 90° of abduction, where Euler angles jump.
    sweep = Movement.from_samples(np.linspace(0, 1, 50), ep.shoulder_rotation(0, np.linspace(0, 3.1, 50), 0))
    np.testing.assert_allclose(sweep.motion.angular_velocity, np.tile([3.1, 0, 0], (50, 1)), atol=1e-9)
    np.testing.assert_allclose(sweep.motion.angular_acceleration, 0, atol=1e-6)
    short = Movement.from_samples([0, 1, 2, 3], ep.shoulder_rotation(0, [0, 0.1, 0.2, 0.3], 0))
    np.testing.assert_allclose(short.motion.angular_velocity[:, 0], 0.1, atol=1e-6)


def reach(count=60):
    t = np.linspace(0, 1.2, count)
    s = 10 * (t / 1.2) ** 3 - 15 * (t / 1.2) ** 4 + 6 * (t / 1.2) ** 5
    return t, ep.shoulder_rotation(20 + 60 * s, 15 + 20 * s, 10 * s, degrees=True)


def test_histories_along_a_movement():
    exo = ep.load("prototype").worn_by(PERSON)
    movement = Movement.from_samples(*reach())
    answer = exo.follow(movement, limits="none")
    closed = map_of(exo.mechanism, movement.poses, movement.motion)
    size = np.linalg.norm(closed.shoulder_force, axis=1)
    np.testing.assert_allclose(answer.reaction.magnitude, size, rtol=1e-8)
    assert answer.peak == pytest.approx(size.max())
    assert answer.peak_time == movement.times[size.argmax()]
    np.testing.assert_allclose(answer.impulse, np.trapezoid(size, movement.times))
    np.testing.assert_allclose(answer.rms, np.sqrt(np.trapezoid(size**2, movement.times) / 1.2))
    assert str(answer).startswith(answer.reaction.verdict)
    # Muscles cannot push, and theirs are too short or too long for parts of the reach.
    design = exo.follow(movement)
    assert design.fraction_not_holdable == (~design.reaction.held).mean() > 0.5
    np.testing.assert_allclose(design.reaction.magnitude, size, rtol=1e-8)
    slow = exo.follow(movement, static=True, limits="none")
    assert slow.peak != answer.peak
    pull = exo.follow(movement, limits="pull")
    assert not pull.reaction.held[(closed.actuator_forces < 0).any(axis=1)].any()
    assert pull.fraction_not_holdable >= (closed.actuator_forces < 0).any(axis=1).mean()
    assert "fraction not holdable" in str(pull)
    # Too weak is not singular.
    np.testing.assert_array_equal(pull.reaction.crossings(), answer.reaction.crossings())
    if pull.fraction_not_holdable == 1.0:
        assert np.isnan(pull.peak)
        assert np.isnan(pull.rms)
        assert pull.impulse == 0.0
