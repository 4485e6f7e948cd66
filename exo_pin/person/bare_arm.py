"""Contact force of a bare arm over the elevation: the yardstick beside the shoulder force of a device.

The table is the package's own answer for one person and both planes, so that it needs no muscle model when it is read;
``python docs/scripts/bare_arm.py`` writes it anew.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.validation import FloatArray, as_rotation

#: Height, m, mass, kg, and sex of the person of the table.
BARE_ARM_PERSON = (1.75, 75.0, "male")


def bare_arm_share(poses: Rotation) -> tuple[FloatArray, FloatArray]:
    """Contact force of a straight arm without device at the elevation of a pose, percent of body weight.

    Parameters
    ----------
    poses : Rotation
        Shape (...).

    Returns
    -------
    low, high : ndarray
        Shape (...): the smaller and the larger of abduction and flexion at the same angle between arm and vertical; NaN
        above the highest of the table.

    Notes
    -----
    Assumption: the person of :data:`BARE_ARM_PERSON`, static, least sum of squared activations. In percent of body
    weight other persons differ little in this model; instrumented implants give 36 to 128, median 72, at 90°.
    """
    down = as_rotation("poses", poses).as_matrix()[..., 2, 2]
    elevation = np.degrees(np.arccos(np.clip(down, -1.0, 1.0)))
    angles, *planes = _table().T
    shares = np.stack([np.interp(elevation, angles, plane, right=np.nan) for plane in planes])
    return shares.min(axis=0), shares.max(axis=0)


@cache
def _table() -> NDArray[np.float64]:
    """Elevation, °, and percent of body weight in abduction and in flexion, shape (k, 3)."""
    text = files(__package__).joinpath("data/bare_arm.csv").read_text(encoding="utf-8")
    return np.loadtxt(text.splitlines(), delimiter=",", skiprows=1)
