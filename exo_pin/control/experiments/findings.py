"""Why an arm did not follow its reference, in words and figures that come from the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..plant.equations.muscle_kernels import free_contraction
from ..plant.equations.plant_tables import supply_of

if TYPE_CHECKING:
    from .tracking import Tracking

__all__ = ["ANGLES", "findings", "greatest_ratios", "out_of_stroke"]

#: Names of the clinical angles.
ANGLES = ("flexion", "abduction", "internal rotation")
#: A contraction is at its end when it is within this of the greatest one.
_NEAR_END = 0.01
#: Shares of time below which something is not worth a sentence.
_SELDOM = 0.02
#: Angle by which the rest pose must be off to be named, degrees.
_OFF = 2.0
#: Movement in the last part of a run that counts as standing still, degrees a second, and the smoothing, s.
_STILL, _WINDOW = 2.0, 0.25
_BAR = 1e5
#: Gauge pressure from which on a muscle counts as filled, Pa.
_FILLED = 0.5e5


def greatest_ratios(tracking: Tracking) -> np.ndarray:
    """Contraction ratio at which each muscle pulls with nothing at the supply's pressure, shape (n,)."""
    tables = tracking.run.plant.tables
    bar = supply_of(tracking.experiment.mechanism, tracking.run.plant.options).pressure / _BAR
    return np.array([free_contraction(tables.law, i, bar)[0] for i in range(len(tables.muscles))])


def out_of_stroke(tracking: Tracking) -> list[float]:
    """When each muscle, filled, first is as short as its supply can make it, s; NaN if it never is. List of n."""
    limits, found = greatest_ratios(tracking), []
    for ratio, pressure, limit in zip(tracking.ratios.T, tracking.run.pressures.T, limits, strict=True):
        at = np.flatnonzero((ratio >= limit - _NEAR_END) & (pressure >= _FILLED))
        found.append(float(tracking.times[at[0]]) if at.size else float("nan"))
    return found


def findings(tracking: Tracking) -> tuple[str, ...]:
    """Sentences, in the order of time."""
    return tuple(
        text for part in (_rest, _stretched, _beyond, _ends, _stall, _slack, _sensor) for text in part(tracking)
    )


def _rest(tracking: Tracking) -> list[str]:
    """The start is not the wanted one."""
    off = np.degrees(tracking.error[0])
    if off < _OFF:
        return []
    angles = tracking.angles(convention="thesis")[0]
    ratio = tracking.ratios[0]
    taut = [str(i) for i, value in enumerate(ratio, 1) if value < 0.0]
    text = f"at rest the arm hangs {off:.1f}° from the wanted start, at θ = ({', '.join(f'{a:.1f}' for a in angles)})°"
    wanted = tracking.wanted_ratios[0]
    short = [
        f"muscle {i} would have to be {-100.0 * value:.0f} % longer than nominal"
        for i, value in enumerate(wanted, 1)
        if value < 0.0
    ]
    why = f": {' and '.join(short)} there" if short and taut else ""
    return [text + why]


def _stretched(tracking: Tracking) -> list[str]:
    texts = []
    for i, wanted in enumerate(tracking.wanted_ratios.T, 1):
        share = float((wanted < 0.0).mean())
        if share > _SELDOM:
            texts.append(
                f"the reference needs muscle {i} longer than its nominal length for {100.0 * share:.0f} % of the time, "
                "and it cannot be stretched"
            )
    return texts


def _beyond(tracking: Tracking) -> list[str]:
    texts = []
    for i, (wanted, limit) in enumerate(zip(tracking.wanted_ratios.T, greatest_ratios(tracking), strict=True), 1):
        beyond = np.flatnonzero(wanted > limit)
        if beyond.size:
            first = beyond[0]
            angle, name = _main(tracking, first, wanted=True)
            texts.append(
                f"the reference needs muscle {i} to contract by more than the {100.0 * limit:.0f} % that it can "
                f"from {tracking.times[first]:.2f} s on ({name} {angle:.0f}° wanted)"
            )
    return texts


def _ends(tracking: Tracking) -> list[str]:
    texts = []
    for i, time in enumerate(out_of_stroke(tracking), 1):
        if np.isfinite(time):
            index = int(np.searchsorted(tracking.times, time))
            angle, name = _main(tracking, index)
            texts.append(f"muscle {i} runs out of stroke at {time:.2f} s, at {name} {angle:.0f}°")
    return texts


def _stall(tracking: Tracking) -> list[str]:
    """The main angle stands still before the reference does."""
    main = tracking.angles()[:, tracking.main_angle]
    wanted = tracking.angles(wanted=True)[:, tracking.main_angle]
    step = float(np.median(np.diff(tracking.times)))
    width = max(int(_WINDOW / step), 1)
    if len(main) <= 2 * width or abs(wanted[-1] - main[-1]) < _OFF:
        return []
    speed = np.abs(main[width:] - main[:-width]) / (width * step)
    moving = np.flatnonzero(speed > _STILL)
    last = int(moving[-1]) + width if moving.size else 0
    if last >= len(main) - width:
        return []
    angle, name = _main(tracking, last)
    return [f"{name} stands still from {tracking.times[last]:.2f} s on, at {angle:.0f}°"]


def _slack(tracking: Tracking) -> list[str]:
    texts = []
    for i, slack in enumerate(tracking.run.slack.T, 1):
        share = float(slack.mean())
        if share > 0.5:
            texts.append(f"muscle {i} is slack for {100.0 * share:.0f} % of the time")
    return texts


def _sensor(tracking: Tracking) -> list[str]:
    imu = tracking.experiment.imu
    if imu is None or not imu.lost:
        return []
    lost = [f"{start:g} to {end:g} s" for start, end in imu.lost]
    at = np.array([imu.is_lost(t) for t in tracking.times])
    force = np.linalg.norm(tracking.shoulder_force, axis=1)
    peak = f"{force[at].max():.0f}" if at.any() else "no"
    return [f"the inertial sensor is lost from {', '.join(lost)}; |F_s| reaches {peak} N meanwhile"]


def _main(tracking: Tracking, index: int, wanted: bool = False) -> tuple[float, str]:
    return float(tracking.angles(wanted)[index, tracking.main_angle]), ANGLES[tracking.main_angle]
