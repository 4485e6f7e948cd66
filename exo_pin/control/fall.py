"""A fall with the device on: the torso falls freely and is stopped, and the ground meets the hand.

The torso falls from a height h for sqrt(2 h/g). The impact stops it by half a sine of acceleration, π v/(2 T) at its
peak with v = sqrt(2 g h), and the ground pushes the hand up by half a sine of force of the same length.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ..core.errors.checked import checked
from ..core.validation import FloatArray, as_finite, require_type, set_fields, set_positive
from .plant.any_device.arm_actions import ArmState, Torso

__all__ = ["Fall"]

_G = 9.81


@checked
@dataclass(frozen=True, eq=False)
class Fall:
    """A fall onto the hand: ``ep.Plant(exo, wearer=fall, torso=fall.torso)``; see the module.

    In falls from a shoulder height of 1 m each hand got 0.65 to 1.7 body weights (five men).

    Parameters
    ----------
    body_mass, height : float
        kg; m that the shoulder falls.
    peak : float
        Greatest force on the hand over the body's weight.
    impact_time : float
        T, s.
    hand : array_like
        Where the ground meets the arm, shape (3,), m, arm frame.
    start : float
        When the fall begins, s.
    turn : callable, optional
        How the torso turns meanwhile; see :class:`.Torso`.

    Attributes
    ----------
    end : float
        When it is over, s.

    Raises
    ------
    InvalidInput
        If a number is out of its range.

    Notes
    -----
    Source: J. Biomechanics 35 (2002) 843, read in its abstract.

    Examples
    --------
    >>> from exo_pin.control import Fall
    >>> fall = Fall(75.0, 0.5, peak=1.2, impact_time=0.1, hand=(0.0, 0.0, -0.6))
    >>> round(fall.impact, 3), round(float(fall.torso.acceleration(fall.impact + 0.05)[2]), 1)  # s, m/s²
    (0.319, 49.2)
    """

    #: It comes from outside, and the wearer's own muscles bear it.
    external: ClassVar[bool] = True
    body_mass: float
    height: float
    peak: float
    impact_time: float
    hand: tuple[float, float, float]
    start: float = 0.0
    turn: Callable[[float], Any] | None = None

    def __post_init__(self) -> None:
        set_positive(self, "body_mass", "height", "peak", "impact_time")
        set_positive(self, "start", zero=True)
        require_type("turn", self.turn, Callable | None, "a function of time")
        set_fields(self, hand=tuple(as_finite("hand", self.hand, (3,)).tolist()))

    @property
    def impact(self) -> float:
        """When the ground is met, s."""
        return self.start + math.sqrt(2.0 * self.height / _G)

    @property
    def end(self) -> float:
        """When it is over, s."""
        return self.impact + self.impact_time

    @cached_property
    def torso(self) -> Torso:
        """How the torso moves."""
        return Torso(self.turn, _Dropped(self))

    def __call__(self, t: float, arm: ArmState) -> tuple[FloatArray, FloatArray]:
        """Force of the ground at O and its moment about it at a time; see the class."""
        up = np.array([0.0, 0.0, 1.0])
        if self.turn is not None:
            up = self.turn(t).orientation.as_matrix().T @ up
        force = self.peak * self.body_mass * _G * self.pulse(t) * up
        return force, np.cross(arm.matrix @ np.array(self.hand), force)

    def pulse(self, t: float) -> float:
        """Half a sine from 0 to 1 to 0 during the impact, zero else.

        Parameters
        ----------
        t : float
            s.

        Returns
        -------
        float

        Examples
        --------
        >>> from exo_pin.control import Fall
        >>> fall = Fall(75.0, 0.5, peak=1.2, impact_time=0.1, hand=(0.0, 0.0, -0.6))
        >>> [round(fall.pulse(fall.impact + t), 3) for t in (-0.01, 0.05, 0.2)]
        [0.0, 1.0, 0.0]
        """
        into = (t - self.impact) / self.impact_time
        return math.sin(math.pi * into) if 0.0 < into < 1.0 else 0.0


@dataclass(frozen=True)
class _Dropped:
    """Acceleration of the torso, world axes; it changes suddenly at ``start`` and ``end``."""

    fall: Fall

    @property
    def start(self) -> float:
        return self.fall.start

    @property
    def end(self) -> float:
        return self.fall.impact

    def __call__(self, t: float) -> FloatArray:
        own = self.fall
        if own.start <= t < own.impact:
            return np.array([0.0, 0.0, -_G])
        peak = 0.5 * math.pi * math.sqrt(2.0 * _G * own.height) / own.impact_time
        return np.array([0.0, 0.0, peak * own.pulse(t)])
