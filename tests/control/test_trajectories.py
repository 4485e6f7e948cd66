"""Reference trajectories: ω and η against differences on the rotation group, ends, ranges, files, bad input."""

import pickle

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation, RotationSpline

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName, control
from exo_pin.control import AnglePath, OrientationSpline, Turn
from exo_pin.control.trajectories.paths import progress


def waypoints(rng, count, step=0.6):
    """Orientations that are up to ``step`` rad apart, from anywhere on the rotation group."""
    first = Rotation.random(rng=rng)
    turns = [Rotation.from_rotvec(v) for v in step * rng.uniform(-0.57, 0.57, (count - 1, 3))]
    poses = [first]
    for turn in turns:
        poses.append(turn * poses[-1])
    return Rotation.concatenate(poses)


def examples():
    rng = np.random.default_rng(5)
    times = np.linspace(0.0, 6.0, 14) + rng.uniform(-0.1, 0.1, 14)
    angles = np.radians(rng.uniform(-20, 120, (5, 3)))
    turn = Turn(Rotation.random(rng=rng), [1.0, -2.0, 3.5], 3.0)
    return {
        "turn": turn,
        "flexion": control.flexion(side="right"),
        "angles": AnglePath([0.0, 1.0, 2.5, 3.0, 5.0], angles, side="right"),
        "task": control.daily_task("ten-daily-tasks"),
        "spline": OrientationSpline(times, waypoints(rng, 14)),
        "two-points": OrientationSpline([0.0, 2.0], waypoints(rng, 2)),
        "free-ends": OrientationSpline(times, waypoints(rng, 14), rest=False),
    }


EXAMPLES = examples()


def inner_times(reference, step):
    """Times whose neighbours within ``step`` are on the same piece."""
    t = np.linspace(0.003, 0.997, 301) * reference.duration
    corners = [0.0]
    if isinstance(reference, AnglePath | OrientationSpline):
        corners = reference.times
    return t[np.abs(t[:, None] - np.asarray(corners)).min(axis=1) > 2 * step]


def slope(values_at, t, step):
    """Derivative by central differences of two steps, extrapolated: the error is of the fourth order."""
    return (4.0 * values_at(t, 0.5 * step) - values_at(t, step)) / 3.0


@pytest.mark.parametrize("name", EXAMPLES)
def test_angular_velocity_and_acceleration_are_the_derivatives(name):
    reference = EXAMPLES[name]
    assert isinstance(reference, control.Reference)
    t = inner_times(reference, 1e-3)
    state = reference(t)

    def turned(t, h):
        return (reference(t + h).orientation * reference(t - h).orientation.inv()).as_rotvec() / (2 * h)

    def changed(t, h):
        return (reference(t + h).angular_velocity - reference(t - h).angular_velocity) / (2 * h)

    # The fifth derivative of these curves is below 1e4 rad/s⁵: the step of 1e-3 s leaves 1e-9 rad/s; rounding 1e-12.
    np.testing.assert_allclose(state.angular_velocity, slope(turned, t, 1e-3), atol=1e-8)
    np.testing.assert_allclose(state.angular_acceleration, slope(changed, t, 1e-3), atol=1e-6)


@pytest.mark.parametrize("name", EXAMPLES)
def test_rests_before_the_start_and_after_the_end(name):
    reference = EXAMPLES[name]
    outside = reference(np.array([[-1.0, -1e-9], [reference.duration + 1e-9, 1e6]]))
    assert outside.orientation.shape == (2, 2)
    assert not outside.angular_velocity.any()
    assert not outside.angular_acceleration.any()
    assert (outside.orientation[0] * reference.start.inv()).magnitude().max() < 1e-12
    assert (outside.orientation[1] * reference.end.inv()).magnitude().max() < 1e-12
    single = reference(0.5 * reference.duration)
    assert single.orientation.shape == ()
    assert single.angular_velocity.shape == (3,)


@pytest.mark.parametrize("name", ["turn", "angles", "task", "spline", "two-points"])
def test_starts_and_ends_at_rest(name):
    reference = EXAMPLES[name]
    state = reference([0.0, reference.duration])
    np.testing.assert_allclose(state.angular_velocity, 0.0, atol=1e-10)
    np.testing.assert_allclose(state.angular_acceleration, 0.0, atol=1e-8)


