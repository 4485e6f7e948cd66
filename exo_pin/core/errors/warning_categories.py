"""Categories of warnings, and the place that a warning names."""

from __future__ import annotations

import sys
import warnings

from .base import shown


class ExoPinWarning(UserWarning):
    """Base of exo_pin's warnings: results are computed as requested, and may mislead or take longer than usual.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", ep.ExoPinWarning)
    ...     try:
    ...         ep.load("prototype").pose(abduction=1.57)
    ...     except ep.ExoPinWarning as warning:
    ...         print(warning)
    abduction = 1.57° is 90° in radians; this function takes degrees
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(shown(str(arg)) for arg in args))


class CacheUnusable(ExoPinWarning):
    """Machine code cannot be read from the cache on disk or stored there: results are the same, and take longer."""


class NoisyMovement(ExoPinWarning):
    """Measurement noise makes up much of the forces along a movement.

    Examples
    --------
    >>> import warnings
    >>> exo, times = ep.load("four-cables"), np.linspace(0.0, 0.2, 21)
    >>> jerky = exo.pose(45 + 0.02 * (-1.0) ** np.arange(21))  # ±0.02° from sample to sample
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     _ = exo.follow(ep.Movement.from_samples(times, jerky, smoothing=None))
    >>> str(told[0].message).split(" (")[0]
    'Measurement noise makes up 73 % of the shoulder force'
    """


class OutsideHumanRange(ExoPinWarning):
    """A pose that a human shoulder of that side does not reach, or a number that looks like one in another unit.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     _ = ep.load("prototype").pose(abduction=-90)  # through the trunk
    >>> str(told[0].message).split("; ")[0]
    'this pose cannot be reached by a human left shoulder'
    """


class SuspectMeasurements(ExoPinWarning):
    """Measurements look mislabelled, or given in another frame, order or unit than expected.

    Examples
    --------
    >>> import warnings
    >>> exo = ep.load("prototype")
    >>> pose = exo.pose(np.linspace(0, 60, 9), [10, 30, 20] * 3, [0, 20, -10] * 3)
    >>> swapped = exo.inverse_kinematics(pose).lengths[:, [1, 0, 2]]  # two columns of a table
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     _ = ep.calibrate(pose, swapped, exo)
    >>> str(told[0].message).split(": ")[1]
    'column 2 is limb 1, column 1 is limb 2'
    """


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the line outside the package that has called it."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("exo_pin."):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)
