"""Movements read from CSV, and reactions along them written as CSV or NPZ."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..conventions import shoulder_angles, shoulder_rotation, thesis_rotation
from ..core.files import is_stream, write_bytes, write_text
from ..errors import FileFormatError, InvalidInput
from ..validation import FloatArray
from .movement import Movement, MovementReaction

__all__ = ["read_movement", "write_movement_reaction"]


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


def read_movement(path: str | PathLike[str], side: str = "left", smoothing: float = 0.0) -> Movement:
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
    smoothing : float
        As in :meth:`Movement.from_samples`, rad.

    Returns
    -------
    Movement

    Raises
    ------
    FileFormatError
        If it cannot be read, a column is missing or unknown, or a cell is no finite number; the line is named.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise FileFormatError(f"cannot be read: {error}", path) from error
    rows = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not rows:
        raise FileFormatError("is empty", path)
    header = [name.strip() for name in next(csv.reader([rows[0][1]]))]
    columns, (build, degrees) = _convention(header, path)
    data = np.empty((len(rows) - 1, len(header)))
    for index, (number, line) in enumerate(rows[1:]):
        cells = next(csv.reader([line]))
        try:
            if len(cells) != len(header):
                raise ValueError
            data[index] = [float(cell) for cell in cells]
        except ValueError:
            raise FileFormatError(f"line {number}: expected {len(header)} numbers, got {line!r:.80}", path) from None
        if not np.isfinite(data[index]).all():
            raise FileFormatError(f"line {number}: expected finite numbers, got {line!r:.80}", path)
    values = data[:, [header.index(name) for name in columns]]
    try:
        orientations = build(values, degrees, side) if len(values) else Rotation.identity(0)
        return Movement.from_samples(data[:, header.index("time_s")], orientations, smoothing)
    except FileFormatError:
        raise
    except InvalidInput as error:
        raise FileFormatError(str(error), path) from error


def _convention(header: list[str], path: str | PathLike[str]) -> tuple[tuple[str, ...], Any]:
    if len(set(header)) == len(header) and "time_s" in header:
        for columns, reading in _CONVENTIONS.items():
            if set(header) == {"time_s", *columns}:
                return columns, reading
    known = "; ".join(", ".join(("time_s", *columns)) for columns in _CONVENTIONS)
    raise FileFormatError(f"expected one of the headers: {known}; got {', '.join(header)}", path)


def write_movement_reaction(
    answer: MovementReaction, path: str | PathLike[str], side: str = "left", name: str = ""
) -> None:
    """Write full histories; the file appears whole or not at all.

    Parameters
    ----------
    answer : MovementReaction
        What to write.
    path : path-like
        ``.csv``: a table with units in its header, one line a sample, empty cells where there is no answer.
        ``.npz``: all arrays of the answer, among them every wrench, for :func:`numpy.load`.
        A pipe or a device gets the table.
    side : {"left", "right"}
        Side of the body that the clinical angles in the CSV are of.
    name : str
        Of the design, for the comment in the first line of the CSV.

    Raises
    ------
    InvalidInput
        If the ending is another.
    """
    ending = Path(fspath(path)).suffix.lower()
    if ending == ".csv" or (ending != ".npz" and is_stream(path)):
        write_text(path, _as_csv(answer, side, name))
    elif ending == ".npz":
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **_as_arrays(answer))
        write_bytes(path, buffer.getvalue())
    else:
        raise InvalidInput(f"expected a file that ends in .csv or .npz, got {fspath(path)!r}")


def _as_arrays(answer: MovementReaction) -> dict[str, Any]:
    fields = {
        key: np.asarray("" if value is None else value)
        for key, value in answer.reaction.as_dict().items()
        if key not in ("body_weight", "percent_body_weight")
    }
    return {
        "times": answer.movement.times,
        "quaternions_xyzw": answer.movement.orientations.as_quat(),
        "angular_velocity": answer.movement.motion.angular_velocity,
        "angular_acceleration": answer.movement.motion.angular_acceleration,
        **fields,
    }


def _as_csv(answer: MovementReaction, side: str, name: str) -> str:
    movement, reaction = answer.movement, answer.reaction
    n = reaction.actuator_forces.shape[-1]
    limbs = range(1, n + 1)
    columns: list[tuple[str, FloatArray]] = [("time_s", movement.times)]
    angles = shoulder_angles(movement.orientations, side, degrees=True)
    names = ("flexion_deg", "abduction_deg", "internal_rotation_deg")
    columns += [(label, angles[:, k]) for k, label in enumerate(names)]
    for label, array in (
        ("omega_{}_rad_s", movement.motion.angular_velocity),
        ("eta_{}_rad_s2", movement.motion.angular_acceleration),
        ("F_s_{}_N", reaction.shoulder_force),
    ):
        columns += [(label.format(axis), array[:, k]) for k, axis in enumerate("xyz")]
    columns.append(("F_s_N", reaction.magnitude))
    columns += [(f"f_{i}_N", reaction.actuator_forces[:, i - 1]) for i in limbs]
    columns += [(f"g_{i}_N", reaction.constraint_forces[:, i - 1]) for i in limbs]
    columns.append(("margin", reaction.margin))
    out = io.StringIO()
    out.write(
        f"# {name or 'exo_pin'}: {side} shoulder, split {reaction.split}; F_s is the shoulder's force on the arm\n"
    )
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(label for label, _ in columns), "status"])
    for row in range(len(movement.times)):
        cells = (float(values[row]) for _, values in columns)
        writer.writerow([*("" if np.isnan(cell) else repr(cell) for cell in cells), str(reaction.status[row])])
    return out.getvalue()
