"""Movements: time series of orientation and their derivatives on the rotation group."""

from __future__ import annotations

import threading
import warnings
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, SolverFailed
from ..core.records import Record
from ..core.validation import FloatArray, as_finite, as_positive, as_rotation
from .motion_and_load import Motion

__all__ = ["Movement"]

#: Fewest samples that determine a second derivative.
_FEWEST = 4
#: Samples nearer in time than this, s, are one sample.
_SHORTEST_STEP = 1e-9
#: Two samples farther apart than this, rad, do not determine which way the arm turned between them.
_FARTHEST_STEP = np.radians(120.0)
#: The filters of warnings belong to all threads: one thread at a time changes them and changes them back.
_FILTERS = threading.Lock()


@dataclass(frozen=True, eq=False)
class Movement(Record):
    """An arm in motion. Make one with :meth:`from_samples`, or :func:`exo_pin.read_movement` from a file.

    Attributes
    ----------
    times : ndarray
        Shape (N,), s, rising.
    orientations : Rotation
        Stack of shape (N,), {O_B} to {O_A}.
    motion : Motion
        ω and η, shape (N, 3) each, base frame.
    smoothing : float
        Root of mean square, rad, that the samples were allowed to move; 0 for interpolation.
    """

    times: FloatArray
    orientations: Rotation
    motion: Motion
    smoothing: float = 0.0

    @classmethod
    def from_samples(cls, times: ArrayLike, orientations: Rotation, smoothing: float = 0.0) -> Movement:
        """Differentiate sampled orientations.

        The quaternions, made continuous in sign, are interpolated by a spline of degree 5 (of degree 3 with fewer than
        six samples) and brought to unit length, u = q/|q|; then ω = 2 vec(u̇ ū) and η = 2 vec(ü ū). No Euler angles
        take part, so there is no lock. For samples h apart the error of η is of the order of h⁴. Measured data need
        ``smoothing``: interpolation passes their noise on, multiplied by about 1/h².

        Parameters
        ----------
        times : array_like
            Shape (N,), s, strictly rising; N >= 4.
        orientations : Rotation
            Stack of shape (N,).
        smoothing : float
            Root of mean square, rad, by which the orientations may be moved to make the movement smooth. Somewhat
            more than the noise serves best: with white noise, 1.25 times its root of mean square leaves an
            acceleration that is better by orders of magnitude than 1 times does.

        Returns
        -------
        Movement
            With the orientations that belong to the derivatives.

        Raises
        ------
        InvalidInput
            If times do not rise, there are too few samples, or two of them are more than 120° apart.
        SolverFailed
            If no smooth movement was found as near as ``smoothing``.
        """
        t = as_finite("times", times, (None,))
        poses = as_rotation("orientations", orientations)
        if poses.shape != t.shape:
            raise InvalidInput(f"expected one orientation a time, got shapes {poses.shape} and {t.shape}")
        if len(t) < _FEWEST:
            raise InvalidInput(f"expected at least {_FEWEST} samples of a movement, got {len(t)}")
        if not (np.diff(t) > _SHORTEST_STEP).all():
            raise InvalidInput("expected times in s that rise from sample to sample, by a nanosecond or more")
        smoothing = as_positive("smoothing", smoothing, zero=True)
        steps = (poses[1:] * poses[:-1].inv()).magnitude()
        if steps.max() > _FARTHEST_STEP:
            raise InvalidInput(
                f"expected samples at most 120 degrees apart, got {np.degrees(steps.max()):.0f} after "
                f"t = {t[int(steps.argmax())]:g} s"
            )
        q = poses.as_quat()
        flips = np.sign(np.einsum("ij,ij->i", q[1:], q[:-1]))
        q[1:] *= np.cumprod(flips)[:, None]
        u, velocity, acceleration = _differentiated(t, q, smoothing)
        settled = poses if smoothing == 0.0 else Rotation.from_quat(u)
        return cls(t, settled, Motion(velocity, acceleration), smoothing)

    @property
    def duration(self) -> float:
        """From the first to the last sample, s."""
        return float(self.times[-1] - self.times[0])


def _differentiated(t: FloatArray, q: FloatArray, smoothing: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit quaternions, ω and η at the samples."""
    degree = 5 if len(t) >= 6 else 3
    # Scaled to spacing 1, so that the spline's conditioning does not depend on the unit of time.
    unit = float(t[-1] - t[0]) / (len(t) - 1)
    x = (t - t[0]) / unit
    if smoothing > 0.0:
        values = _smoothed(x, q, degree, smoothing)
    else:
        spline = scipy.interpolate.make_interp_spline(x, q, k=degree)
        values = [spline(x, order) for order in range(3)]
    q, dq, ddq = values[0], values[1] / unit, values[2] / unit**2
    size = np.linalg.norm(q, axis=-1, keepdims=True)
    u = q / size

    def dot(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.asarray((a * b).sum(axis=-1, keepdims=True))

    rate = dot(u, dq)
    du = (dq - u * rate) / size
    rate_change = dot(du, dq) + dot(u, ddq)
    ddu = (ddq - du * rate - u * rate_change) / size - du * rate / size
    return u, 2.0 * _vector_part(du, u), 2.0 * _vector_part(ddu, u)


def _smoothed(x: FloatArray, q: FloatArray, degree: int, smoothing: float) -> list[FloatArray]:
    """Smoothing splines of the components, and their first two derivatives, at the samples."""
    # A small turn moves the unit quaternion by half its angle; the four components share that.
    allowed = len(x) * (0.5 * smoothing) ** 2 / 4.0
    with _FILTERS, warnings.catch_warnings():
        # FITPACK's search for the exact sum of squares may end a little off; what it reached is checked below.
        warnings.simplefilter("ignore", RuntimeWarning)
        splines = [scipy.interpolate.make_splrep(x, component, k=degree, s=allowed) for component in q.T]
    values = [np.stack([spline(x, order) for spline in splines], axis=-1) for order in range(3)]
    moved = 2.0 * float(np.sqrt(((values[0] - q) ** 2).sum(axis=-1).mean()))
    if not moved <= 1.1 * smoothing:
        raise SolverFailed("FITPACK", moved, f"smoothing of a movement by {smoothing:g} rad")
    return values


def _vector_part(p: FloatArray, u: FloatArray) -> FloatArray:
    """vec(p ū) of quaternions xyzw."""
    v, w = p[..., :3], p[..., 3:]
    a, b = -u[..., :3], u[..., 3:]
    return np.asarray(w * a + b * v + np.cross(v, a))
