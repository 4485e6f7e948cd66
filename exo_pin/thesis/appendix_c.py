"""Table 2-1 and the workspace index of Appendix C: its range, its grid, and how far its shares can be approached.

The shares are recomputed here from the angles of :func:`exo_pin.wrist.inverse_kinematics`, not by
:mod:`exo_pin.workspace`. (C-2) is garbled in print; it is read as the diamond of Table 5-6, |θx| + |θy| < 95°, counted
from Z of (4-15). No muscle lengths are printed for these designs, so the stroke cannot be applied.
"""

from __future__ import annotations

import numpy as np

from ..core.conventions import shoulder_rotation
from ..design import WristGeometry, preset
from ..load_case.ranges_of_motion import DAILY_RANGES
from ..wrist import inverse_kinematics
from .rows import Row, row

#: Ranges of θy, θx and θz, degrees.
_RANGES = ((-110.0, 0.0), (-4.0, 96.0), (-85.0, 20.0))
_HALF_DIAGONAL = np.radians(95.0)
#: Table C-1: bounds of r_A, r_B, h_A, h_B, mm, and of the three α, degrees.
_BOUNDS = np.array([(50, 180), (90, 200), (41, 60), (58, 108), (-20, 0), (30, 60), (90, 120)], dtype=float)


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

    Source: thesis (C-1), (C-2), Table 2-1, Table C-1, Table C-2.
    """
    return [*_daily_range(), *_index(), *_optimum()]


def _daily_range() -> list[Row]:
    """The summary of Table 2-1 from its surveys, and how far it spreads in the ball of rotation vectors."""
    # The two surveys that print where a range begins and ends; their angles are positive as named.
    murray, buckley = DAILY_RANGES[:2]
    flexion, abduction, internal = zip(murray.intervals, buckley.intervals, strict=True)
    summary = [
        -np.mean(flexion, axis=0)[1],
        np.max(abduction) - 100.0,
        np.max(abduction),
        -np.mean(internal, axis=0)[1],
        -np.min(internal),
    ]
    theta_y, theta_x, theta_z = np.meshgrid(*_axes(4.0), indexing="ij")
    along = shoulder_rotation(-theta_y, theta_x, -theta_z, degrees=True).as_rotvec()[..., 1]
    printed, meant = (100.0 * float((np.abs(along) <= most).mean()) for most in (2 / np.pi, np.pi / 2))
    return [
        row("appendix_c.summary_flexion", summary),
        row("appendix_c.Murray_Johnson_abduction", murray.abduction_deg[1]),
        row("appendix_c.poses_along_Y_in", [along.min(), along.max()], printed=[-2 / np.pi, 2 / np.pi],
            values=(printed, meant)),
    ]  # fmt: skip


def _optimum() -> list[Row]:
    circles = preset("optimised-table-c-2").geometry.circles
    assert circles is not None
    sizes = [1e3 * size for size in (circles.r_A, circles.r_B, circles.h_A, circles.h_B)]
    best = np.array([*sizes, *np.degrees(circles.alpha_A)])
    return [
        row("appendix_c.optimum_r_A_r_B", best.clip(*_BOUNDS.T), printed=best),
        row("appendix_c.optimum_of_h_A_printed", best[2]),
    ]  # fmt: skip


def _index() -> list[Row]:
    counts = {step: int(np.prod([len(axis) for axis in _axes(step)])) for step in (1.0, 2.0, 3.0, 4.0, 5.0)}
    (step,) = (step for step, count in counts.items() if count == 19656)
    optimised = preset("optimised-table-c-2").geometry
    at_29 = optimised.replace(h_A=0.029)
    centre = WristGeometry.from_circles(0.115, 0.145, 0.0505, 0.083, np.radians([-10.0, 45.0, 105.0]))
    best = [_share(optimised, False), _share(optimised, True), _share(at_29, False), _share(at_29, True)]
    start = [_share(centre, False), _share(centre, True)]
    return [
        row("appendix_c.increment_of_the", step, values=(counts[4.0], counts[2.0])),
        row("appendix_c.index_index_of_Table", best),
        row("appendix_c.index_index_of_the", start),
    ]  # fmt: skip
