"""Movements read from CSV files."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation, thesis_rotation
from ..core.errors import FileFormatError, InvalidInput
from ..core.files.csv_tables import CsvTable, read_csv
from ..core.files.toml_tables import naming_file
from ..core.validation import FloatArray
from .trajectories import Movement

__all__ = ["orientation_columns", "read_movement"]


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


def read_movement(
    path: str | PathLike[str],
    side: str = "left",
    smoothing: str | None = "gcv",
    sensor_noise: float | None = None,
    ends: str = "free",
) -> Movement:
    """Read a movement from a CSV file whose header declares the angle convention.

    The columns are ``time_s`` and one of: ``flexion_deg, abduction_deg, internal_rotation_deg`` (clinical signs,
    :func:`exo_pin.shoulder_rotation`); ``theta_x_deg, theta_y_deg, theta_z_deg`` ((4-7),
    :func:`exo_pin.thesis_rotation`); the same with ``_rad``; or ``qx, qy, qz, qw`` ({O_B} to {O_A}). Lines that
    start with ``#`` are comments; the order of columns is free, others are an error.

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
        If the path is no regular file, a column is missing or unknown, or a cell is no finite number; the line is
        named.
    """
    table = read_csv(path)
    columns, orientations = orientation_columns(table, side)
    if set(table.columns) != {"time_s", *columns}:
        raise _unknown_header(table, "time_s")
    times = table.numbers(("time_s",))[:, 0]
    with naming_file(path):
        return Movement.from_samples(times, orientations, smoothing, sensor_noise, ends)


def orientation_columns(table: CsvTable, side: str) -> tuple[tuple[str, ...], Rotation]:
    """The columns of a table that hold orientations, as in :func:`read_movement`, and these, a stack of shape (N,).

    Raises
    ------
    FileFormatError
        If there is none of the known sets of columns, or more than one.
    """
    found = [columns for columns in _CONVENTIONS if set(columns) <= set(table.columns)]
    if len(found) != 1:
        raise _unknown_header(table)
    columns = found[0]
    build, degrees = _CONVENTIONS[columns]
    values = table.numbers(columns)
    with naming_file(table.path):
        return columns, build(values, degrees, side) if len(values) else Rotation.identity(0)


def _unknown_header(table: CsvTable, *before: str) -> FileFormatError:
    known = "; ".join(", ".join((*before, *columns)) for columns in _CONVENTIONS)
    return FileFormatError(f"expected one of the headers: {known}; got {', '.join(table.columns)}", table.path)
