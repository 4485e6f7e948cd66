"""Efforts and strokes of the drives of a device over poses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.validation import FloatArray
from ..reaction import Reaction

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__: list[str] = []

#: Poses that a device cannot take.
_BEYOND = ("out_of_reach", "beyond_singular", "out_of_stroke")


def is_passive(exo: ShoulderExo) -> bool:
    """Whether a device has no drives, so that what it leaves is the wearer's."""
    return drive_count(exo) == 0


def drive_count(exo: ShoulderExo) -> int:
    """Number of its drives."""
    return len(exo.device.drives)


def within_reach(status: NDArray[np.str_]) -> NDArray[np.bool_]:
    """Poses that a device closes in, with its drives and joints within their travel as far as that is known."""
    return ~np.isin(status, _BEYOND)


def drive_figures(exo: ShoulderExo, poses: Rotation, answer: Reaction) -> dict[str, float]:
    """Largest effort of any drive in the held poses, also over its limit, and largest stroke over the reached ones.

    Forces and slides apart from torques and hinges; NaN where there is none of the kind, and where no limit is known.
    """
    count = drive_count(exo)
    units = np.array([unit for _, unit in answer.drive_units][:count] or ["N"] * count)
    held = np.asarray(answer.held).reshape(-1)
    efforts = answer.actuator_forces.reshape(len(held), -1)[:, :count]
    limits = answer.source.poses.limits
    bounds = np.where(efforts >= 0.0, limits.upper[:, :count], limits.lower[:, :count])
    known = held[:, None] & np.isfinite(bounds) & (bounds != 0.0)
    reached = within_reach(answer.status).reshape(-1)
    coordinates = _coordinates(exo, poses, answer)[:, :count]
    coordinates = coordinates[reached if reached.any() else ~np.isnan(coordinates).any(axis=1)]
    slides, hinges = units == "N", units == "N m"
    return {
        "effort_N": _largest(np.abs(efforts[held][:, slides])),
        "effort_Nm": _largest(np.abs(efforts[held][:, hinges])),
        "effort_share": _largest(efforts[known] / bounds[known]),
        "stroke_mm": 1e3 * _largest(_ranges(coordinates[:, slides])),
        "stroke_deg": float(np.degrees(_largest(_arcs(coordinates[:, hinges])))),
    }


def _largest(values: FloatArray) -> float:
    return float(values.max()) if values.size else np.nan


def _ranges(values: FloatArray) -> FloatArray:
    return np.ptp(values, axis=0) if len(values) else np.empty(0)


def _arcs(angles: FloatArray) -> FloatArray:
    """Range of each hinge, rad; one that turns on takes the shorter arc that holds all its angles."""
    if not len(angles):
        return np.empty(0)
    turns = np.sort(angles % (2.0 * np.pi), axis=0)
    gaps = np.diff(turns, axis=0, append=turns[:1] + 2.0 * np.pi)
    return np.asarray(2.0 * np.pi - gaps.max(axis=0))


def _coordinates(exo: ShoulderExo, poses: Rotation, answer: Reaction) -> FloatArray:
    """Coordinates of the drives, m or rad, shape (N, n); NaN out of reach."""
    if exo.device.accelerate("rates") is not None:
        return exo.inverse_kinematics(poses).lengths.reshape(-1, drive_count(exo))
    placed = answer.source.poses.placed
    assert placed is not None
    return np.where(placed.reached[:, None], placed.coordinates, np.nan)
