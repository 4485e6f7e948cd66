"""Movements: time series of orientation and their derivatives on the rotation group.

Measured orientations are smoothed as curves of unit quaternions in four dimensions, made continuous in sign: all four
components with the same λ, then brought to unit length. A rotation of the base frame or of the arm frame turns these
four dimensions, so the result depends on no choice of frame; there is no chart to leave and no Euler angle to lock, and
a movement may turn any number of times. White noise with the same standard deviation about every axis is white and
isotropic there too, at half the size. The penalty is ∫ |d⁴q/dt⁴|² dt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, UnknownName
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, as_choice, as_finite, as_positive, as_rotation, frozen
from ..numerics.smoothing.smoothing_splines import (
    FEWEST,
    SmoothedSamples,
    continuous_quaternions,
    fit_samples,
    interpolate_samples,
    motion_of_quaternions,
)
from .motion_and_load import FASTEST, Motion
from .record_checks import MeasurementNoise, motion_cautions, pose_cautions

#: Ways of :meth:`Movement.from_samples` to smooth.
SMOOTHINGS = ("gcv", None)
#: What is known of the arm at the ends of a record: nothing, or that it is at rest there.
ENDS = ("free", "rest")
#: Fewest samples that determine a second derivative.
_FEWEST = 4
#: Samples nearer in time than this, s, are one sample.
_SHORTEST_STEP = 1e-9
#: Two samples farther apart than this, rad, do not determine which way the arm turned between them.
_FARTHEST_STEP = np.radians(120.0)
#: A turn about an axis has three components, each of which moves a unit quaternion by half the angle.
_AXES, _HALF = 3, 0.5
#: No sensor of orientation is worse, rad.
_WORST_SENSOR = 1.0


@checked
@dataclass(frozen=True, eq=False)
class Movement(Record):
    """An arm in motion. Make one with :meth:`from_samples`, or :func:`exo_pin.read_movement` from a file.

    Attributes
    ----------
    times : ndarray
        Shape (N,), s, rising.
    poses : Rotation
        Stack of shape (N,), {O_B} to {O_A}, those that belong to ``motion``: smoothed, if the samples were.
    motion : Motion
        ω and η, shape (N, 3) each, base frame.
    noise : MeasurementNoise
        Noise found in the samples, and what is left of it in orientations, ω and η.
    pose_cautions : tuple of str
        Doubts about the orientations: gaps, samples that stand still, times that look like milliseconds; of a record
        also those about how it is read.
    judged_for : {"left", "right"} or None
        Side of the arm that the record was held against.
    elbow_flexion : ndarray or None
        Shape (N,), rad, as recorded; of records with a forearm.

    Examples
    --------
    >>> times = np.arange(6) / 10
    >>> poses = ep.shoulder_rotation(100 * times, 0, 0, degrees=True)
    >>> movement = ep.Movement.from_samples(times, poses, smoothing=None)
    >>> movement.motion.angular_velocity[0].round(4)  # rad/s: 100°/s of flexion
    array([ 0.    , -1.7453,  0.    ])
    """

    times: FloatArray
    poses: Rotation
    motion: Motion
    noise: MeasurementNoise
    pose_cautions: tuple[str, ...] = ()
    judged_for: str | None = None
    elbow_flexion: FloatArray | None = None

    @classmethod
    def from_samples(
        cls,
        times: ArrayLike,
        poses: Rotation,
        smoothing: str | None = "gcv",
        sensor_noise: float | None = None,
        ends: str = "free",
    ) -> Movement:
        """Differentiate sampled orientations.

        Noise is multiplied by about 1/h² in the acceleration, for samples h apart: 0.1° at 100 Hz makes η worthless.
        So samples with noise are smoothed, by as much as the data themselves call for (generalised cross-validation,
        :mod:`exo_pin.numerics.smoothing.smoothing_splines`). Samples without noise are interpolated by a spline of
        degree 7 (5 with fewer than 12 samples, 3 with fewer than six); the error of η is then of the order of h⁶. The
        quaternions, q, are brought to unit length, u = q/|q|; ω = 2 vec(u̇ ū) and η = 2 vec(ü ū).

        The noise must be white. Data that have already been filtered hold noise that looks like movement: use the raw
        samples. Rounding of a file is found as noise, as long as the arm moves by several roundings from sample to
        sample.

        Parameters
        ----------
        times : array_like
            Shape (N,), s, strictly rising, evenly spaced or not, with or without gaps; N >= 4.
        poses : Rotation
            Stack of shape (N,).
        smoothing : {"gcv", None}
            None interpolates whatever the noise. Fewer than 12 samples are interpolated in either case, and their
            noise is unknown.
        sensor_noise : float, optional
            Standard deviation of the samples about each axis, rad, if it is known: the smoothing is then the one
            that is best for this noise. It needs 12 samples.
        ends : {"free", "rest"}
            "rest" where the arm is at rest at the first and at the last sample: the smoothed movement then has ω = 0
            and η = 0 there, which is the best remedy for the errors at the ends. It is an assumption, not checked
            against the samples: an arm that moves there is bent to it. Interpolated samples are not changed by it.

        Returns
        -------
        Movement

        Raises
        ------
        InvalidInput
            If times do not rise, there are too few samples, two of them are more than 120° apart, noise makes the
            accelerations (fewer than 12 samples, which accelerate as no arm does), or ``sensor_noise`` or
            ``ends="rest"`` is given together with ``smoothing=None``.
        UnknownName
            If ``smoothing`` or ``ends`` is none of the above.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> times = np.linspace(0.0, 2.0, 41)
        >>> lift = ep.Movement.from_samples(times, exo.pose(45 - 45 * np.cos(np.pi * times / 2)), smoothing=None)
        >>> round(float(np.linalg.norm(lift.motion.angular_velocity, axis=1).max()), 2)  # rad/s
        1.23
        """
        t = as_finite("times", times, (None,))
        poses = as_rotation("poses", poses)
        steps = _checked_steps(t, poses)
        stated = _stated(smoothing, sensor_noise, len(t))
        rest = as_choice("ends", ends, ENDS) == "rest"
        if rest and smoothing is None:
            raise InvalidInput('expected ends="rest" with smoothing, got smoothing=None; leave one of them out')
        q = continuous_quaternions(poses)
        # Scaled to spacing 1, so that the spline's conditioning does not depend on the unit of time.
        unit = float(t[-1] - t[0]) / (len(t) - 1)
        x = (t - t[0]) / unit
        if smoothing is None:
            curve = interpolate_samples(x, q, _AXES)
        else:
            curve = fit_samples(x, q, _AXES, None if stated is None else _HALF * stated, rest)
        u, velocity, acceleration = motion_of_quaternions(curve.values, unit)
        largest = float(np.abs(acceleration).max())
        if largest > FASTEST and curve.penalty == 0.0:
            raise InvalidInput(
                f"the interpolated samples have an angular acceleration of {largest:.2g} rad/s², expected at most "
                f'{FASTEST:g}: this is noise multiplied; smooth the samples with smoothing="gcv"'
            )
        settled = poses if curve.penalty == 0.0 else Rotation.from_quat(u)
        noise = _noise_of(t, curve, unit, stated, rest)
        doubts = motion_cautions(x, q, unit, curve.noise, noise, acceleration)
        still = pose_cautions(t, steps, noise.cutoff_frequency)
        return cls(t, settled, Motion(velocity, acceleration, doubts), noise, still)

    @property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about the record, one sentence each; empty where there are none."""
        return (*self.pose_cautions, *self.motion.cautions)

    @property
    def duration(self) -> float:
        """From the first to the last sample, s."""
        return float(self.times[-1] - self.times[0])


