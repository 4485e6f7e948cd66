"""Movements read from CSV files: columns are found by name, and others are not read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from os import PathLike

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation, thesis_rotation
from ..core.errors import FileFormatError, InvalidInput
from ..core.files.csv_tables import CsvTable, read_csv
from ..core.files.toml_tables import naming_file
from ..core.validation import FloatArray
from .trajectories import Movement


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
