"""How the arm moves and what pulls on it: the terms of a query that are not the mechanism's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InvalidInput
from ..validation import FloatArray, as_choice, as_finite

__all__ = ["Load", "Motion"]


@dataclass(frozen=True, eq=False)
class Motion:
    """Angular velocity and acceleration of the arm, base frame.

    Attributes
    ----------
    angular_velocity : ndarray
        ω, shape (..., 3), rad/s.
    angular_acceleration : ndarray
        η, shape (..., 3), rad/s².
    """

    angular_velocity: FloatArray
    angular_acceleration: FloatArray

    def __post_init__(self) -> None:
        for name in ("angular_velocity", "angular_acceleration"):
            object.__setattr__(self, name, as_finite(name, getattr(self, name), (3,), stack=True))


@dataclass(frozen=True, eq=False)
class Load:
    """A force and a couple on the arm, besides its weight.

    Attributes
    ----------
    force : ndarray
        Shape (..., 3), N.
    moment : ndarray
        Shape (..., 3), N m, a pure couple.
    at : ndarray
        Shape (..., 3), m, the point of the arm where the force acts, always in the arm frame {O_B}.
    frame : {"base", "arm"}
        Axes in which ``force`` and ``moment`` are given.
    """

    force: FloatArray
    moment: FloatArray | ArrayLike = 0.0
    at: FloatArray | ArrayLike = (0.0, 0.0, 0.0)
    frame: Literal["base", "arm"] = "base"

    def __post_init__(self) -> None:
        nothing = isinstance(self.moment, (int, float)) and self.moment == 0
        moment = np.zeros(3) if nothing else self.moment
        for name, value in (("force", self.force), ("moment", moment), ("at", self.at)):
            object.__setattr__(self, name, as_finite(name, value, (3,), stack=True))
        if np.abs(np.asarray(self.at)).max(initial=0.0) > 5.0:
            raise InvalidInput(f"expected at in m, got {self.at} (millimetres?)")
        as_choice("frame", self.frame, ("base", "arm"))
