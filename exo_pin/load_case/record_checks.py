"""Noise of a record of movement, and doubts that its samples show: gaps, samples that stand still, filtered or too few.

Each check compares numbers of the record itself:

* **Gaps.** The record has no samples for a quarter of a second, or for half a period of the cutoff frequency of the
  smoothing: a peak fits in.
* **Samples that stand still.** Samples equal the one before although the arm moves: the step into or out of them is
  several times the smallest step of the record, the rounding of a file, and there are more than chance makes.
* **Filtered samples.** White noise is as large among every k-th sample as among all. A filter takes it away from
  neighbours, which then differ by less than samples a filter's length apart. In samples without noise the difference
  grows with a high power of their distance instead; that growth distinguishes the two.
* **Too few samples**, accelerations beyond those of people, and times that look like milliseconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput
from ..core.records import Record
from ..core.validation import FloatArray
from ..numerics.smoothing.smoothing_splines import FEWEST, fit_samples

#: Noise below this, rad, is that of double precision.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class MeasurementNoise(Record):
    """Noise of the samples of a movement, and of its orientations, ω and η.

    The noise is taken to be white (independent from sample to sample) and the same about every axis.

    Attributes
    ----------
    method : {"gcv", "sensor noise", "interpolation"}
        How the movement was made from the samples: smoothed by generalised cross-validation, smoothed for a stated
        noise, or interpolated, which passes the noise on.
    found : float
        Standard deviation about each axis, rad, estimated from the samples; NaN with too few of them.
    stated : float or None
        The same as stated by the user, rad.
    cutoff_frequency : float
        Hz, above which smoothing removes most of the motion (half its amplitude at this frequency); infinite for
        interpolation.
    covariance : ndarray
        Shape (N, 3, 3): covariance of orientation (rad), ω (rad/s) and η (rad/s²) about any one axis, at each sample.
        NaN where the noise is unknown. Near the ends errors can be several times as large.
    end_effects : ndarray of bool
        Shape (N,): samples within half a period of the cutoff frequency of an end of the record, or of a gap as
        long as that. There the estimate has data on one side only and the end conditions of the spline govern it.
        None of an interpolated movement.

    Examples
    --------
    >>> times = np.linspace(0.0, 2.0, 201)
    >>> jitter = np.random.default_rng(1).normal(0.0, 0.5, times.size)  # degrees, of the sensor
    >>> path = ep.Movement.from_samples(times, ep.load("prototype").pose(flexion=30.0 * times + jitter))
    >>> round(float(np.rad2deg(path.noise.found)), 1)  # degrees about each axis: of three, the jitter is about one
    0.3
    """

    method: str
    found: float
    stated: float | None
    cutoff_frequency: float
    covariance: FloatArray
    end_effects: NDArray[np.bool_]

    @property
    def per_axis(self) -> float:
        """Standard deviation of the samples about each axis, rad: as stated, else as found."""
        return self.found if self.stated is None else self.stated

    @property
    def is_relevant(self) -> bool:
        """Whether the noise is known and above that of double precision."""
        return bool(self.per_axis > _ROUNDING)

    @property
    def orientation(self) -> FloatArray:
        """Standard deviation of the orientation about each axis, shape (N,), rad."""
        return np.sqrt(self.covariance[:, 0, 0])

    @property
    def angular_velocity(self) -> FloatArray:
        """Standard deviation of each component of ω, shape (N,), rad/s."""
        return np.sqrt(self.covariance[:, 1, 1])

    @property
    def angular_acceleration(self) -> FloatArray:
        """Standard deviation of each component of η, shape (N,), rad/s²."""
        return np.sqrt(self.covariance[:, 2, 2])

    def __str__(self) -> str:
        if np.isnan(self.per_axis):
            return "interpolated; the noise of so few samples is unknown"
        source = "stated" if self.stated is not None else "found"
        noise = f"noise {np.degrees(self.per_axis):.2g} degrees about each axis ({source})"
        smoothed = f"smoothed ({self.method}, cutoff {self.cutoff_frequency:.3g} Hz)"
        how = "interpolated" if self.method == "interpolation" else smoothed
        eta = float(np.sqrt((self.angular_acceleration**2).mean()))
        ends = f"; end effects at {int(self.end_effects.sum())} samples" if self.end_effects.any() else ""
        return f"{how}, {noise}, {eta:.2g} rad/s² in each component of η{ends}"


#: A gap is at least so many times the median distance of samples; a peak of the force, s, fits into it.
_GAP, _PEAK = 5.0, 0.25
#: A step next to equal samples that is so many times the smallest step of the record is no rounding.
_ROUNDINGS = 4.0
#: A step into rest is less than this share of the one before it.
_BRAKED = 0.7
#: Equal samples that are fewer by chance in so many records do not come by chance.
_BY_CHANCE = 1e-3
#: Share of steps that equal samples follow, and median over smallest step, of a sensor slower than its record. Steps
#: of a rounding that is so coarse are one rounding in the median.
_SLOW_SENSOR, _SPREAD = 0.4, 2.5
#: Samples nearer than this, rad, are equal.
_EQUAL = 1e-11
#: Rates, Hz, of the thinned records whose noise is compared: filters of movement pass 3 to 10 Hz.
_THINNED = (16.7, 12.5)
#: Thinned noise above that of all samples, and its largest growth from the first to the second of these rates.
_ABOVE, _GROWTH = 1.5, 1.9
#: Noise about each axis, rad, below which filtered noise does not matter.
_HARMLESS = np.radians(0.01)
#: Angular acceleration that a person's arm does not exceed, rad/s²: 50° in 0.2 s take 125 at the least jerk.
_HUMAN = 200.0
#: A median distance of samples from here on, s, is too long for a movement.
_SLOW = 1.0


def pose_cautions(t: FloatArray, steps: FloatArray, cutoff: float) -> tuple[str, ...]:
    """Doubts about the orientations: gaps, samples that stand still, the unit of time.

    Parameters
    ----------
    t : ndarray
        Shape (N,), s.
    steps : ndarray
        Shape (N-1,), rad, angle from each sample to the next.
    cutoff : float
        Hz, of the smoothing; infinite for interpolation.
    """
    found, gaps = [], np.diff(t)
    long = np.flatnonzero(gaps > max(_GAP * float(np.median(gaps)), min(0.5 / cutoff, _PEAK)))
    if long.size:
        worst = int(long[gaps[long].argmax()])
        more = f", and {long.size - 1} more such gaps" if long.size > 1 else ""
        found.append(
            f"The record has no samples for {gaps[worst]:.3g} s after t = {t[worst]:.6g} s{more}. The forces there, "
            "perhaps the largest, are not known: record the movement again."
        )
    still = _standing_still(steps)
    if still.any():
        first = t[int(still.argmax())]
        found.append(
            f"{int(still.sum())} of {len(t)} samples equal the one before while the arm moves, the first after "
            f"t = {first:.6g} s. The sensor stood still or is slower than the record, and accelerations are wrong: "
            "remove these rows."
        )
    if float(np.median(gaps)) >= _SLOW:
        counted = "frame numbers (rate=..., --rate HZ), or " if (gaps == 1.0).all() else ""
        found.append(
            f"Samples are {np.median(gaps):.3g} s apart, too far for accelerations. Times are taken as s: are these "
            f"{counted}milliseconds (column time_ms)?"
        )
    return tuple(found)


def _standing_still(steps: FloatArray) -> np.ndarray:
    """Which samples but the first equal the one before within a movement, shape (N-1,).

    Noise and rounding make samples equal by chance, with a probability p that the number of runs shows: a run of k has
    p^k. A slow sensor's samples all stand in runs, and the steps between them are more than rounding.
    """
    same = steps <= _EQUAL
    marks = np.zeros_like(same)
    if same.all() or not same.any():
        return marks
    size = np.where(same, 0.0, steps)
    # Runs of equal samples: from the first of these steps to the one after the last.
    edges = np.diff(np.concatenate([[0], same.astype(np.int8), [0]]))
    first, after = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    smallest = float(size[~same].min())
    chance = len(first) / int((~same).sum())
    if chance > _SLOW_SENSOR and float(np.median(size[~same])) > _SPREAD * smallest:
        return same
    padded = np.concatenate([[0.0, 0.0], size, [0.0, 0.0]])
    for a, b in zip(first, after, strict=True):
        # A movement that comes to rest, or turns back, does so in ever smaller steps.
        moves = any(
            near > max(_ROUNDINGS * smallest, _BRAKED * beyond)
            for near, beyond in ((padded[a + 1], padded[a]), (padded[b + 2], padded[b + 3]))
        )
        if moves and chance ** (b - a) * len(steps) < _BY_CHANCE:
            marks[a:b] = True
    return marks


def motion_cautions(
    x: FloatArray, q: FloatArray, unit: float, component: float, noise: MeasurementNoise, eta: FloatArray
) -> tuple[str, ...]:
    """Doubts about ω and η: too few samples, filtered samples, accelerations beyond those of people.

    Parameters
    ----------
    x, q : ndarray
        Shapes (N,) and (N, 4): times in units of the mean spacing, continuous quaternions.
    unit : float
        s, that spacing.
    component : float
        Noise found in a component of q.
    noise : MeasurementNoise
        The same about each axis.
    eta : ndarray
        Shape (N, 3), rad/s².

    Raises
    ------
    InvalidInput
        If noise makes the accelerations: too few samples to tell it from movement, and accelerations beyond those of
        people.
    """
    texts, largest = [], float(np.linalg.norm(eta, axis=1).max())
    if len(x) < FEWEST:
        few = f"{len(x)} samples are too few to distinguish noise from movement"
        if largest > _HUMAN:
            raise InvalidInput(
                f"{few}, and interpolated they have an angular acceleration of {largest:.3g} rad/s², above the "
                f"{_HUMAN:g} of a person's arm: this is noise multiplied. Expected {FEWEST} samples or more"
            )
        texts.append(f"{few}, which interpolation multiplies: record {FEWEST} or more.")
    elif largest > _HUMAN:
        texts.append(
            f"The arm accelerates by up to {largest:.3g} rad/s², above the {_HUMAN:g} of a person's arm: are the times "
            "in s, and the samples smoothed?"
        )
    hidden = _filtered_noise(x, q, unit, component)
    if hidden > _HARMLESS and not (noise.stated or 0.0) > hidden:
        texts.append(
            f"Neighbouring samples have noise of {np.degrees(noise.found):.2g} degrees, samples farther apart of "
            f"{np.degrees(hidden):.2g}: the record was filtered, and what is left of its noise counts as movement. "
            "Use the raw samples, or state their noise (sensor_noise)."
        )
    return tuple(texts)


def _filtered_noise(x: FloatArray, q: FloatArray, unit: float, noise: float) -> float:
    """Noise about each axis, rad, that appears in thinned samples alone; 0 where none does."""
    second = min(round(1.0 / (_THINNED[1] * unit)), len(x) // (FEWEST + 1))
    first = round(second * _THINNED[1] / _THINNED[0])
    if not 2 <= first < second:
        return 0.0
    thin = _thinned_noise(x, q, first)
    if thin <= _ABOVE * noise:
        return 0.0
    thinner = _thinned_noise(x, q, second)
    # The growth is that of these distances, however they are rounded.
    limit = (second / first) ** (np.log(_GROWTH) / np.log(_THINNED[0] / _THINNED[1]))
    return 2.0 * thinner if _ABOVE * noise < thinner < limit * thin else 0.0


def _thinned_noise(x: FloatArray, q: FloatArray, every: int) -> float:
    """Noise of a quaternion's component among every k-th sample."""
    return fit_samples((x[::every] - x[0]) / every, q[::every], 3).noise
