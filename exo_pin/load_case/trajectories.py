"""Movements: time series of orientation and their derivatives on the rotation group.

Measured orientations are smoothed as curves of unit quaternions in four dimensions, made continuous in sign: all four
components with the same λ, then brought to unit length. A rotation of the base frame or of the arm frame turns these
four dimensions, so the result depends on no choice of frame; there is no chart to leave and no Euler angle to lock, and
a movement may turn any number of times. White noise with the same standard deviation about every axis is white and
isotropic there too, at half the size. The penalty is ∫ |d⁴q/dt⁴|² dt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation, thesis_rotation
from ..core.errors import FileFormatError, InvalidInput, UnknownName
from ..core.errors.checked import checked
from ..core.files.csv_tables import CsvTable, read_csv
from ..core.files.toml_tables import naming_file
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
        Doubts about the orientations: gaps, samples that stand still, times that look like milliseconds.

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
        _check_acceleration(acceleration, curve.penalty == 0.0)
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


def _check_acceleration(acceleration: FloatArray, interpolated: bool) -> None:
    largest = float(np.abs(acceleration).max())
    if largest > FASTEST and interpolated:
        raise InvalidInput(
            f"the interpolated samples have an angular acceleration of {largest:.2g} rad/s², expected at most "
            f'{FASTEST:g}: this is noise multiplied; smooth the samples with smoothing="gcv"'
        )


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
    above = np.searchsorted(edges, t).clip(1, len(edges) - 1)
    return np.minimum(np.abs(t - edges[above - 1]), np.abs(edges[above] - t)) < reach


def _shoulder(values: FloatArray, degrees: bool, side: str) -> Rotation:
    flexion, abduction, internal = values.T
    return shoulder_rotation(flexion, abduction, internal, side, degrees)


def _thesis(values: FloatArray, degrees: bool, _: str) -> Rotation:
    theta_x, theta_y, theta_z = values.T
    return thesis_rotation(theta_x, theta_y, theta_z, degrees)


def _quaternion(values: FloatArray, _: bool, __: str) -> Rotation:
    size = np.linalg.norm(values, axis=1)
    if np.abs(size - 1.0).max() > 1e-3:
        raise InvalidInput(f"expected unit quaternions, got one of length {size[np.abs(size - 1).argmax()]:g}")
    return Rotation.from_quat(values)


#: The columns declare the convention: the clinical angles of the shoulder, (4-7), or quaternions.
_CONVENTIONS: dict[tuple[str, ...], tuple[Callable[[FloatArray, bool, str], Rotation], bool]] = {
    ("flexion_deg", "abduction_deg", "internal_rotation_deg"): (_shoulder, True),
    ("flexion_rad", "abduction_rad", "internal_rotation_rad"): (_shoulder, False),
    ("theta_x_deg", "theta_y_deg", "theta_z_deg"): (_thesis, True),
    ("theta_x_rad", "theta_y_rad", "theta_z_rad"): (_thesis, False),
    ("qx", "qy", "qz", "qw"): (_quaternion, False),
}


#: Columns of times with their unit, s.
_TIMES = {"time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6, "time_ns": 1e-9}
#: Columns of times whose unit the numbers show.
_PLAIN_TIMES = ("time", "timestamp", "t")
#: Since 1970, in s: from 2001 to 2286.
_EPOCH = (1e9, 1e10)


def read_movement(
    path: str | PathLike[str],
    side: str = "left",
    smoothing: str | None = "gcv",
    sensor_noise: float | None = None,
    ends: str = "free",
) -> Movement:
    """Read a movement from a CSV file whose header declares the angle convention.

    The columns are a time and one of: ``flexion_deg, abduction_deg, internal_rotation_deg`` (clinical signs,
    :func:`exo_pin.shoulder_rotation`); ``theta_x_deg, theta_y_deg, theta_z_deg`` ((4-7),
    :func:`exo_pin.thesis_rotation`); the same with ``_rad``; or ``qx, qy, qz, qw`` ({O_B} to {O_A}). Their order is
    free, and other columns are not read. Lines that start with ``#`` are comments.

    The time is ``time_s``, ``time_ms``, ``time_us`` or ``time_ns``; or ``time``, ``timestamp`` or ``t``, whose numbers
    show the unit: they count from 1970 (in s, ms, µs or ns), or else are ms where rows are 1 or more apart, and s where
    they are nearer. Times from 1970 are counted from the first row. A row in which an angle or the time is blank or NaN
    is a gap; :attr:`Movement.cautions` names such rows.

    Parameters
    ----------
    path : path-like
        The file.
    side : {"left", "right"}
        Side of the body that clinical angles are of.
    smoothing : {"gcv", None}
        As in :meth:`Movement.from_samples`: how much to smooth is found from the data, or nothing is smoothed.
    sensor_noise : float, optional
        Standard deviation of the samples about each axis, rad, if it is known.
    ends : {"free", "rest"}
        As in :meth:`Movement.from_samples`: "rest" where the arm is at rest at the first and at the last sample.

    Returns
    -------
    Movement

    Raises
    ------
    FileFormatError
        If the path is no regular file, there is no set of these columns or more than one, a cell is text or infinite
        (the line is named), or the samples are no movement.

    Examples
    --------
    >>> rows = [(0.1 * k, 3.0 * k, 0.0, 0.0) for k in range(12)]  # 30°/s
    >>> head = "time_s,flexion_deg,abduction_deg,internal_rotation_deg"
    >>> np.savetxt("lift.csv", rows, delimiter=",", header=head, comments="")
    >>> movement = ep.read_movement("lift.csv", smoothing=None)
    >>> np.degrees(movement.motion.angular_velocity[5]).round(3)  # flexion turns about -y
    array([  0., -30.,   0.])
    """
    table = read_csv(path)
    columns = _found(table)
    times = _times(table)
    values = table.numbers(columns, gaps=True)
    there = np.isfinite(times) & np.isfinite(values).all(axis=1)
    with naming_file(path):
        poses = _orientations(columns, values[there], side)
        movement = Movement.from_samples(times[there], poses, smoothing, sensor_noise, ends)
    lost = int((~there).sum())
    if not lost:
        return movement
    text = f"{lost} of {len(there)} rows have no orientation or no time and count as gaps."
    return replace(movement, pose_cautions=(text, *movement.pose_cautions))


def _times(table: CsvTable) -> FloatArray:
    """Times of all rows, s, NaN where blank."""
    names = [name for name in (*_TIMES, *_PLAIN_TIMES) if name in table.columns]
    if len(names) != 1:
        raise FileFormatError(
            f"expected one column of times, {', '.join(_TIMES)} or {', '.join(_PLAIN_TIMES)}; "
            f"got {', '.join(names) or ', '.join(table.columns)}",
            table.path,
        )
    given = table.numbers(names, gaps=True)[:, 0]
    known = given[np.isfinite(given)]
    if known.size < 2:
        return given
    first, unit = float(known[0]), _TIMES.get(names[0])
    epoch = [each for each in _TIMES.values() if _EPOCH[0] <= first * each < _EPOCH[1]]
    if unit is None:
        unit = epoch[0] if epoch else 1.0 if float(np.median(np.diff(known))) < 1.0 else 1e-3
    return np.asarray((given - first) * unit if unit in epoch else given * unit)


def orientation_columns(table: CsvTable, side: str) -> Rotation:
    """The orientations of a table, in columns as of :func:`read_movement`, a stack of shape (N,).

    Raises
    ------
    FileFormatError
        If there is none of the known sets of columns, or more than one.
    """
    columns = _found(table)
    with naming_file(table.path):
        return _orientations(columns, table.numbers(columns), side)


def _found(table: CsvTable) -> tuple[str, ...]:
    """The set of columns of a table that hold orientations."""
    found = [columns for columns in _CONVENTIONS if set(columns) <= set(table.columns)]
    if len(found) != 1:
        known = "; ".join(", ".join(columns) for columns in _CONVENTIONS)
        several = f", of which it has {len(found)}" if found else ""
        raise FileFormatError(
            f"expected one of these sets of columns{several}: {known}; got {', '.join(table.columns)}", table.path
        )
    return found[0]


def _orientations(columns: tuple[str, ...], values: FloatArray, side: str) -> Rotation:
    build, degrees = _CONVENTIONS[columns]
    return build(values, degrees, side) if len(values) else Rotation.identity(0)
