"""Laws of springs: the force at a length, or the torque at an angle.

Each returns the force with which a spring **pulls** its ends together at length x (of a routed spring), or the torque
with which it turns its joint towards smaller coordinates at coordinate x. A law also gives its stored energy, whose
derivative by x is the force, so that a force and a work can be checked against each other.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.fields import set_fields, set_positive
from ...core.validation import FloatArray, as_finite

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator


class SpringLaw(ABC):
    """The force of a spring as a function of one coordinate; SI: N and m of a length, N m and rad of an angle."""

    @abstractmethod
    def force(self, x: ArrayLike) -> FloatArray:
        """Pull at coordinate x, shape (...), N or N m."""

    @abstractmethod
    def energy(self, x: ArrayLike) -> FloatArray:
        """Stored energy at x, shape (...), J, up to a constant."""


@checked
@dataclass(frozen=True)
class ConstantForce(SpringLaw):
    """The same force at every length, as of a spring that rolls up.

    Attributes
    ----------
    value : float
        N or N m.
    """

    value: float

    def __post_init__(self) -> None:
        set_fields(self, value=float(as_finite("value", self.value, ())))

    def force(self, x: ArrayLike) -> FloatArray:
        """The value itself."""
        return np.full(np.shape(x), self.value)

    def energy(self, x: ArrayLike) -> FloatArray:
        """Its product with x."""
        return np.asarray(self.value * np.asarray(x, dtype=float))


@checked
@dataclass(frozen=True)
class LinearSpring(SpringLaw):
    """k (x - x₀); a spring that only pulls is slack below x₀.

    Attributes
    ----------
    stiffness : float
        k, N/m or N m/rad, above zero.
    slack : float
        x₀, m or rad.
    only_pulls : bool
        Whether it goes slack, as a spring in a cable does.
    """

    stiffness: float
    slack: float = 0.0
    only_pulls: bool = False

    def __post_init__(self) -> None:
        set_positive(self, "stiffness")
        set_fields(self, slack=float(as_finite("slack", self.slack, ())))

    def _stretch(self, x: ArrayLike) -> FloatArray:
        stretch = np.asarray(x, dtype=float) - self.slack
        return np.maximum(stretch, 0.0) if self.only_pulls else stretch

    def force(self, x: ArrayLike) -> FloatArray:
        """Stiffness times stretch."""
        return np.asarray(self.stiffness * self._stretch(x))

    def energy(self, x: ArrayLike) -> FloatArray:
        """Half the stiffness times the square of the stretch."""
        return np.asarray(0.5 * self.stiffness * self._stretch(x) ** 2)


@checked
@dataclass(frozen=True)
class GasSpring(SpringLaw):
    """A gas spring, which pushes: its gas is compressed polytropically as the spring shortens.

    -F₀ ((1 + (L₀ - x) / c))ⁿ, with the force F₀ at the extended length L₀ and the height c of the gas column there.

    Attributes
    ----------
    extended_force : float
        F₀, N, above zero.
    extended_length : float
        L₀, m.
    gas_height : float
        c, m: volume of the gas at L₀ over the area of the rod.
    exponent : float
        n: 1 for a slow, isothermal motion.
    """

    extended_force: float
    extended_length: float
    gas_height: float
    exponent: float = 1.0

    def __post_init__(self) -> None:
        set_positive(self, "extended_force", "extended_length", "gas_height", "exponent")

    def _ratio(self, x: ArrayLike) -> FloatArray:
        left = self.gas_height - (self.extended_length - np.asarray(x, dtype=float))
        if (left <= 0.0).any():
            shortest = self.extended_length - self.gas_height
            raise InvalidInput(f"expected a gas spring longer than {shortest:g} m, got {np.min(x):g} m")
        return self.gas_height / left

    def force(self, x: ArrayLike) -> FloatArray:
        """Negative: it pushes."""
        return np.asarray(-self.extended_force * self._ratio(x) ** self.exponent)

    def energy(self, x: ArrayLike) -> FloatArray:
        """Work that compressed the gas."""
        ratio, n = self._ratio(x), self.exponent
        scale = self.extended_force * self.gas_height
        return np.asarray(scale * (np.log(ratio) if n == 1.0 else (ratio ** (n - 1.0) - 1.0) / (n - 1.0)))


@checked
@dataclass(frozen=True)
class TableLaw(SpringLaw):
    """Measured points, joined by the monotone cubic curves of Fritsch and Carlson (SciPy's Pchip).

    Attributes
    ----------
    coordinates : tuple of float
        x of the points, rising, m or rad.
    forces : tuple of float
        Pull there, N or N m.
    """

    coordinates: tuple[float, ...]
    forces: tuple[float, ...]

    def __post_init__(self) -> None:
        x, y = (as_finite(name, getattr(self, name), (None,)) for name in ("coordinates", "forces"))
        if len(x) != len(y) or len(x) < 2 or (np.diff(x) <= 0.0).any():
            raise InvalidInput(f"expected two or more rising coordinates, each with a force, got {len(x)} and {len(y)}")
        set_fields(self, coordinates=tuple(x.tolist()), forces=tuple(y.tolist()))

    @cached_property
    def _curve(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator  # here: it loads half of SciPy, and few devices have a table

        return PchipInterpolator(self.coordinates, self.forces, extrapolate=False)

    @cached_property
    def _integral(self) -> PchipInterpolator:
        return self._curve.antiderivative()

    def _inside(self, x: ArrayLike) -> FloatArray:
        value, (low, *_, high) = np.asarray(x, dtype=float), self.coordinates
        if (value < low).any() or (value > high).any():
            raise InvalidInput(f"expected a coordinate from {low:g} to {high:g}, the ends of the table, got {value}")
        return value

    def force(self, x: ArrayLike) -> FloatArray:
        """The curve; outside the table an error."""
        return np.asarray(self._curve(self._inside(x)))

    def energy(self, x: ArrayLike) -> FloatArray:
        """Its integral from the first point."""
        return np.asarray(self._integral(self._inside(x)))
