"""Coulomb friction (3-16) and damping (3-21) of a muscle, with the ranges in which they oppose the motion.

As printed, both can drive the motion instead: the Coulomb term (P + φ)(N_2 x² + N_1 x + N_0) is negative where a
factor is, and the damping P (D_1 v² + D_2 v) pushes where D_1 v + D_2 < 0, above 0.8 m/s for (3-30). Those states
are outside the range of the laws here. Pressures of the printed coefficients are in bar, contraction in m.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Self

from ...core.errors.checked import checked
from ...core.validation import as_finite, as_positive
from .static import BAR


class FrictionLaw(ABC):
    """Bound of the Coulomb friction: at rest any force up to it, sliding all of it against the motion."""

    @abstractmethod
    def factors(self, x: Any, pressure: Any, mass: float) -> tuple[Any, ...]:
        """Return the factors of the law at x (m), pressure (Pa), mass (kg), none negative where it is friction."""

    def printed(self, x: Any, pressure: Any, mass: float) -> Any:
        """Bound in N as the formula gives it, negative where the formula is no friction."""
        product: Any = 1.0
        for factor in self.factors(x, pressure, mass):
            product = product * factor
        return product

    def bound(self, x: float, pressure: float, mass: float) -> float:
        """Bound in N, zero where a factor of the formula is negative (two negatives make no friction)."""
        product = 1.0
        for factor in self.factors(x, pressure, mass):
            if factor <= 0.0:
                return 0.0
            product *= factor
        return product


@dataclass(frozen=True)
class ConstantFriction(FrictionLaw):
    """Constant Coulomb friction, the 2.5 N that Chou and Hannaford suggest (Figures 3-3 and 3-4).

    Parameters
    ----------
    force : float
        N, zero or more.
    """

    force: float = 2.5

    def __post_init__(self) -> None:
        as_positive("force", self.force, zero=True)

    def factors(self, x: Any, pressure: Any, mass: float) -> tuple[Any, ...]:
        """See :meth:`FrictionLaw.factors`."""
        return (self.force + 0.0 * x + 0.0 * pressure,)


@checked
@dataclass(frozen=True)
class LoadDependentFriction(FrictionLaw):
    """(3-16): (P + φ(F_ext)) (N_2 x² + N_1 x + N_0) with φ = -m for a hung mass.

    Parameters
    ----------
    N_2, N_1, N_0 : float
        N/(m² Pa), N/(m Pa), N/Pa.
    load : float
        How much pressure a kg takes off, Pa/kg; the source's φ = -m, with m in kg and P in bar, is 1e5.

    Notes
    -----
    Source: thesis (3-15), (3-16).
    """

    N_2: float
    N_1: float
    N_0: float
    load: float

    def __post_init__(self) -> None:
        for key in ("N_2", "N_1", "N_0", "load"):
            as_finite(key, getattr(self, key), ())

    @classmethod
    def from_bar(cls, N_2: float, N_1: float, N_0: float, load_bar_per_kg: float = 1.0) -> Self:
        """Make one from coefficients in N/(m² bar), N/(m bar), N/bar and bar/kg."""
        return cls(N_2 / BAR, N_1 / BAR, N_0 / BAR, load_bar_per_kg * BAR)

    def factors(self, x: Any, pressure: Any, mass: float) -> tuple[Any, ...]:
        """See :meth:`FrictionLaw.factors`; the first is P + φ in Pa, the second the polynomial in N/Pa."""
        return pressure - self.load * mass, (self.N_2 * x + self.N_1) * x + self.N_0


@checked
@dataclass(frozen=True)
class Damping:
    """(3-21): P (D_1 v² + D_2 v), v the speed of shortening.

    Parameters
    ----------
    D_1 : float
        N s²/(m² Pa).
    D_2 : float
        N s/(m Pa).

    Notes
    -----
    Source: thesis (3-19), (3-21).
    """

    D_1: float
    D_2: float

    def __post_init__(self) -> None:
        as_finite("D_1", self.D_1, ())
        as_finite("D_2", self.D_2, ())

    @classmethod
    def from_bar(cls, D_1: float, D_2: float) -> Self:
        """Make one from coefficients in N s²/(m² bar) and N s/(m bar)."""
        return cls(D_1 / BAR, D_2 / BAR)

    def rate(self, velocity: Any) -> Any:
        """D_1 v + D_2 in N s/(m Pa): the law damps where this is zero or more."""
        return self.D_1 * velocity + self.D_2

    def printed(self, velocity: Any, pressure: Any) -> Any:
        """Force in N against the motion as the formula gives it."""
        return pressure * self.rate(velocity) * velocity
