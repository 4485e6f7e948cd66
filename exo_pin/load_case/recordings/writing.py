"""Movements as files: CSV in any of the conventions, ``.mot`` and ``.sto`` for OpenSim."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import CLINICAL_ANGLES, as_side, isb_angles, shoulder_angles, thesis_angles
from ...core.errors.checked import checked
from ...core.files import require_ending, write_columns, write_text
from ...core.validation import FloatArray, as_choice, require_type
from ..trajectories import Movement
from .angles import Y_UP

#: Columns by convention, of angles in degrees.
ANGLES = {
    "clinical": CLINICAL_ANGLES,
    "thesis": ("theta_x_deg", "theta_y_deg", "theta_z_deg"),
    "isb": ("plane_of_elevation_deg", "elevation_deg", "axial_rotation_deg"),
    "quaternions": ("qx", "qy", "qz", "qw"),
}
ENDINGS = (".csv", ".mot", ".sto")


@checked
def write_movement(path: str | PathLike[str], movement: Movement, side: str = "left", angles: str = "clinical") -> None:
    """Write the poses of a movement, for :func:`exo_pin.read_movement` and for OpenSim.

    Parameters
    ----------
    path : path-like
        ``.csv``; ``.mot``, the coordinates of the shoulder (and of the elbow where it is known) of Rajagopal's model in
        degrees, against the torso; or ``.sto``, orientations of torso and humerus for OpenSense with z up and the trunk
        facing x.
    movement : Movement
        What to write, as smoothed.
    side : {"left", "right"}
        Side of the body.
    angles : {"clinical", "thesis", "isb", "quaternions"}
        Of a ``.csv`` file.

    Raises
    ------
    InvalidInput
        If the ending is another.
    UnknownName
        If ``side`` or ``angles`` is none of the above.

    Examples
    --------
    >>> times = np.linspace(0.0, 1.0, 21)
    >>> lift = ep.Movement.from_samples(times, ep.shoulder_rotation(60 * times, 0, 0, degrees=True))
    >>> ep.write_movement("lift.mot", lift)
    >>> again = ep.read_movement("lift.mot")
    >>> bool((again.poses * lift.poses.inv()).magnitude().max() < 1e-9)  # rad
    True
    """
    require_type("movement", movement, Movement, "a Movement")
    require_ending("path", path, ENDINGS)
    as_choice("angles", angles, ANGLES)
    side, times = as_side(side), np.asarray(movement.times)
    ending = fspath(path).lower()[-4:]
    if ending == ".csv":
        values = in_convention(movement.poses, side, angles)
        columns = {"time_s": times} | dict(zip(ANGLES[angles], values.T, strict=True))
        elbow = {} if movement.elbow_flexion is None else {"elbow_flexion_deg": np.degrees(movement.elbow_flexion)}
        write_columns(path, columns | elbow)
    elif ending == ".mot":
        write_text(path, _coordinates(movement, times, side))
    else:
        write_text(path, _orientations(movement.poses, times, side))


def in_convention(poses: Rotation, side: str, angles: str) -> FloatArray:
    """Angles in degrees of poses, or quaternions, shape (N, k); those of three axes go on beyond half a turn."""
    if angles == "quaternions":
        return poses.as_quat()
    if angles == "isb":
        return isb_angles(poses, side, degrees=True)
    values = thesis_angles(poses) if angles == "thesis" else shoulder_angles(poses, side)
    return np.degrees(np.unwrap(values, axis=0))


def _coordinates(movement: Movement, times: FloatArray, side: str) -> str:
    sign = 1.0 if side == "right" else -1.0
    turned = Y_UP * movement.poses * Y_UP.inv()
    values = np.unwrap(turned.as_euler("ZXY", suppress_warnings=True), axis=0) * np.array([1.0, sign, sign])
    names = [f"{name}_{side[0]}" for name in ("arm_flex", "arm_add", "arm_rot")]
    if movement.elbow_flexion is not None:
        values, names = np.c_[values, movement.elbow_flexion], [*names, f"elbow_flex_{side[0]}"]
    rows = np.c_[times, np.degrees(values)].tolist()
    head = f"Coordinates\nversion=1\nnRows={len(rows)}\nnColumns={len(names) + 1}\ninDegrees=yes"
    return _text(head, ["time", *names], ([repr(value) for value in row] for row in rows))


def _orientations(poses: Rotation, times: FloatArray, side: str) -> str:
    rate = (len(times) - 1) / float(times[-1] - times[0])
    head = f"DataRate={rate:.6f}\nDataType=Quaternion\nversion=3\nOpenSimVersion=4.5"
    quaternions = poses.as_quat(scalar_first=True).tolist()
    rows = (
        [repr(time), "1.0,0.0,0.0,0.0", ",".join(map(repr, cell))]
        for time, cell in zip(times.tolist(), quaternions, strict=True)
    )
    return _text(head, ["time", "torso_imu", f"humerus_{side[0]}_imu"], rows)


def _text(head: str, names: list[str], rows: Iterable[list[str]]) -> str:
    return "\n".join([head, "endheader", "\t".join(names), *("\t".join(row) for row in rows), ""])
