"""Measured movements: smoothing chosen from the data against the best that any smoothing can do, noise, its effects."""

import measured_movements as measured
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case import Movement, read_movement

#: Errors of F_s beside the least over all λ: in one case and in the mean of several, away from the ends and over all
#: samples. At the ends the least is partly luck.
INSIDE, INSIDE_MEAN, ALL, ALL_MEAN = 2.8, 1.5, 4.0, 1.25
EXO = measured.exo()


def eta_error(movement, motion):
    return np.sqrt(((movement.motion.angular_acceleration - motion.angular_acceleration) ** 2).sum(axis=1).mean())


def check_cases(cases):
    ratios = []
    for seed, (rate, degrees, uneven, pace) in enumerate(cases):
        case = measured.measured_case(EXO, seed, rate, degrees, 2.0, uneven, pace)
        ratios.append((case.inside / case.least_inside, case.smooth / case.least))
        assert case.movement.noise.found == pytest.approx(np.radians(degrees), rel=0.2)
        assert case.rough > 20 * case.smooth
        assert case.smooth < 0.1 * case.size
    assert (np.max(ratios, axis=0) < [INSIDE, ALL]).all()
    assert (np.mean(ratios, axis=0) < [INSIDE_MEAN, ALL_MEAN]).all()


@pytest.mark.full
def test_force_error_is_near_the_least_of_all_smoothings():
    check_cases([(50, 0.1, True, 1.0), (100, 0.01, False, 1.5), (100, 0.1, True, 1.0), (200, 1.0, False, 1.0)])


@pytest.mark.long
def test_force_error_is_near_the_least_in_many_cases():
    check_cases(
        (rate, degrees, uneven, pace)
        for rate in (50, 100, 200, 1000)
        for degrees in (0.01, 0.1, 0.3)
        for uneven in (False, True)
        for pace in (1.0, 2.0)
    )


def test_exact_samples_are_interpolated_and_rounding_is_found_as_noise(tmp_path):
    t = np.linspace(0, 3, 301)
    poses, motion = measured.movement(t)
    exact = Movement.from_samples(t, poses)
    assert exact.noise.method == "interpolation"
    assert not exact.noise.is_relevant
    assert not exact.noise.end_effects.any()
    assert eta_error(exact, motion) < 1e-7
    # A file with angles to four decimals, in degrees: even noise of that width has this standard deviation.
    angles = np.round(ep.shoulder_angles(poses, degrees=True), 4)
    rows = "\n".join(",".join(map(repr, map(float, row))) for row in np.column_stack([t, angles]))
    (tmp_path / "rounded.csv").write_text(f"time_s,flexion_deg,abduction_deg,internal_rotation_deg\n{rows}\n")
    rounded = read_movement(tmp_path / "rounded.csv")
    assert rounded.noise.found == pytest.approx(np.radians(1e-4 / np.sqrt(12)), rel=0.3)
    interpolated = read_movement(tmp_path / "rounded.csv", smoothing=None)
    assert eta_error(rounded, motion) < 0.02 * eta_error(interpolated, motion)
    assert eta_error(rounded, motion) < 1e-3 * np.abs(motion.angular_acceleration).max()


def test_smoothing_depends_on_no_frame_and_turns_go_all_around():
    rng, t = np.random.default_rng(8), np.linspace(0, 3, 301)
    # The arm turns by three revolutions about its own axis.
    poses, motion = measured.movement(t, spin=20.0)
    samples = measured.noisy(rng, poses, np.radians(0.1))
    base, arm = Rotation.random(2, rng=rng)
    plain, turned = Movement.from_samples(t, samples), Movement.from_samples(t, base * samples * arm)
    np.testing.assert_allclose(
        turned.motion.angular_acceleration, base.apply(np.array(plain.motion.angular_acceleration)), atol=1e-6
    )
    np.testing.assert_allclose((base * plain.poses * arm * turned.poses.inv()).magnitude(), 0, atol=1e-9)
    interior = slice(30, -30)
    error = plain.motion.angular_acceleration - motion.angular_acceleration
    assert np.abs(error[interior]).max() < 0.05 * np.abs(motion.angular_acceleration).max()


