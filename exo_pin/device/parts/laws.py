"""Laws of springs: the force at a length, or the torque at an angle.

Each returns the force with which a spring **pulls** its ends together at length x (of a routed spring), or the torque
with which it turns its joint towards smaller coordinates at coordinate x: minus the joint's effort, which a device
file states. A law also gives its stored energy, whose derivative by x is the force, so that a force and a work can be
checked against each other. Beyond the range that a law covers nothing is known of the spring: a pose there is not
evaluated.

Laws of springs whose force is no straight line: gas springs, and measured points.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_finite, set_fields, set_positive

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

#: Part of its range by which a coordinate may be beyond an end of a law: rounding, as of a pose at the end itself.
_ROUNDING = 1e-9


class SpringLaw(ABC):
    """The force of a spring as a function of one coordinate; SI: N and m of a length, N m and rad of an angle.

    Examples
    --------
    >>> from exo_pin.device import SpringLaw
    >>> class Hardening(SpringLaw):
    ...     def force(self, x):
    ...         return 2e5 * np.asarray(x) ** 3
    ...
    ...     def energy(self, x):
    ...         return 5e4 * np.asarray(x) ** 4
    >>> round(float(Hardening().force(0.1)), 6)  # N
    200.0
    >>> Hardening().range  # m: it says nothing of its ends
    (-inf, inf)
    """

    #: What its range is called in texts.
    source = "law"

    @abstractmethod
    def force(self, x: ArrayLike) -> FloatArray:
        """Pull at coordinate x, shape (...), N or N m."""

    @abstractmethod
    def energy(self, x: ArrayLike) -> FloatArray:
        """Stored energy at x, shape (...), J, up to a constant."""

    @property
    def range(self) -> tuple[float, float]:
        """Coordinates that the law covers, m or rad, both ends included; infinite where it has no end."""
        return -math.inf, math.inf


def covered_force(law: SpringLaw, x: ArrayLike) -> FloatArray:
    """Force of a law at coordinates, shape (...), N or N m; NaN where the law does not cover them.

    Parameters
    ----------
    law : SpringLaw
        The law.
    x : array_like
        Shape (...), m or rad; beyond an end of a range by no more than rounding counts as the end.
    """
    at, (low, high) = np.asarray(x, dtype=float), law.range
    slack = _ROUNDING * (high - low) if np.isfinite(high - low) else 0.0
    inside = (low - slack <= at) & (at <= high + slack)
    force = np.full(at.shape, np.nan)
    force[inside] = law.force(np.clip(at[inside], low, high))
    return np.where(np.isfinite(force), force, np.nan)


@checked
@dataclass(frozen=True)
class ConstantForce(SpringLaw):
    """The same force at every length, as of a spring that rolls up.

    Attributes
    ----------
    value : float
        N or N m.

    Examples
    --------
    >>> from exo_pin.device import ConstantForce
    >>> roll = ConstantForce(25.0)
    >>> work = roll.energy(0.3) - roll.energy(0.1)
    >>> round(float(work), 6)  # J, of 25 N over 0.2 m
    5.0
    """

    value: float

    def __post_init__(self) -> None:
        set_fields(self, value=float(as_finite("value", self.value, ())))

    def force(self, x: ArrayLike) -> FloatArray:
        """The value itself.

        Parameters
        ----------
        x : array_like
            Shape (...), m or rad.

        Returns
        -------
        ndarray
            Shape (...), N or N m.

        Examples
        --------
        >>> from exo_pin.device import ConstantForce
        >>> ConstantForce(12.0).force([0.1, 0.5])  # N, at any length
        array([12., 12.])
        """
        return np.full(np.shape(x), self.value)

    def energy(self, x: ArrayLike) -> FloatArray:
        """Its product with x.

        Parameters
        ----------
        x : array_like
            Shape (...), m or rad.

        Returns
        -------
        ndarray
            Shape (...), J.

        Examples
        --------
        >>> from exo_pin.device import ConstantForce
        >>> float(ConstantForce(40.0).energy(0.25))  # J
        10.0
        """
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

    Examples
    --------
    >>> from exo_pin.device import LinearSpring
    >>> spring = LinearSpring(stiffness=500.0, slack=0.2)
    >>> round(float(spring.force(0.26)), 6), round(float(spring.energy(0.26)), 6)  # N; J, ½ k x²
    (30.0, 0.9)
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
        """Stiffness times stretch.

        Parameters
        ----------
        x : array_like
            Shape (...), m or rad.

        Returns
        -------
        ndarray
            Shape (...), N or N m.

        Examples
        --------
        >>> from exo_pin.device import LinearSpring
        >>> cord = LinearSpring(stiffness=300.0, slack=0.4, only_pulls=True)
        >>> cord.force([0.3, 0.4, 0.5]).round(6)  # N; slack below 0.4 m
        array([ 0.,  0., 30.])
        """
        return np.asarray(self.stiffness * self._stretch(x))

    def energy(self, x: ArrayLike) -> FloatArray:
        """Half the stiffness times the square of the stretch.

        Parameters
        ----------
        x : array_like
            Shape (...), m or rad.

        Returns
        -------
        ndarray
            Shape (...), J.

        Examples
        --------
        >>> from exo_pin.device import LinearSpring
        >>> torsion = LinearSpring(stiffness=8.0)  # N m/rad
        >>> round(float(torsion.energy(np.radians(90.0))), 3)  # J; ½ × 8 × (π/2)²
        9.87
        """
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

    Examples
    --------
    >>> from exo_pin.device import GasSpring
    >>> strut = GasSpring(extended_force=100.0, extended_length=0.3, gas_height=0.2)
    >>> round(float(strut.force(0.3)), 6)  # N; it pushes
    -100.0
    """

    extended_force: float
    extended_length: float
    gas_height: float
    exponent: float = 1.0

    source = "gas column"

    def __post_init__(self) -> None:
        set_positive(self, "extended_force", "extended_length", "gas_height", "exponent")

    @property
    def range(self) -> tuple[float, float]:
        """From the least length above that of no gas, m, without an upper end."""
        # Differences of numbers round, and the law divides by this one.
        shortest = self.extended_length - self.gas_height
        return shortest + 1e-9 * self.gas_height, math.inf

    def _ratio(self, x: ArrayLike) -> FloatArray:
        left = self.gas_height - (self.extended_length - np.asarray(x, dtype=float))
        if (left <= 0.0).any():
            shortest = self.extended_length - self.gas_height
            raise InvalidInput(f"expected a gas spring longer than {shortest:g} m, got {np.min(x):g} m")
        return self.gas_height / left

    def force(self, x: ArrayLike) -> FloatArray:
        """Negative: it pushes.

        Parameters
        ----------
        x : array_like
            Length, shape (...), m.

        Returns
        -------
        ndarray
            Shape (...), N.

        Examples
        --------
        >>> from exo_pin.device import GasSpring
        >>> strut = GasSpring(extended_force=100.0, extended_length=0.3, gas_height=0.2)
        >>> round(float(strut.force(0.2)), 6)  # N, with half of the gas's volume
        -200.0
        """
        return np.asarray(-self.extended_force * self._ratio(x) ** self.exponent)

    def energy(self, x: ArrayLike) -> FloatArray:
        """Work that compressed the gas.

        Parameters
        ----------
        x : array_like
            Length, shape (...), m.

        Returns
        -------
        ndarray
            Shape (...), J.

        Examples
        --------
        >>> from exo_pin.device import GasSpring
        >>> strut = GasSpring(extended_force=100.0, extended_length=0.3, gas_height=0.2)
        >>> step = 1e-5
        >>> slope = (strut.energy(0.25 + step) - strut.energy(0.25 - step)) / (2.0 * step)
        >>> round(float(slope / strut.force(0.25)), 6)  # the force is the energy's derivative
        1.0
        """
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

    Examples
    --------
    >>> from exo_pin.device import TableLaw
    >>> law = TableLaw((0.0, 0.1, 0.2), (0.0, 30.0, 60.0))
    >>> float(law.force(0.15).round(6))  # N, between measured points on a line
    45.0
    """

    coordinates: tuple[float, ...]
    forces: tuple[float, ...]

    source = "table"

    def __post_init__(self) -> None:
        x, y = (as_finite(name, getattr(self, name), (None,)) for name in ("coordinates", "forces"))
        if len(x) != len(y) or len(x) < 2 or (np.diff(x) <= 0.0).any():
            raise InvalidInput(f"expected two or more rising coordinates, each with a force, got {len(x)} and {len(y)}")
        set_fields(self, coordinates=tuple(x.tolist()), forces=tuple(y.tolist()))

    @property
    def range(self) -> tuple[float, float]:
        """First and last coordinate, m or rad."""
        return self.coordinates[0], self.coordinates[-1]

    @cached_property
    def _curve(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator  # here: it loads half of SciPy, and few devices have a table

        return PchipInterpolator(self.coordinates, self.forces, extrapolate=False)

    @cached_property
    def _integral(self) -> PchipInterpolator:
        return self._curve.antiderivative()

    def _inside(self, x: ArrayLike) -> FloatArray:
        value, (low, high) = np.asarray(x, dtype=float), self.range
        if (value < low).any() or (value > high).any():
            raise InvalidInput(f"expected a coordinate from {low:g} to {high:g}, the ends of the table, got {value}")
        return value

    def force(self, x: ArrayLike) -> FloatArray:
        """The curve; outside the table an error.

        Parameters
        ----------
        x : array_like
            Shape (...), m or rad.

        Returns
        -------
        ndarray
            Shape (...), N or N m.

        Raises
        ------
        InvalidInput
            If x is outside the table.

        Examples
        --------
        >>> from exo_pin.device import TableLaw
        >>> law = TableLaw((0.2, 0.3, 0.4), (0.0, 12.0, 40.0))
        >>> law.force([0.2, 0.3, 0.4]).round(6)  # N, through the points
        array([ 0., 12., 40.])
        """
        return np.asarray(self._curve(self._inside(x)))

    def energy(self, x: ArrayLike) -> FloatArray:
        """Its integral from the first point.

        Parameters
        ----------
        x : array_like
            Shape (...), m or rad.

        Returns
        -------
        ndarray
            Shape (...), J.

        Examples
        --------
        >>> from exo_pin.device import TableLaw
        >>> law = TableLaw((0.0, 0.1, 0.2), (0.0, 30.0, 60.0))  # 300 N/m
        >>> float(law.energy(0.2).round(6))  # J; ½ × 300 × 0.2²
        6.0
        """
        return np.asarray(self._integral(self._inside(x)))