def _checked_steps(t: FloatArray, poses: Rotation) -> FloatArray:
    """Angle from each sample to the next, shape (N-1,), rad."""
    if poses.shape != t.shape:
        raise InvalidInput(f"expected one orientation a time, got shapes {poses.shape} and {t.shape}")
    if len(t) < _FEWEST:
        raise InvalidInput(f"expected at least {_FEWEST} samples of a movement, got {len(t)}")
    if not (np.diff(t) > _SHORTEST_STEP).all():
        raise InvalidInput("expected times in s that rise from sample to sample, by a nanosecond or more")
    steps = (poses[1:] * poses[:-1].inv()).magnitude()
    if steps.max() > _FARTHEST_STEP:
        raise InvalidInput(
            f"expected samples at most 120 degrees apart, got {np.degrees(steps.max()):.0f} after "
            f"t = {t[int(steps.argmax())]:g} s"
        )
    return np.asarray(steps)


def _stated(smoothing: Any, sensor_noise: Any, count: int) -> float | None:
    """The stated noise, rad, or None."""
    if smoothing is not None and not isinstance(smoothing, str):
        raise InvalidInput(
            f'expected smoothing "gcv" or None, got {smoothing!r}; give the noise of the sensor as sensor_noise, in rad'
        )
    if smoothing not in SMOOTHINGS:
        raise UnknownName("smoothing", smoothing, ("gcv", "None"))
    if sensor_noise is None:
        return None
    value = as_positive("sensor_noise", sensor_noise, zero=True)
    if smoothing is None:
        raise InvalidInput("expected sensor_noise with smoothing, got smoothing=None; leave one of them out")
    if value > _WORST_SENSOR:
        raise InvalidInput(f"expected sensor_noise in rad, at most {_WORST_SENSOR:g}, got {value:g}")
    if count < FEWEST:
        raise InvalidInput(f"expected at least {FEWEST} samples to smooth, got {count}; leave sensor_noise out")
    return value


def _noise_of(t: FloatArray, curve: SmoothedSamples, unit: float, stated: float | None, rest: bool) -> MeasurementNoise:
    """Noise of the samples and of the derivatives, in rad and s."""
    found = curve.noise / _HALF
    scale = (found if stated is None else stated) / unit ** np.arange(3)
    covariance = curve.covariance * np.outer(scale, scale)
    if curve.penalty == 0.0:
        method, cutoff = "interpolation", np.inf
        ends = np.zeros(len(t), dtype=bool)
    else:
        # A smoothing spline passes 1 / (1 + λ h (2 π f)⁸) of an oscillation with frequency f (h = 1 here).
        method, cutoff = "gcv" if stated is None else "sensor noise", curve.penalty ** (-1 / 8) / (2.0 * np.pi * unit)
        ends = _near_ends(t, max(0.5 / cutoff, 2.0 * unit), rest)
    return MeasurementNoise(method, found, stated, float(cutoff), frozen(covariance), frozen(ends))


def _near_ends(t: FloatArray, reach: float, rest: bool) -> Any:
    """Whether a sample is within ``reach`` of an end of the record, or of a gap as long as ``reach``.

    The ends of a record at rest do not count: the curve is held there.
    """
    after = np.diff(t) >= reach
    edges = t[np.concatenate([[not rest], after]) | np.concatenate([after, [not rest]])]
    edges = np.concatenate([[-np.inf], edges, [np.inf]])
    above = np.searchsorted(edges, t)
    return np.minimum(np.abs(t - edges[above - 1]), np.abs(edges[above] - t)) < reach