def test_predicted_noise_is_that_of_many_measurements():
    """Over repeated measurements the errors away from the ends are as large as the standard deviations."""
    rng, t = np.random.default_rng(9), measured.sample_times(np.random.default_rng(9), 100, 2.0, uneven=True)
    poses, motion = measured.movement(t)
    square, predicted, forces = 0.0, 0.0, []
    for _ in range(6):
        movement = Movement.from_samples(t, measured.noisy(rng, poses, np.radians(0.1)))
        inside = ~movement.noise.end_effects
        change = movement.motion.angular_acceleration - motion.angular_acceleration
        square += (change[inside] ** 2).mean()
        predicted += (movement.noise.angular_acceleration[inside] ** 2).mean()
        forces.append(EXO.follow(movement))
    assert 0.6 < np.sqrt(square / predicted) < 1.6
    true = EXO.follow(Movement.from_samples(t, poses)).reaction.shoulder_force
    error = np.array([np.linalg.norm(answer.reaction.shoulder_force - true, axis=1) for answer in forces])
    noise = np.array([answer.force_noise for answer in forces])
    known = np.isfinite(noise).all(axis=0) & ~np.any([f.movement.noise.end_effects for f in forces], axis=0)
    assert known.sum() > 5
    ratio = np.sqrt((error[:, known] ** 2).mean() / (noise[:, known] ** 2).mean())
    assert 0.5 < ratio < 2.0


def test_end_effects_are_marked_where_errors_are_large():
    rng, t = np.random.default_rng(10), np.linspace(0, 3, 301)
    poses, motion = measured.movement(t)
    movement = Movement.from_samples(t, measured.noisy(rng, poses, np.radians(0.1)))
    ends = movement.noise.end_effects
    assert ends[[0, -1]].all()
    assert ends.mean() < 0.5
    error = np.linalg.norm(movement.motion.angular_acceleration - motion.angular_acceleration, axis=1)
    assert np.sqrt((error[ends] ** 2).mean()) > 2 * np.sqrt((error[~ends] ** 2).mean())
    # A gap longer than half a period of the cutoff has two ends of its own.
    cut = (t < 1.2) | (t > 1.8)
    gap = Movement.from_samples(t[cut], measured.noisy(rng, poses[cut], np.radians(0.1))).noise.end_effects
    assert gap[[int((t < 1.2).sum()) - 1, int((t < 1.2).sum())]].all()


@pytest.mark.parametrize(
    ("noise", "rate"),
    [
        (0.01, 100),
        (0.3, 50),
        pytest.param(0.3, 1000, marks=pytest.mark.full),
        pytest.param(1.0, 200, marks=pytest.mark.full),
    ],
)
def test_ends_at_rest(noise, rate):
    """Knowledge that the arm rests at the ends takes most of the error there away, and the noise is found as before."""
    exo = EXO
    errors, movements = zip(*(measured.end_errors(exo, seed, rate, noise) for seed in range(4)), strict=True)
    (free, near), (rest, there) = np.median(errors, axis=0)
    assert rest < 0.5 * free
    assert there < 0.4 * near
    for loose, held in movements:
        assert held.noise.found == pytest.approx(np.radians(noise), rel=0.15)
        assert loose.noise.end_effects.any()
        assert not held.noise.end_effects.any()
        ends = [0, -1]
        speed = np.abs(held.motion.angular_velocity)
        assert speed[ends].max() < 1e-4 * speed.max()
        change = np.abs(held.motion.angular_acceleration)
        assert change[ends].max() < 1e-3 * change.max()
        # The posterior deviation is honest there, too: zero where the arm is known to rest.
        assert held.noise.angular_acceleration[ends].max() < 0.1 * loose.noise.angular_acceleration[ends].max()
