"""Laws of springs whose force is no straight line: gas springs, and measured points."""

from __future__ import annotations

import math
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
from .laws import SpringLaw


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
