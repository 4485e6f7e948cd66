"""Noise in measured orientations and in the derivatives made from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.records import Record
from ..core.validation import FloatArray

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
        The same as stated by the user.
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
    """

    method: str
    found: float
    stated: float | None
    cutoff_frequency: float
    covariance: FloatArray
    end_effects: np.ndarray

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
        if self.method == "interpolation":
            how = "interpolated"
        else:
            how = f"smoothed ({self.method}, cutoff {self.cutoff_frequency:.3g} Hz)"
        eta = float(np.sqrt((self.angular_acceleration**2).mean()))
        ends = f"; end effects at {int(self.end_effects.sum())} samples" if self.end_effects.any() else ""
        return f"{how}, {noise}, {eta:.2g} rad/s² in each component of η{ends}"
