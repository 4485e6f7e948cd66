"""The workspace index of Appendix C: its grid, and how far its two shares can be approached.

The shares are recomputed here from the angles of :func:`exo_pin.wrist.inverse_kinematics`, not by
:mod:`exo_pin.workspace`. (C-2) is garbled in print; it is read as the diamond of Table 5-6, |θx| + |θy| < 95°, counted
from Z of (4-15). No muscle lengths are printed for these designs, so the stroke cannot be applied.
"""

from __future__ import annotations

import numpy as np

from ..core.conventions import shoulder_rotation
from ..design import WristGeometry, preset
from ..wrist import inverse_kinematics
from .rows import Row, compare

__all__ = ["rows"]

_SOURCE = "Appendix C"
#: Ranges of θy, θx and θz, degrees.
_RANGES = ((-110.0, 0.0), (-4.0, 96.0), (-85.0, 20.0))
_HALF_DIAGONAL = np.radians(95.0)


def _axes(step: float) -> list[np.ndarray]:
    return [low + step * np.arange(int((high - low) / step + 1e-9) + 1) for low, high in _RANGES]


def _share(geometry: WristGeometry, both_ends: bool) -> float:
    """Percent of the poses of the 4° grid in which the universal joints are within the diamond."""
    theta_y, theta_x, theta_z = np.meshgrid(*_axes(4.0), indexing="ij")
    state = inverse_kinematics(geometry, shoulder_rotation(-theta_y, theta_x, -theta_z, degrees=True))
    inside = (np.abs(state.base_theta_x) + np.abs(state.base_theta_y) < _HALF_DIAGONAL).all(axis=-1)
    if both_ends:
        at_arm = np.abs(state.platform_theta_x) + np.abs(state.platform_theta_y)
        inside &= (at_arm < _HALF_DIAGONAL).all(axis=-1)
    return 100.0 * float(inside.mean())


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis (C-1), (C-2), Table C-1, Table C-2.
    """
    counts = {step: int(np.prod([len(axis) for axis in _axes(step)])) for step in (2.0, 4.0)}
    optimised = preset("optimised-table-c-2").geometry
    at_29 = optimised.replace(h_A=0.029)
    centre = WristGeometry.from_circles(0.115, 0.145, 0.0505, 0.083, np.radians([-10.0, 45.0, 105.0]))
    best = [_share(optimised, False), _share(optimised, True), _share(at_29, False), _share(at_29, True)]
    start = [_share(centre, False), _share(centre, True)]
    return [
        compare(_SOURCE, "increment of the grid with 19,656 configurations", "°", 2.0, 4.0, 0.0, mended=4.0, digits=0,
                note=f"28 × 26 × 27 = {counts[4.0]:,} poses at 4°; at 2° there are {counts[2.0]:,}"),
        compare(_SOURCE, "index Φ of Table C-2: joints at the base, at both ends; the same with the 29 mm of the text "
                "for h_A", "%", [61.6] * 4, best, 0.5, digits=1,
                note="no reading gives it; what (C-2) means, the straight direction of the joints and the muscles' "
                "lengths are not printed, and singular poses are not mentioned"),
        compare(_SOURCE, "index Φ of the first values, for the centre of Table C-1: joints at the base, at both ends",
                "%", [25.3] * 2, start, 0.5, digits=1,
                note="the first values are not printed"),
    ]  # fmt: skip
