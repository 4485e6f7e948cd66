"""How far along a path: s(t) from 0 to 1, with its first two derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.fields import set_positive
from ...core.validation import FloatArray, as_choice

__all__ = ["TIME_LAWS", "TimeLaw", "as_time_law"]

#: Names of the laws.
TIME_LAWS = ("constant_speed", "minimum_jerk")


@dataclass(frozen=True)
class TimeLaw:
    """How a movement proceeds from its start (s = 0) to its end (s = 1).

    * ``"constant_speed"``: s = t/T. The speed jumps at both ends, so that no real arm can follow it there. With a
      ``blend`` β the arm is accelerated and braked at a constant rate during the fraction β of the time at each end;
      the speed between is 1/(1 - β) of the mean speed.
    * ``"minimum_jerk"``: s = 10 τ³ - 15 τ⁴ + 6 τ⁵ with τ = t/T, which has the least ∫ (d³s/dt³)² dt of all that start
      and end at rest; the peak speed is 15/8 of the mean speed.

    Attributes
    ----------
    name : {"constant_speed", "minimum_jerk"}
        Which.
    blend : float
        β, 0 to 0.5; of ``"constant_speed"`` only.

    Notes
    -----
    Thesis Section 5.4.1 for constant speed, which states no blend; Flash and Hogan, J. Neurosci. 5 (1985) 1688 for
    minimum jerk.
    """

    name: str = "minimum_jerk"
    blend: float = 0.0

    def __post_init__(self) -> None:
        as_choice("time law", self.name, TIME_LAWS)
        set_positive(self, "blend", zero=True)
        if self.blend > 0.5:
            raise InvalidInput(f"expected blend as a fraction of the time, at most 0.5 at each end, got {self.blend:g}")
        if self.blend and self.name != "constant_speed":
            raise InvalidInput(f'expected blend with "constant_speed" only, got it with {self.name!r}')

    def values(self, t: FloatArray, duration: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """S, ds/dt and d²s/dt², shape (N,) each, at times from 0 to ``duration``, shape (N,)."""
        x = t / duration
        if self.name == "minimum_jerk":
            s = x**3 * (10.0 + x * (6.0 * x - 15.0))
            rate = 30.0 * x**2 * (1.0 - x) ** 2
            change = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        else:
            s, rate, change = self._constant_speed(x)
        return s, rate / duration, change / duration**2

    def _constant_speed(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        b = self.blend
        if b == 0.0:
            return x.copy(), np.ones_like(x), np.zeros_like(x)
        top = 1.0 / (1.0 - b)
        starts, brakes = x < b, x >= 1.0 - b
        left = 1.0 - x
        s = np.where(starts, 0.5 * top * x**2 / b, np.where(brakes, 1.0 - 0.5 * top * left**2 / b, top * (x - 0.5 * b)))
        rate = top * np.where(starts, x / b, np.where(brakes, left / b, 1.0))
        change = top / b * np.where(starts, 1.0, np.where(brakes, -1.0, 0.0))
        return s, rate, change


def as_time_law(value: Any) -> TimeLaw:
    """Return a TimeLaw from one or from its name."""
    return value if isinstance(value, TimeLaw) else TimeLaw(value)