@pytest.mark.parametrize("name", ["spline", "two-points", "free-ends"])
def test_spline_meets_its_waypoints_and_is_smooth_there(name):
    spline = EXAMPLES[name]
    assert (spline(spline.times).orientation * spline.poses.inv()).magnitude().max() < 1e-12
    inner = spline.times[1:-1]
    for kind in ("angular_velocity", "angular_acceleration"):
        left, right = getattr(spline(inner - 1e-9), kind), getattr(spline(inner + 1e-9), kind)
        # Continuous: in 2e-9 s the acceleration changes by its own derivative, below 1e3 rad/s³.
        np.testing.assert_allclose(left, right, atol=5e-6)


def test_spline_knows_no_frame():
    rng = np.random.default_rng(8)
    left, right = Rotation.random(2, rng=rng)
    spline = EXAMPLES["spline"]
    turned = OrientationSpline(spline.times, left * spline.poses * right)
    t = np.linspace(0.0, spline.duration, 50)
    assert (turned(t).orientation * (left * spline(t).orientation * right).inv()).magnitude().max() < 1e-12
    np.testing.assert_allclose(turned(t).angular_velocity, left.apply(spline(t).angular_velocity), atol=1e-10)


def test_splines_converge_to_the_same_curve_as_another_kind():
    t = np.linspace(0.0, 5.0, 101)
    first, second = np.outer(np.sin(1.3 * t), [0.9, 0.0, 0.0]), np.outer(np.cos(0.7 * t), [0.0, 0.8, 0.3])
    poses = Rotation.from_rotvec(first) * Rotation.from_rotvec(second)
    between = np.linspace(1.0, 4.0, 777)
    own, other = OrientationSpline(t, poses, rest=False)(between), RotationSpline(t, poses)
    assert (own.orientation * other(between).inv()).magnitude().max() < 2e-6
    # SciPy's rates are in the arm frame.
    np.testing.assert_allclose(own.orientation.inv().apply(own.angular_velocity), other(between, 1), atol=2e-4)


def test_abduction_and_flexion_are_those_of_the_thesis():
    t = np.linspace(0.0, 5.0, 11)
    np.testing.assert_allclose(
        ep.thesis_angles(control.abduction()(t).orientation, degrees=True)[:, 0], np.linspace(0, 90, 11), atol=1e-10
    )
    forward = control.flexion()(t)
    np.testing.assert_allclose(
        ep.thesis_angles(forward.orientation[:-1], degrees=True)[:, 1], np.linspace(0, -81, 10), atol=1e-10
    )
    np.testing.assert_allclose(forward.angular_velocity, np.tile([0.0, -np.pi / 10, 0.0], (11, 1)), atol=1e-14)
    for side in ("left", "right"):
        sideways = ep.shoulder_rotation(0, 90, 0, side, degrees=True)
        assert (control.abduction(side=side).end * sideways.inv()).magnitude() < 1e-12
        forward = ep.shoulder_rotation(90, 0, 0, side, degrees=True)
        assert (control.flexion(side=side).end * forward.inv()).magnitude() < 1e-12


def test_no_time_law_from_rest_to_rest_has_less_jerk():
    # Polynomials of degree 9 that start and end at rest: two free coefficients besides the quintic's.
    x = np.linspace(0.0, 1.0, 2001)

    def jerk(free):
        change = np.polynomial.Polynomial([0, 0, 0, 1]) * np.polynomial.Polynomial([1, -1]) ** 3
        curve = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6]) + change * np.polynomial.Polynomial(free)
        return np.trapezoid(curve.deriv(3)(x) ** 2, x)

    best = minimize(jerk, [0.3, -0.4, 0.2])
    np.testing.assert_allclose(best.x, 0.0, atol=1e-3)
    s = progress("minimum_jerk", x)[0]
    np.testing.assert_allclose(np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])(x), s, atol=1e-14)


@pytest.mark.parametrize("name", control.DAILY_TASKS)
def test_synthetic_tasks_stay_within_their_range(name):
    box = np.array(control.DAILY_TASKS[name].intervals)
    for side in ("left", "right"):
        task = control.daily_task(name, side=side)
        assert "synthetic" in task.title
        assert task.start.magnitude() == task.end.magnitude() == 0.0
        # From the first corner of the range to the last.
        t = np.linspace(0.25, 0.75, 400) * task.duration
        angles = np.degrees(task.angles_at(t)[0])
        assert (angles >= box[:, 0] - 1e-9).all()
        assert (angles <= box[:, 1] + 1e-9).all()
        pose = ep.shoulder_rotation(*angles.T, side=side, degrees=True)
        assert (task(t).orientation * pose.inv()).magnitude().max() < 1e-12


