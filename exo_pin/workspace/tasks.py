"""How much of daily tasks a design reaches, as in Table 5-7: from movements, and from published ranges of angles.

A published range is a box of angles, not a movement: its corners may be poses that nobody takes in the task, so its
share says less than that of a movement. The table labels them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike, fspath
from typing import Any

import numpy as np

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import FloatArray
from ..design import Mechanism
from ..load_case import Movement, read_movement
from ..load_case.ranges_of_motion import DAILY_RANGES, RangeOfMotion
from ..study import StudyTable
from ..wrist import limb_jacobian
from .criteria import Criteria
from .query import workspace
from .result import Workspace


@checked
def task_reach(
    mechanism: Mechanism,
    movements: Mapping[str, Movement | str | PathLike[str]] | None = None,
    ranges: Iterable[RangeOfMotion] = DAILY_RANGES,
    criteria: Criteria | Iterable[str] | None = None,
    step: float = 8.0,
) -> StudyTable:
    """Share of the poses of daily tasks that are inside the workspace.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    movements : mapping of str to Movement or path, optional
        By name of the task: movements, or CSV files whose header declares the order of the angles
        (:func:`exo_pin.read_movement`).
    ranges : iterable of RangeOfMotion
        Published ranges.
    criteria : Criteria or iterable of str, optional
        As in :func:`exo_pin.workspace.workspace`; "connected" needs a grid and is left out of movements.
    step : float
        Of the grid over a range, degrees.

    Returns
    -------
    StudyTable
        One row a task: ``task``; ``data``, "movement" or "published range"; ``poses``; ``inside``, the share of the
        poses that are inside; ``limited_by``, the criterion that most poses outside do not meet; and of movements
        ``fastest_limb_m_s`` and ``largest_power_W`` with ``fast_enough``, the share of the poses within the speed and
        power of the actuators (NaN where these are not known).

    Raises
    ------
    InvalidInput
        If there is neither a movement nor a range.

    Notes
    -----
    The device's centre is the shoulder's in all poses.

    Source: thesis Table 5-7.

    Examples
    --------
    >>> from exo_pin.workspace import task_reach
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 6), exo.pose(np.linspace(0, 50, 6)), smoothing=None)
    >>> table = task_reach(exo.mechanism, {"lift": lift}, ranges=())
    >>> table["inside"].tolist(), table["data"].tolist()
    ([1.0], ['movement'])
    """
    limits = Criteria.of(criteria)
    rows = [_of_movement(mechanism, name, given, limits) for name, given in (movements or {}).items()]
    for item in ranges:
        if not isinstance(item, RangeOfMotion):
            raise InvalidInput(f"expected ranges of RangeOfMotion records, got {type(item).__name__}")
        found = workspace(mechanism, item.poses(step, mechanism.side), limits)
        rows.append(_row(item.name, "published range", found, np.nan, np.nan, np.nan))
    if not rows:
        raise InvalidInput("expected at least one movement or range")
    return StudyTable(rows)


def _of_movement(
    mechanism: Mechanism, name: str, given: Movement | str | PathLike[str], criteria: Criteria
) -> dict[str, Any]:
    movement = given if isinstance(given, Movement) else read_movement(fspath(given), mechanism.side)
    found = workspace(mechanism, movement.poses, criteria.off_grid())
    rates = _rates(mechanism, movement)
    power = np.maximum(-found.tensions * rates, 0.0)
    return _row(
        name,
        "movement",
        found,
        float(np.abs(rates).max()),
        float(np.nanmax(power)) if np.isfinite(power).any() else np.nan,
        _fast_enough(mechanism, rates, power),
    )


def _rates(mechanism: Mechanism, movement: Movement) -> FloatArray:
    """dl/dt, shape (N, n), m/s."""
    jacobian = limb_jacobian(mechanism.geometry, movement.poses)
    return np.asarray(np.einsum("kij,kj->ki", jacobian, movement.motion.angular_velocity))


def _fast_enough(mechanism: Mechanism, rates: FloatArray, power: FloatArray) -> float:
    """Share of the samples within speed and power of the actuators; NaN if neither is known of some limb."""
    actuators = [limb.actuator for limb in mechanism.limbs]
    limits = [(None, None) if a is None else (a.speed_limit, a.power_limit) for a in actuators]
    if (None, None) in limits:
        return float("nan")
    # A limit that is not given is NaN. A speed that is not known fits no limit.
    speed, watts = np.array(limits, dtype=np.float64).T
    fits = ((np.abs(rates) <= speed) | np.isnan(speed)) & ~(power > watts)
    return float(fits.all(axis=1).mean())


def _row(name: str, data: str, found: Workspace, fastest: float, power: float, enough: float) -> dict[str, Any]:
    outside = ~found.inside
    failed = {each: int((outside & ~met).sum()) for each, met in found.met.items()}
    limited = max(failed, key=lambda each: failed[each]) if outside.any() and failed else ""
    return {
        "task": name,
        "data": data,
        "poses": found.inside.size,
        "inside": found.index,
        "limited_by": limited,
        "fastest_limb_m_s": fastest,
        "largest_power_W": power,
        "fast_enough": enough,
    }
