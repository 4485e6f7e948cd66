"""Coulomb friction (3-16) and damping (3-21) of a muscle, with the ranges in which they oppose the motion.

As printed, both can drive the motion instead: the Coulomb term (P + φ)(N_2 x² + N_1 x + N_0) is negative where a
factor is, and the damping P (D_1 v² + D_2 v) pushes where D_1 v + D_2 < 0, above 0.8 m/s for (3-30). Those states
are outside the range of the laws here. Pressures of the printed coefficients are in bar, contraction in m.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import prod
from typing import Any, Self

from ...core.errors.checked import checked
from ...core.validation import as_finite, as_positive
from .static import BAR


class FrictionLaw(ABC):
    """Bound of the Coulomb friction: at rest any force up to it, sliding all of it against the motion.

    Examples
    --------
    >>> from exo_pin.muscle import ConstantFriction, FrictionLaw, LoadDependentFriction
    >>> [issubclass(law, FrictionLaw) for law in (ConstantFriction, LoadDependentFriction)]
    [True, True]
    """

    @abstractmethod
    def factors(self, x: Any, pressure: Any, mass: float) -> tuple[Any, ...]:
        """Return the factors of the law at x (m), pressure (Pa), mass (kg), none negative where it is friction.

        Examples
        --------
        >>> law = ep.muscle.dynamic_model("tang-3-31").friction
        >>> pressure, per_pascal = law.factors(0.03, 3e5, 1.0)  # Pa, N/Pa
        >>> round(1e-5 * pressure, 9), round(pressure * per_pascal / law.bound(0.03, 3e5, 1.0), 9)  # bar: 3 less 1
        (2.0, 1.0)
        """

    def printed(self, x: Any, pressure: Any, mass: float) -> Any:
        """Bound in N as the formula gives it, negative where the formula is no friction.

        Parameters
        ----------
        x, pressure, mass : float
            Contraction, m, positive when shorter; gauge pressure, Pa; hung mass, kg.

        Returns
        -------
        float or ndarray
            N.

        Examples
        --------
        >>> law = ep.muscle.LoadDependentFriction.from_bar(0.0, 0.0, 2.0)
        >>> law.printed(0.0, 1e5, 3.0), law.bound(0.0, 1e5, 3.0)  # N: (1 - 3) bar · 2 N/bar is no friction
        (-4.0, 0.0)
        """
        return prod(self.factors(x, pressure, mass))

    def bound(self, x: float, pressure: float, mass: float) -> float:
        """Bound in N, zero where a factor of the formula is negative (two negatives make no friction).

        Parameters
        ----------
        x, pressure, mass : float
            Contraction, m, positive when shorter; gauge pressure, Pa; hung mass, kg.

        Returns
        -------
        float
            N.

        Examples
        --------
        >>> law = ep.muscle.dynamic_model("tang-3-31").friction
        >>> [round(law.bound(0.03, pressure, 1.0), 2) for pressure in (2e5, 3e5)]  # N: more air, more friction
        [4.36, 8.73]
        """
        product = 1.0
        for factor in self.factors(x, pressure, mass):
            if factor <= 0.0:
                return 0.0
            product *= factor
        return product


@checked
@dataclass(frozen=True)
class ConstantFriction(FrictionLaw):
    """Constant Coulomb friction, the 2.5 N that Chou and Hannaford suggest (Figures 3-3 and 3-4).

    Parameters
    ----------
    force : float
        N, zero or more.

    Examples
    --------
    >>> ep.muscle.ConstantFriction().bound(0.02, 3e5, 1.0)  # N, whatever the contraction, pressure and mass
    2.5
    """

    force: float = 2.5

    def __post_init__(self) -> None:
        as_positive("force", self.force, zero=True)

    def factors(self, x: Any, pressure: Any, mass: float) -> tuple[Any, ...]:
        """See :meth:`FrictionLaw.factors`.

        Parameters
        ----------
        x, pressure, mass : float
            Contraction, m, positive when shorter; gauge pressure, Pa; hung mass, kg.

        Returns
        -------
        tuple
            One factor, N.

        Examples
        --------
        >>> ep.muscle.ConstantFriction(1.5).factors(0.02, 3e5, 1.0)  # N
        (1.5,)
        """
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

    Examples
    --------
    >>> law = ep.muscle.LoadDependentFriction.from_bar(0.0, 0.0, 2.0)
    >>> round(law.bound(0.0, 3e5, 1.0), 9)  # N: 2 N/bar, at 3 bar less 1 bar for 1 kg
    4.0
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
        """Make one from coefficients in N/(m² bar), N/(m bar), N/bar and bar/kg.

        Parameters
        ----------
        N_2, N_1, N_0 : float
            N/(m² bar), N/(m bar) and N/bar.
        load_bar_per_kg : float
            By how many bar a hung kg lowers P in the first factor, bar/kg.

        Returns
        -------
        LoadDependentFriction
            The same law in N/(m² Pa), N/(m Pa), N/Pa and Pa/kg.

        Examples
        --------
        >>> law = ep.muscle.LoadDependentFriction.from_bar(0.0, 0.0, 2.0, load_bar_per_kg=0.25)
        >>> round(law.load), round(law.bound(0.0, 2e5, 4.0), 9)  # Pa/kg; N: 2 N/bar, at 2 bar less 1 for 4 kg
        (25000, 2.0)
        """
        return cls(N_2 / BAR, N_1 / BAR, N_0 / BAR, load_bar_per_kg * BAR)

    def factors(self, x: Any, pressure: Any, mass: float) -> tuple[Any, ...]:
        """See :meth:`FrictionLaw.factors`; the first is P + φ in Pa, the second the polynomial in N/Pa.

        Parameters
        ----------
        x, pressure, mass : float
            Contraction, m, positive when shorter; gauge pressure, Pa; hung mass, kg.

        Returns
        -------
        tuple
            Two factors, Pa and N/Pa; either may be negative.

        Examples
        --------
        >>> law = ep.muscle.LoadDependentFriction.from_bar(0.0, 100.0, 2.0, load_bar_per_kg=0.5)
        >>> pressure, per_pascal = law.factors(0.01, 3e5, 2.0)
        >>> round(1e-5 * pressure, 9), round(1e5 * per_pascal, 9)  # 3 bar less 1 for 2 kg; 2 + 100 · 0.01 N/bar
        (2.0, 3.0)
        """
        return pressure - self.load * mass, (self.N_2 * x + self.N_1) * x + self.N_0


@checked
@dataclass(frozen=True)
class Damping:
    """(3-21): P (D_1 v² + D_2 v), v the speed of shortening.

    Parameters
    ----------
    D_1, D_2 : float
        N s²/(m² Pa) and N s/(m Pa).

    Notes
    -----
    Source: thesis (3-19), (3-21).

    Examples
    --------
    >>> law = ep.muscle.Damping.from_bar(0.0, 10.0)
    >>> round(law.printed(0.05, 2e5), 9)  # N: 10 N s/(m bar) · 2 bar · 0.05 m/s
    1.0
    """

    D_1: float
    D_2: float

    def __post_init__(self) -> None:
        as_finite("D_1", self.D_1, ())
        as_finite("D_2", self.D_2, ())

    @classmethod
    def from_bar(cls, D_1: float, D_2: float) -> Self:
        """Make one from coefficients in N s²/(m² bar) and N s/(m bar).

        Parameters
        ----------
        D_1, D_2 : float
            N s²/(m² bar) and N s/(m bar).

        Returns
        -------
        Damping

        Examples
        --------
        >>> round(1e5 * ep.muscle.Damping.from_bar(0.0, 15.0).D_2, 9)  # N s/(m bar)
        15.0
        """
        return cls(D_1 / BAR, D_2 / BAR)

    def rate(self, velocity: Any) -> Any:
        """D_1 v + D_2 in N s/(m Pa): the law damps where this is zero or more.

        Parameters
        ----------
        velocity : float or array_like
            Speed of shortening, m/s: positive where the muscle shortens.

        Returns
        -------
        float or numpy.ndarray
            N s/(m Pa).

        Examples
        --------
        >>> law = ep.muscle.Damping.from_bar(100.0, 10.0)
        >>> law.rate(-0.1), law.rate(-0.2) < 0.0  # at 0.1 m/s back the two cancel; faster, the formula would drive
        (0.0, True)
        """
        return self.D_1 * velocity + self.D_2

    def printed(self, velocity: Any, pressure: Any) -> Any:
        """Force in N against the motion as the formula gives it.

        Parameters
        ----------
        velocity : float or array_like
            Speed of shortening, m/s: positive where the muscle shortens.
        pressure : float or array_like
            Gauge, Pa.

        Returns
        -------
        float or numpy.ndarray
            N, what the muscle pulls less: positive against shortening, negative against lengthening.

        Examples
        --------
        >>> law = ep.muscle.Damping.from_bar(100.0, 20.0)
        >>> round(law.printed(0.1, 3e5), 9), round(law.printed(-0.1, 3e5), 9)  # N: v² has no sign
        (9.0, -3.0)
        """
        return pressure * self.rate(velocity) * velocity
