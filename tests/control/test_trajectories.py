"""Reference trajectories: ω and η against differences on the rotation group, another spline, the thesis."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation, RotationSpline

import exo_pin as ep
from exo_pin import control
from exo_pin.control import AnglePath, OrientationSpline, Turn


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
    s = control.flexion(1.0, 1.0, "minimum_jerk")(x).orientation.magnitude()
    np.testing.assert_allclose(np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])(x), s, atol=1e-14)
