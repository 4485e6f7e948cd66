"""Efforts within their limits of a device that gives way, at the geometry to which these efforts lead."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..core.validation import FloatArray
from ..device.equilibrium import DeviceEquilibrium
from ..wrist.forces.affine_state import BalancedTensions
from .answer import QUERY_STATUS, answered
from .constraints.actuator_limits import LimbLimits
from .splits.spherical import shortest_tensions

#: Rounds between geometry and efforts, and their change, relative to the largest effort, at which they end.
_ROUNDS, _SAME = 30, 1e-10


def within_limits(settled: Callable[..., DeviceEquilibrium], found: DeviceEquilibrium, limits: LimbLimits) -> None:
    """Move poses whose efforts can be chosen within the limits to the equilibrium of such efforts, in place.

    Poses in which no efforts will do stay where they are; those that do not come to rest are not solved.

    Parameters
    ----------
    settled : callable
        Takes ``preferred`` efforts and ``rows``, and returns the equilibrium.
    found : DeviceEquilibrium
        Without limits, changed.
    limits : LimbLimits
        Of the efforts.
    """
    rows = answered(found.status)
    rows = rows[limits.reachable[rows] & ~limits.met(BalancedTensions.of(found.state).f[rows], rows)]  # type: ignore[arg-type]
    last = np.full(found.coordinates.shape, np.nan)
    for _ in range(_ROUNDS):
        f = _chosen(found, limits, rows)
        known = np.isfinite(f).all(axis=1)
        rows, f = rows[known], f[known]
        with np.errstate(invalid="ignore"):
            moved = np.abs(f - last[rows]).max(axis=1, initial=0.0)
        left = ~(moved <= _SAME * np.abs(f).max(axis=1, initial=0.0))
        rows = rows[left]
        if not rows.size:
            return
        last[rows] = f[left]
        _put(found, settled(preferred=last, rows=rows), rows)
        rows = rows[found.status[rows] < QUERY_STATUS.index("singular")]
    found.status[rows] = QUERY_STATUS.index("not_solved")


def _chosen(found: DeviceEquilibrium, limits: LimbLimits, rows: NDArray[np.intp]) -> FloatArray:
    """Efforts of least norm within the limits at the geometry as it is; NaN where there are none."""
    tensions = BalancedTensions.of(found.state)  # type: ignore[arg-type]
    own = tensions.f[rows], tensions.self_stress[rows]
    return shortest_tensions(*own, limits.lower[rows], limits.upper[rows])


def _put(whole: tuple[object, ...], part: tuple[object, ...], rows: NDArray[np.intp]) -> None:
    """Take rows of all arrays of one record from another."""
    for one, other in zip(whole, part, strict=True):
        if isinstance(one, tuple) and isinstance(other, tuple):
            _put(one, other, rows)
        elif isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
            one[rows] = other[rows]
