"""Measured runs: orientations and limb lengths, with times and pressures where they are known, and their CSV files.

One format for what is measured on a device and for what a simulation of it gives:

* optionally ``time_s``;
* orientations as in :func:`exo_pin.read_movement`, from the same table;
* ``length_1_mm``, ``length_2_mm``, ... (or ``_m``), one column a limb;
* optionally ``pressure_1_bar``, ... (or ``_Pa``), gauge pressure, one column a muscle.

Lines that start with ``#`` are comments. The order of columns is free, and other columns are not read, so that what
``exo-pin track --out`` writes can be read, too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import FileFormatError, InvalidInput, SuspectMeasurements
from ..core.errors.base import warn
from ..core.errors.checked import checked
from ..core.files import write_columns
from ..core.files.csv_tables import CsvTable
from ..core.files.toml_tables import naming_file
from ..core.records import Record
from ..core.validation import FloatArray, as_finite, as_rotation, require_type
from ..load_case import RecordingOptions
from ..load_case.recordings.reading import read_poses

#: Units of columns, in SI.
_UNITS = {"length": {"mm": 1e-3, "m": 1.0}, "pressure": {"bar": 1e5, "pa": 1.0}}
#: Written with these.
_WRITTEN = {"length": "mm", "pressure": "bar"}
_COLUMN = re.compile(r"(length|pressure)_([1-9][0-9]*)_(\w+)")


@checked
@dataclass(frozen=True, eq=False)
class MeasuredRun(Record):
    """Orientations and limb lengths, measured together.

    Attributes
    ----------
    poses : Rotation
        Stack of shape (N,), {O_B} to {O_A}, or of the sensors, as :func:`exo_pin.calibrate` takes them.
    lengths : ndarray
        Shape (N, n), m.
    times : ndarray or None
        Shape (N,), s, rising; None for single poses.
    pressures : ndarray or None
        Shape (N, m), Pa, gauge.

    Examples
    --------
    >>> from exo_pin.control import MeasuredRun
    >>> exo = ep.load("prototype")
    >>> poses = exo.pose(flexion=[0, 20, 40])
    >>> run = MeasuredRun(poses, exo.inverse_kinematics(poses).lengths, times=[0.0, 1.0, 2.0])
    >>> (1e3 * np.diff(run.lengths[:, 0])).round(1)  # mm, of limb 1 a second
    array([-36.9, -38.4])
    """

    poses: Rotation
    lengths: FloatArray | ArrayLike
    times: FloatArray | ArrayLike | None = None
    pressures: FloatArray | ArrayLike | None = None

    def __post_init__(self) -> None:
        poses = as_rotation("poses", self.poses)
        if len(poses.shape) != 1:
            raise InvalidInput(f"expected poses as a stack of shape (N,), got {poses.shape}")
        for name, shape in (("lengths", (None, None)), ("times", (None,)), ("pressures", (None, None))):
            given = getattr(self, name)
            if given is None and name != "lengths":
                continue
            values = as_finite(name, given, shape)
            if len(values) != len(poses):
                raise InvalidInput(f"expected {len(poses)} rows of {name}, one a pose, got {len(values)}")
            object.__setattr__(self, name, values)
        if self.times is not None and not (np.diff(np.asarray(self.times)) > 0.0).all():
            raise InvalidInput("expected times in s that rise from row to row")


def read_run(
    path: str | PathLike[str], side: str = "left", reading: RecordingOptions | str | None = None
) -> MeasuredRun:
    """Read a measured run from a CSV file; the module describes its columns.

    Parameters
    ----------
    path : path-like
        The file.
    side : {"left", "right"}
        Side of the body that clinical angles are of.
    reading : RecordingOptions or str, optional
        As in :func:`exo_pin.read_movement`.

    Returns
    -------
    MeasuredRun

    Raises
    ------
    UnknownName
        If ``side`` is none.
    FileFormatError
        If a column is missing, limbs are not numbered from 1, a unit is unknown, or a cell is no finite number.

    Examples
    --------
    >>> from exo_pin.control import MeasuredRun, read_run, write_run
    >>> exo = ep.load("prototype")
    >>> poses = exo.pose(flexion=[0, 20, 40])
    >>> write_run(MeasuredRun(poses, exo.inverse_kinematics(poses).lengths), "bench.csv")
    >>> bool((read_run("bench.csv").poses.inv() * poses).magnitude().max() < 1e-12)  # rad
    True
    """
    read = read_poses(path, side, reading, movement=False)
    table = read.source.table
    numbered = {} if table is None else _numbered(table)
    if table is None or "length" not in numbered:
        raise FileFormatError(
            f"expected columns length_1_mm, length_2_mm, ...; got {', '.join(read.source.labels)}", path
        )
    values = {kind: table.numbers(names) * _UNITS[kind][unit] for kind, (names, unit) in numbered.items()}
    times = table.numbers(("time_s",))[:, 0] if "time_s" in table.columns else None
    if not read.rows.all():
        line = table.lines[int((~read.rows).argmax())]
        raise FileFormatError(f"line {line}: expected a finite number in every column of the orientation", path)
    for text in read.cautions:
        warn(text, SuspectMeasurements)
    with naming_file(path):
        return MeasuredRun(read.poses, values["length"], times, values.get("pressure"))


def _numbered(table: CsvTable) -> dict[str, tuple[list[str], str]]:
    """Columns of lengths and pressures in the order of their numbers, with their unit."""
    found: dict[str, dict[int, tuple[str, str]]] = {}
    for name in table.columns:
        match = _COLUMN.fullmatch(name)
        if match is None:
            continue
        if match[3] not in _UNITS[match[1]]:
            raise FileFormatError(
                f"unknown unit of column {name!r}; there are length_1_mm (or _m) and pressure_1_bar (or _Pa)",
                table.path,
            )
        if int(match[2]) in found.setdefault(match[1], {}):
            raise FileFormatError(f"{match[1]} {match[2]} is there twice, the second time as {name!r}", table.path)
        found[match[1]][int(match[2])] = (name, match[3])
    sorted_columns = {}
    for kind, columns in found.items():
        units = {unit for _, unit in columns.values()}
        if sorted(columns) != list(range(1, len(columns) + 1)) or len(units) != 1:
            raise FileFormatError(
                f"expected {kind}s numbered from 1 without a gap and in one unit, got "
                f"{', '.join(name for name, _ in columns.values())}",
                table.path,
            )
        sorted_columns[kind] = ([columns[k][0] for k in sorted(columns)], units.pop())
    return sorted_columns


def write_run(run: MeasuredRun, path: str | PathLike[str], comments: Iterable[str] = ()) -> None:
    """Write a run as CSV that :func:`read_run` reads back; orientations as quaternions.

    Parameters
    ----------
    run : MeasuredRun
        What to write.
    path : path-like
        The file; it appears whole or not at all.
    comments : iterable of str
        Notes for a JSON file beside it.

    Examples
    --------
    >>> from pathlib import Path
    >>> from exo_pin.control import MeasuredRun, write_run
    >>> exo = ep.load("prototype")
    >>> poses = exo.pose(abduction=[0, 20])
    >>> write_run(MeasuredRun(poses, exo.inverse_kinematics(poses).lengths), "bench.csv", ["of 3 May"])
    >>> Path("bench.csv").read_text().splitlines()[0]
    'qx,qy,qz,qw,length_1_mm,length_2_mm,length_3_mm'
    >>> "of 3 May" in Path("bench.json").read_text()
    True
    """
    require_type("run", run, MeasuredRun, "a MeasuredRun")
    columns, blocks = ["qx", "qy", "qz", "qw"], [run.poses.as_quat()]
    if run.times is not None:
        columns, blocks = ["time_s", *columns], [np.asarray(run.times)[:, None], *blocks]
    for kind, values in (("length", run.lengths), ("pressure", run.pressures)):
        if values is not None:
            unit = _WRITTEN[kind]
            array = np.asarray(values) / _UNITS[kind][unit]
            columns += [f"{kind}_{k + 1}_{unit}" for k in range(array.shape[1])]
            blocks.append(array)
    said = list(comments)
    values = np.concatenate(blocks, axis=1).T
    write_columns(path, dict(zip(columns, values, strict=True)), {"comments": said} if said else None)
