"""What a controller is: a function of time and measurement that returns valve commands.

A plain Python function drops in::

    def hold_one_bar(t, measurement):
        return 5.0 * (1e5 - measurement.pressures) / 1e5

    run = exo.track("abduction", controller=hold_one_bar)

A controller that remembers something (an integral) has ``reset()`` too, which is called before each run.
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ...core.validation import FloatArray, as_choice, as_finite
from ...muscle.valve.supply import LAYOUTS


@runtime_checkable
class Controller(Protocol):
    """Anything that sends commands to valves."""

    def __call__(self, t: float, measurement: Any) -> ArrayLike:
        """Commands, shape (n,), -1 to 1, held until the next sample.

        Parameters
        ----------
        t : float
            s since the start of the run.
        measurement : Measurement
            What the sensors say (:class:`exo_pin.control.Measurement`); behind an inertial sensor also ``lost``,
            whether it is without a reading.
        """
        ...


def command_of_duty(duty: ArrayLike, layout: str = "3/2") -> FloatArray:
    """Valve command of the share of time for which a muscle fills.

    A 3/2-way valve vents whenever it does not fill, so the command is 2 d - 1. With separate valves that can both be
    closed the duty is the command itself.

    Parameters
    ----------
    duty : array_like
        Shape (n,), 0 to 1.
    layout : {"3/2", "fill and vent"}
        Of the valves (:class:`exo_pin.muscle.ValveUnit`).
    """
    share = as_finite("duty", duty, (None,))
    return np.asarray(2.0 * share - 1.0 if as_choice("layout", layout, LAYOUTS) == "3/2" else share)
