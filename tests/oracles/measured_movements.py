"""Movements whose ω and η are known, measured with noise, and the least error that any smoothing of them has."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case import Motion, Movement
from exo_pin.numerics.smoothing.smoothing_splines import _LEAST, _Search, interpolate_samples, motion_of_quaternions

#: Turns about the first and the second axis: amplitudes (rad), rates (rad/s) and a constant rate about the third.
FIRST, SECOND, THIRD = np.array([0.45, 0.0, 0.0]), np.array([0.0, 0.35, 0.1]), np.array([0.0, 0.1, 0.3])
START = ep.shoulder_rotation(50.0, 40.0, 10.0, degrees=True)


def movement(t, rate=1.0, spin=0.0):
    """R = exp(A sin at) exp(B cos bt) exp(C ct) R_0 and its motion, by the product rule."""
    a, b = 2.6 * rate, 1.7 * rate
    turns = [
        (FIRST, np.sin(a * t), a * np.cos(a * t), -a * a * np.sin(a * t)),
        (SECOND, np.cos(b * t), -b * np.sin(b * t), -b * b * np.cos(b * t)),
        (THIRD, spin * t, spin + 0 * t, 0 * t),
    ]
    pose, omega, eta = Rotation.identity(len(t)), np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for axis, angle, speed, acceleration in turns:
        own, change = pose.apply(np.outer(speed, axis)), pose.apply(np.outer(acceleration, axis))
        eta = eta + change + np.cross(omega, own)
        omega = omega + own
        pose = pose * Rotation.from_rotvec(np.outer(angle, axis))
    return pose * START, Motion(omega, eta)


def reach(t, duration=1.5):
    """A reach of 50° about one axis from rest to rest with the least jerk (Flash and Hogan), and its motion."""
    tau, axis = t / duration, np.array([0.3, -0.8, 0.2])
    angle = 10 * tau**3 - 15 * tau**4 + 6 * tau**5
    speed = (30 * tau**2 - 60 * tau**3 + 30 * tau**4) / duration
    change = (60 * tau - 180 * tau**2 + 120 * tau**3) / duration**2
    return Rotation.from_rotvec(np.outer(angle, axis)) * START, Motion(np.outer(speed, axis), np.outer(change, axis))


def sample_times(rng, rate, duration, uneven=False):
    """Evenly spaced, or with jitter of a third of the spacing, a gap of 5 % and 5 % of the samples missing."""
    t = np.linspace(0.0, duration, round(rate * duration) + 1)
    if not uneven:
        return t
    n = len(t)
    t = t + rng.uniform(-1 / 3, 1 / 3, n) / rate
    there = rng.random(n) > 0.05
    there[n // 3 : n // 3 + n // 20] = False
    return t[there]


def noisy(rng, poses, noise):
    """Poses turned about each axis of the arm frame by white noise (rad)."""
    return poses * Rotation.from_rotvec(noise * rng.normal(size=(len(poses), 3)))


def exo():
    return ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))


def forces(exo, poses, motion):
    """F_s along a movement, N."""
    return exo.reaction_map(poses, motion, keep=["shoulder_force"]).shoulder_force


def rms(vectors):
    """Root of the mean square size of vectors."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def errors_of_all_smoothings(exo, t, measured, true, trials=40):
    """Errors of F_s for λ from interpolation to a cubic: the least is what no method without the truth can know."""
    q = measured.as_quat()
    q[1:] *= np.cumprod(np.sign((q[1:] * q[:-1]).sum(axis=1)))[:, None]
    unit = (t[-1] - t[0]) / (len(t) - 1)
    x = (t - t[0]) / unit
    search = _Search(x, q, 3, None, False)
    top = np.log(1e4) + search.levels * np.log(256.0)
    curves = [interpolate_samples(x, q, 3).values]
    for penalty in np.exp(np.linspace(np.log(_LEAST), top, trials)):
        basis = search.basis(penalty)
        curves.append(basis.values(q, basis.factor(penalty)))
    for values in curves:
        u, omega, eta = motion_of_quaternions(values, unit)
        if np.abs(eta).max() < 1e6:
            yield forces(exo, Rotation.from_quat(u), Motion(omega, eta)) - true


class Case(NamedTuple):
    """Errors of F_s, root mean square, N."""

    #: As smoothed, and the least of all λ.
    smooth: float
    least: float
    #: The same over the samples without end effects.
    inside: float
    least_inside: float
    #: Interpolated; infinite if that is refused.
    rough: float
    #: |F_s|.
    size: float
    movement: Movement


def measured_case(exo, seed, rate, degrees, duration=3.0, uneven=False, pace=1.0):
    """A movement with noise about each axis, and the errors of its forces."""
    rng = np.random.default_rng(seed)
    t = sample_times(rng, rate, duration, uneven)
    poses, motion = movement(t, pace)
    true = forces(exo, poses, motion)
    measured = noisy(rng, poses, np.radians(degrees))
    found = Movement.from_samples(t, measured)
    inside = ~found.noise.end_effects
    error = forces(exo, found.poses, found.motion) - true
    others = list(errors_of_all_smoothings(exo, t, measured, true))
    try:
        plain = Movement.from_samples(t, measured, smoothing=None)
    except ep.InvalidInput:
        rough = np.inf
    else:
        rough = rms(forces(exo, plain.poses, plain.motion) - true)
    return Case(
        rms(error), min(map(rms, others)), rms(error[inside]), min(rms(other[inside]) for other in others), rough,
        rms(true), found,
    )  # fmt: skip


def end_errors(exo, seed, rate, degrees, duration=1.5):
    """Errors of F_s, root mean square, N, of a reach with ends taken as free and as at rest.

    Of all samples, and of those within 0.1 s of the ends: shape (2, 2), and the two movements.
    """
    rng = np.random.default_rng(seed)
    t = sample_times(rng, rate, duration)
    poses, motion = reach(t, duration)
    true, measured = forces(exo, poses, motion), noisy(rng, poses, np.radians(degrees))
    near = (t < 0.1) | (t > duration - 0.1)
    found = [Movement.from_samples(t, measured, ends=ends) for ends in ("free", "rest")]
    errors = [forces(exo, one.poses, one.motion) - true for one in found]
    return np.array([[rms(error), rms(error[near])] for error in errors]), found
