"""The muscle models of the literature: Chou-Hannaford (3-1) to (3-5) and those of Table 2-4.

Their constants were never printed for the muscle of the source. Those fitted to its tables are parameter sets whose
names begin with "fitted-"; with constants of your own, make the classes yourself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sin, tan
from typing import Any, Self

import numpy as np

from ...core.errors import InvalidInput
from ...core.validation import as_finite, as_positive
from .static import StaticModel


@dataclass(frozen=True, kw_only=True)
class ChouHannaford(StaticModel):
    """Virtual work of a cylinder in an inextensible braid, (3-5): F = P (3 (L_0 - x)² - b²)/(4 π n²).

    Parameters
    ----------
    braid_length : float
        Length b of one thread of the braid, m.
    turns : float
        Turns n of that thread around the muscle.

    Notes
    -----
    Source: thesis (3-5).
    """

    braid_length: float
    turns: float

    def __post_init__(self) -> None:
        super().__post_init__()
        as_positive("braid_length", self.braid_length)
        as_positive("turns", self.turns)

    def _force(self, x: Any, pressure: Any) -> Any:
        length = self.reference_length - x
        return pressure * (3 * length**2 - self.braid_length**2) / (4 * pi * self.turns**2)

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        return -6 * pressure * (self.reference_length - x) / (4 * pi * self.turns**2)

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        return self._force(x, 1.0) + 0.0 * pressure

    def diameter(self, contraction: Any) -> Any:
        """Diameter in m of the cylinder at a contraction in m, (3-3), (3-4), (3-13): sqrt(b² - L²)/(n π).

        The diameter does not depend on the nominal length, as long as the strain is the same.

        Raises
        ------
        InvalidInput
            If the muscle would be longer than its thread.

        Notes
        -----
        Source: thesis (3-3), (3-4), (3-13).
        """
        x = as_finite("contraction", contraction, (), stack=True) * self.scale
        square = self.braid_length**2 - (self.reference_length - x) ** 2
        if np.any(square < 0):
            raise InvalidInput(f"expected a muscle no longer than its thread of {self.braid_length:g} m")
        return np.sqrt(square) / (self.turns * pi)


@dataclass(frozen=True, kw_only=True)
class TonduLopez(StaticModel):
    """Row 2 of Table 2-4: F = π r_0² P (a (1 - ε)² - b) with the strain ε.

    Parameters
    ----------
    radius : float
        Radius r_0 of the muscle at rest, m.
    a, b : float
        Constants; an ideal braid at the angle α_0 has a = 3/tan²α_0 and b = 1/sin²α_0.

    Notes
    -----
    Source: thesis Table 2-4.
    """

    radius: float
    a: float
    b: float

    def __post_init__(self) -> None:
        super().__post_init__()
        as_positive("radius", self.radius)
        as_positive("a", self.a)
        as_positive("b", self.b)

    @classmethod
    def from_braid_angle(cls, radius: float, angle: float, **fields: Any) -> Self:
        """Make one from the braid's angle at rest, rad, between thread and axis, above 0 and below π/2."""
        alpha = as_positive("angle", angle)
        if alpha >= pi / 2:
            raise InvalidInput(f"expected angle below pi/2 rad, got {alpha:g}")
        return cls(radius=radius, a=3 / tan(alpha) ** 2, b=1 / sin(alpha) ** 2, **fields)

    def _force(self, x: Any, pressure: Any) -> Any:
        strain = x / self.reference_length
        return pi * self.radius**2 * pressure * (self.a * (1 - strain) ** 2 - self.b)

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        strain = x / self.reference_length
        return -2 * pi * self.radius**2 * pressure * self.a * (1 - strain) / self.reference_length

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        return self._force(x, 1.0) + 0.0 * pressure


@dataclass(frozen=True, kw_only=True)
class Colbrunn(ChouHannaford):
    """Row 1 of Table 2-4: F = P b²/(4 π n²) (3 L²/b² - 1) Eff(P) + F_limit for L > L_min, else 0.

    Parameters
    ----------
    efficiency : sequence of float
        Coefficients of the correction Eff(P) in ascending powers of P in Pa; the source leaves its form open.
    limit_force : float
        The additive F_max limit of the table, N. Its footnote calls it the largest force at the pressure, which as
        a summand would pull without air; 0 leaves it out.
    least_length : float
        L_min in m, of the reference muscle. The table has no shorter muscles: here they pull with 0 N,
        being fully contracted.

    Notes
    -----
    Source: thesis Table 2-4.
    """

    efficiency: Sequence[float]
    limit_force: float
    least_length: float

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "efficiency", tuple(as_finite("efficiency", self.efficiency, (None,)).tolist()))
        if not self.efficiency:
            raise InvalidInput("expected efficiency to hold at least one coefficient, got none")
        as_finite("limit_force", self.limit_force, ())
        as_positive("least_length", self.least_length, zero=True)

    def _longer(self, x: Any) -> Any:
        return np.where(self.reference_length - x > self.least_length, 1.0, 0.0)

    def _force(self, x: Any, pressure: Any) -> Any:
        corrected = super()._force(x, pressure) * np.polynomial.polynomial.polyval(pressure, self.efficiency)
        return self._longer(x) * (corrected + self.limit_force)

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        eff = np.polynomial.polynomial.polyval(pressure, self.efficiency)
        return self._longer(x) * super()._stiffness(x, pressure) * eff

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        # d(P Eff(P))/dP, with P Eff(P) the polynomial one power up.
        slope = np.polynomial.polynomial.polyder(np.concatenate(([0.0], np.asarray(self.efficiency))))
        return self._longer(x) * super()._force(x, 1.0) * np.polynomial.polynomial.polyval(pressure, slope)


@dataclass(frozen=True, kw_only=True)
class Wickramatunge(StaticModel):
    """Row 4 of Table 2-4: F = K L_s with K = a_0 P² + a_1 P L_s + a_2 L_s² + a_3 and L_s the stretched length.

    Parameters
    ----------
    rest_length : float
        Length in m of the muscle with no stretch, so that L_s = L_0 - x - rest_length.
    a_0, a_1, a_2, a_3 : float
        N/(m Pa²), N/(m² Pa), N/m³, N/m.

    Notes
    -----
    Source: thesis Table 2-4.
    """

    rest_length: float
    a_0: float
    a_1: float
    a_2: float
    a_3: float

    def __post_init__(self) -> None:
        super().__post_init__()
        as_positive("rest_length", self.rest_length)
        for key in ("a_0", "a_1", "a_2", "a_3"):
            as_finite(key, getattr(self, key), ())

    def _stretch(self, x: Any) -> Any:
        return self.reference_length - x - self.rest_length

    def _force(self, x: Any, pressure: Any) -> Any:
        s = self._stretch(x)
        return (self.a_0 * pressure**2 + self.a_1 * pressure * s + self.a_2 * s**2 + self.a_3) * s

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        s = self._stretch(x)
        return -(self.a_0 * pressure**2 + 2 * self.a_1 * pressure * s + 3 * self.a_2 * s**2 + self.a_3)

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        s = self._stretch(x)
        return (2 * self.a_0 * pressure + self.a_1 * s) * s