def test_reference_from_a_file_follows_its_samples(tmp_path):
    t = np.linspace(0.0, 3.0, 151)
    task = control.daily_task("feeding", 3.0)
    angles = ep.shoulder_angles(task(t).orientation, degrees=True)
    rows = "\n".join(f"{a:.12g},{f:.12g},{b:.12g},{c:.12g}" for a, (f, b, c) in zip(t, angles, strict=True))
    path = tmp_path / "feeding.csv"
    path.write_text(f"time_s,flexion_deg,abduction_deg,internal_rotation_deg\n{rows}\n")
    reference = control.read_reference(path, smoothing=None)
    inner = np.linspace(0.0, 3.0, 400)
    # The jerk of the task jumps at its waypoints, which no smooth spline follows.
    inner = inner[np.abs((inner + 0.375) % 0.75 - 0.375) > 0.15]
    assert (reference(inner).orientation * task(inner).orientation.inv()).magnitude().max() < 1e-6
    movement = ep.read_movement(path, smoothing=None)
    at = reference(movement.times)
    np.testing.assert_allclose(at.angular_velocity, movement.motion.angular_velocity, atol=1e-10)
    np.testing.assert_allclose(at.angular_acceleration, movement.motion.angular_acceleration, atol=1e-8)


def test_movement_of_a_reference_has_its_own_motion():
    exo = ep.load("prototype")
    reference = control.abduction(np.radians(60), law="minimum_jerk")
    movement = reference.movement(rate=20.0)
    assert len(movement.times) == 101
    state = reference(movement.times)
    answer = exo.follow(movement)
    direct = exo.reaction(state.orientation, motion=state.motion)
    np.testing.assert_allclose(answer.reaction.shoulder_force, direct.shoulder_force, rtol=1e-12)
    assert not movement.noise.is_relevant


@pytest.mark.parametrize("name", EXAMPLES)
def test_references_survive_pickling(name):
    reference = EXAMPLES[name]
    again = pickle.loads(pickle.dumps(reference))
    t = np.linspace(0.0, reference.duration, 20)
    np.testing.assert_array_equal(again(t).angular_acceleration, reference(t).angular_acceleration)
    assert reference.title in repr(again)


def test_bad_input_is_refused():
    rest, poses = Rotation.identity(), ep.shoulder_rotation([0, 0.1, 0.2], 0, 0)
    for wrong in (
        lambda: Turn(poses, [0, 0, 1], 1.0),
        lambda: Turn(rest, [0, 0, 90.0], 1.0),
        lambda: Turn(rest, [0, 0, 1], 0.0),
        lambda: Turn(rest, [0, 0, np.nan], 1.0),
        lambda: AnglePath([0.0, 1.0], [[0, 0, 0], [0, 60.0, 0]]),
        lambda: AnglePath([0.5, 1.0], np.zeros((2, 3))),
        lambda: AnglePath([0.0], np.zeros((1, 3))),
        lambda: OrientationSpline([0.0, 1.0, 0.5], poses),
        lambda: OrientationSpline([0.0, 1.0, 2.0], poses, rest=False),
        lambda: OrientationSpline([0.0, 1.0], ep.shoulder_rotation([0, 2.5], 0, 0)),
        lambda: OrientationSpline.of_movement(poses),
        lambda: control.abduction(90.0),
        lambda: control.daily_task("feeding", -1.0),
        lambda: control.abduction()(np.inf),
        lambda: control.abduction().movement(0.0),
    ):
        with pytest.raises(InvalidInput):
            wrong()
    with pytest.raises(UnknownName):
        control.abduction(law="linear")
    with pytest.raises(UnknownName):
        control.daily_task("combing")
    with pytest.raises(UnknownName):
        control.flexion(side="up")


def test_a_trajectory_without_states_cannot_be_made():
    class Nowhere(control.Trajectory):
        duration = 1.0

    with pytest.raises(TypeError, match="abstract"):
        Nowhere()
    with pytest.raises(TypeError, match="abstract"):
        control.Trajectory()


def test_spline_that_swings_is_refused():
    # Two orientations a hundredth of a second apart, then nothing for ten seconds.
    poses = ep.shoulder_rotation(np.radians([0, 100, 0, 100]), 0, 0)
    with pytest.raises(InvalidInput, match="swings"):
        OrientationSpline([0.0, 0.01, 10.0, 10.01], poses, rest=False)
