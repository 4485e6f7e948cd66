"""Measurement noise of a movement, propagated to the shoulder force.

At each sample the covariance of orientation, ω and η about an axis is split into three independent parts, each of which
moves all three quantities together. The pose is moved by one standard deviation of each part about each axis of the
base frame, and the query is repeated, nine times. The sum of squares of the nine changes of F_s is its variance, exact
where F_s is linear in the change (it is linear in η), for every split and limit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import NoisyMovement
from ...core.errors.base import warn
from ...core.validation import FloatArray
from ...load_case import Motion, Movement

#: Noise above this share of the shoulder force gives a warning.
NOISY = 0.1
#: Share by which samples that are not trusted may exceed the peak without a caution.
_SAME_PEAK = 0.01
#: Number of samples at which the noise is computed, evenly spread over the movement.
_SAMPLES = 25


def force_noise(
    movement: Movement,
    force: FloatArray,
    forces_at: Callable[[Rotation, Motion | None], FloatArray],
    static: bool,
    stacked: bool,
) -> FloatArray:
    """Standard deviation of F_s from measurement noise, shape (N,), N: root of the sum over its components.

    Parameters
    ----------
    movement : Movement
        With its noise.
    force : ndarray
        F_s along it, shape (N, 3).
    forces_at : callable
        Takes M orientations and their motion, returns F_s, shape (M, 3).
    static : bool
        Whether ``motion`` is left out.
    stacked : bool
        Whether other data of the query have a value for every sample; then all samples are computed.

    Returns
    -------
    ndarray
        NaN where the noise is unknown or was not computed; zero for a movement without noise.
    """
    count = len(movement.times)
    if not movement.noise.is_relevant:
        return np.zeros(count) if np.isfinite(movement.noise.per_axis) else np.full(count, np.nan)
    held = np.flatnonzero(np.isfinite(force).all(axis=1))
    at = held if len(held) <= _SAMPLES else held[np.linspace(0, len(held) - 1, _SAMPLES).round().astype(int)]
    at = np.arange(count) if stacked else at
    out = np.full(count, np.nan)
    if len(at) == 0:
        return out
    values, vectors = np.linalg.eigh(movement.noise.covariance[at])
    parts = vectors * np.sqrt(values.clip(min=0.0))[:, None, :]
    poses, motion = movement.poses[at], movement.motion
    squares = np.zeros(len(at))
    for part in np.moveaxis(parts, -1, 0):
        for axis in np.eye(3):
            turn, omega, eta = (part[:, k, None] * axis for k in range(3))
            moved = Motion(motion.angular_velocity[at] + omega, motion.angular_acceleration[at] + eta)
            change = forces_at(Rotation.from_rotvec(turn) * poses, None if static else moved) - force[at]
            squares += (change**2).sum(axis=1)
    out[at] = np.sqrt(squares)
    return out


def end_effects_caution(
    times: FloatArray, magnitude: FloatArray, held: NDArray[np.bool_], trusted: NDArray[np.bool_]
) -> str:
    """What samples whose motion depends on the ends of the record do to the peak, in a sentence; "" if nothing.

    Parameters
    ----------
    times, magnitude : ndarray
        Shape (N,), s and N.
    held, trusted : ndarray of bool
        Shape (N,): samples that count, and samples whose motion does not depend on the ends.
    """
    doubtful, sure = held & ~trusted, held & trusted
    if not doubtful.any():
        return ""
    advice = "Record a second before and after the movement, or state that the arm rests at both ends (ends)."
    if not sure.any():
        return f"The ends of the record or a gap govern the accelerations of all held samples. {advice}"
    peak, worst = float(magnitude[sure].max()), int(np.where(doubtful, magnitude, -1.0).argmax())
    if magnitude[worst] <= peak * (1.0 + _SAME_PEAK):
        return ""
    return (
        f"The ends of the record or a gap govern the accelerations of {int(doubtful.sum())} of {len(held)} samples. "
        f"|F_s| reaches {magnitude[worst]:.1f} N there, at {times[worst]:.3g} s, and {peak:.1f} N elsewhere. {advice}"
    )


def noise_caution(movement: Movement, force: FloatArray, noise: FloatArray) -> str:
    """That noise makes up more than :data:`NOISY` of F_s at half of the samples, in a sentence; "" if it does not."""
    known = np.isfinite(noise)
    if not known.any() or not noise[known].any():
        return ""
    size, error = float(np.median(np.linalg.norm(force[known], axis=1))), float(np.median(noise[known]))
    if error <= NOISY * size:
        return ""
    if movement.noise.method == "interpolation":
        advice = 'smooth the movement, Movement.from_samples(..., smoothing="gcv")'
    else:
        advice = "the sensor, its rate or the record do not allow better forces; static=True leaves ω and η out"
    return (
        f"Measurement noise makes up {100 * error / size:.0f} % of the shoulder force ({error:.3g} of {size:.3g} N in "
        f"the median sample): {movement.noise}; {advice}."
    )


def warn_of_noise(movement: Movement, force: FloatArray, noise: FloatArray) -> None:
    """Warn with :class:`NoisyMovement` of :func:`noise_caution`."""
    text = noise_caution(movement, force, noise)
    if text:
        warn(text, NoisyMovement)


def is_stacked(*pairs: Any) -> bool:
    """Whether an end of one of the pairs (lower, upper) has a value for every sample; others than pairs have none."""
    ends = (end for pair in pairs if isinstance(pair, list | tuple | np.ndarray) for end in pair)
    return any(np.ndim(end) >= 2 for end in ends)
