"""Force laws of muscles: polynomials in contraction and pressure, (3-10) among them, and Chou and Hannaford's.

The constants of Chou and Hannaford's model, (3-1) to (3-5), were never printed for the muscle of the source; those
fitted to its tables are "fitted-chou-hannaford".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi, sin, tan
from typing import Any, Self

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_finite, as_mapping, as_positive, set_fields
from .static import BAR, StaticModel


@checked
@dataclass(frozen=True, kw_only=True)
class PolynomialModel(StaticModel):
    """Sum of c_ij x^i P^j; (3-10) is the one with i up to 2 and j up to 1.

    Parameters
    ----------
    coefficients : mapping
        From (i, j), the powers of contraction and pressure, to c_ij in N m^-i Pa^-j.

    Examples
    --------
    >>> from exo_pin.muscle import PolynomialModel, Validity
    >>> limits = Validity(strain=(0.0, 0.3), pressure=(0.0, 4e5))
    >>> numbers = {(0, 1): 1e-4, (1, 0): -500.0}
    >>> law = PolynomialModel(name="linear", reference_length=0.2, validity=limits, coefficients=numbers)
    >>> float(law.force(0.02, 3e5))  # N: 1e-4 m² of area times the pressure, less 500 N/m
    20.0
    """

    coefficients: Mapping[tuple[int, int], float]
    _terms: tuple[tuple[int, int, float], ...] = field(init=False, repr=False, compare=False, default=())

    def __post_init__(self) -> None:
        super().__post_init__()
        if not as_mapping("coefficients", self.coefficients, "powers to numbers"):
            raise InvalidInput("expected coefficients to hold at least one term, got none")
        table: dict[tuple[int, int], float] = {}
        for powers, value in self.coefficients.items():
            if np.shape(powers) != (2,):
                raise InvalidInput(f"expected powers (i, j), got {echo(powers)}")
            i, j = powers
            if int(i) != i or int(j) != j or i < 0 or j < 0:
                raise InvalidInput(f"expected the powers to be whole numbers of zero or more, got {powers!r}")
            table[(int(i), int(j))] = float(as_finite(f"coefficient {powers}", value, ()))
        set_fields(self, coefficients=table, _terms=tuple((i, j, c) for (i, j), c in table.items()))

    @classmethod
    def from_bar(cls, coefficients: Mapping[tuple[int, int], float], **fields: Any) -> Self:
        """Make one from coefficients in N m^-i bar^-j, the way the source prints them.

        Parameters
        ----------
        coefficients : mapping of (int, int) to float
            By the powers (i, j) of x in m and P in bar.
        **fields
            Further fields of the model.

        Returns
        -------
        PolynomialModel

        Examples
        --------
        >>> from exo_pin.muscle import PolynomialModel, Validity
        >>> limits = Validity(strain=(0.0, 0.3), pressure=(0.0, 4e5))
        >>> law = PolynomialModel.from_bar({(0, 1): 12.0}, name="bar", reference_length=0.2, validity=limits)
        >>> round(float(law.force(0.0, 2.5e5)), 9)  # N: 12 N/bar at 2.5 bar
        30.0
        """
        return cls(coefficients={(i, j): c / BAR**j for (i, j), c in coefficients.items()}, **fields)

    @classmethod
    def second_order(
        cls, K_1: float, K_2: float, C_1: float, S_1: float, S_2: float, S_3: float, **fields: Any
    ) -> Self:
        """(3-10): F = (K_1 x² + K_2 x + C_1) P + S_1 x² + S_2 x + S_3 with x in m, P in bar, F in N.

        Parameters
        ----------
        K_1, K_2, C_1 : float
            N/(m² bar), N/(m bar), N/bar.
        S_1, S_2, S_3 : float
            N/m², N/m, N.
        **fields
            ``name``, ``reference_length``, ``validity`` and the other fields of the model.

        Returns
        -------
        PolynomialModel

        Notes
        -----
        Source: thesis (3-6), (3-7), (3-8), (3-9), (3-10), (A-3).

        Examples
        --------
        >>> from exo_pin.muscle import PolynomialModel, Validity
        >>> limits = Validity(strain=(0.0, 0.3), pressure=(0.0, 4e5))
        >>> numbers = {"K_1": 0.0, "K_2": -200.0, "C_1": 20.0, "S_1": 0.0, "S_2": 0.0, "S_3": -3.0}
        >>> law = PolynomialModel.second_order(**numbers, name="mine", reference_length=0.2, validity=limits)
        >>> round(float(law.force(0.02, 2e5)), 9)  # N: (20 - 200 · 0.02) 2 - 3
        29.0
        """
        terms = {(2, 1): K_1, (1, 1): K_2, (0, 1): C_1, (2, 0): S_1, (1, 0): S_2, (0, 0): S_3}
        return cls.from_bar(terms, **fields)

    @classmethod
    def tondu_lopez(
        cls, diameter: float, braid_angle: float, reference_length: float, k: float = 1.0, **fields: Any
    ) -> Self:
        """Law of Tondu and Lopez: F = (π/4) D² P (a (1 - k ε)² - b), a = 3/tan² α, b = 1/sin² α, ε the strain.

        Parameters
        ----------
        diameter : float
            D of the muscle at rest, m.
        braid_angle : float
            α between thread and axis at rest, rad.
        reference_length : float
            Nominal length, m.
        k : float
            How much more the muscle contracts than a cylinder, for its round ends: 1 is a cylinder. It is measured, and
            no value is taken as known here.
        **fields
            ``name``, ``validity`` and the other fields of the model.

        Returns
        -------
        PolynomialModel

        Notes
        -----
        Source: thesis Table 2-4.

        Examples
        --------
        >>> from exo_pin.muscle import PolynomialModel, Validity
        >>> limits = Validity(strain=(0.0, 0.3), pressure=(0.0, 5e5))
        >>> law = PolynomialModel.tondu_lopez(0.010, np.radians(25), 0.25, name="braid", validity=limits)
        >>> slack = 1 - np.cos(np.arctan(np.sqrt(2.0))) / np.cos(np.radians(25))  # threads at 54.7°: no pull
        >>> round(abs(float(law.unchecked_force(0.25 * slack, 3e5))), 9)  # N
        0.0
        """
        width, length = as_positive("diameter", diameter), as_positive("reference_length", reference_length)
        angle, factor = as_positive("braid_angle", braid_angle), as_positive("k", k)
        if angle >= pi / 2:
            raise InvalidInput(f"expected braid_angle in rad, below a right angle, got {angle:g}")
        a, b, area, bend = 3 / tan(angle) ** 2, 1 / sin(angle) ** 2, pi / 4 * width**2, factor / length
        terms = {(0, 1): area * (a - b), (1, 1): -2 * area * a * bend, (2, 1): area * a * bend**2}
        return cls(coefficients=terms, reference_length=length, **fields)

    @property
    def in_bar(self) -> dict[tuple[int, int], float]:
        """Coefficients in N m^-i bar^-j."""
        return {(i, j): c * BAR**j for (i, j), c in self.coefficients.items()}

    def _force(self, x: Any, pressure: Any) -> Any:
        return sum(c * x**i * pressure**j for i, j, c in self._terms)

    def _powers(self, pressure: float) -> FloatArray:
        powers = np.zeros(1 + max(i for i, _, _ in self._terms))
        for i, j, c in self._terms:
            powers[i] += c * pressure**j * self.scale**i
        return powers

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        terms = ((c * i, i - 1, j) for i, j, c in self._terms if i)
        return sum((c * x**i * pressure**j for c, i, j in terms), start=0.0 * x * pressure)

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        terms = ((c * j, i, j - 1) for i, j, c in self._terms if j)
        return sum((c * x**i * pressure**j for c, i, j in terms), start=0.0 * x * pressure)


@dataclass(frozen=True, kw_only=True)
class ChouHannaford(PolynomialModel):
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

    Examples
    --------
    >>> from exo_pin.muscle import ChouHannaford, Validity
    >>> limits = Validity(strain=(0.0, 0.25), pressure=(0.0, 5e5))
    >>> law = ChouHannaford(name="braid", reference_length=0.25, validity=limits, braid_length=0.30, turns=1.5)
    >>> slack = 0.25 - 0.30 / np.sqrt(3.0)  # m: the braid's angle is 54.7° and it pulls no more
    >>> round(float(law.force(slack, 3e5, outside="mark").data), 9) + 0.0  # N
    0.0
    """

    braid_length: float
    turns: float
    coefficients: Mapping[tuple[int, int], float] = field(init=False, repr=False, compare=False)
    # They follow from the braid alone.
    from_bar = second_order = tondu_lopez = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        thread, length = (
            as_positive("braid_length", self.braid_length),
            as_positive("reference_length", self.reference_length),
        )
        share = 1.0 / (4 * pi * as_positive("turns", self.turns) ** 2)
        terms = {(0, 1): share * (3 * length**2 - thread**2), (1, 1): -6 * share * length, (2, 1): 3 * share}
        set_fields(self, coefficients=terms)
        super().__post_init__()

    def diameter(self, contraction: Any) -> Any:
        """Diameter in m of the cylinder at a contraction in m, (3-3), (3-4), (3-13): sqrt(b² - L²)/(n π).

        The diameter does not depend on the nominal length, as long as the strain is the same.

        Parameters
        ----------
        contraction : float or ndarray
            m.

        Returns
        -------
        float or ndarray
            m.

        Raises
        ------
        InvalidInput
            If the muscle would be longer than its thread.

        Notes
        -----
        Source: thesis (3-3), (3-4), (3-13).

        Examples
        --------
        >>> from exo_pin.muscle import muscle_model
        >>> law = muscle_model("fitted-chou-hannaford")
        >>> [round(1e3 * float(law.diameter(x)), 1) for x in (0.0, 0.06)]  # mm: it bulges
        [9.1, 12.0]
        """
        x = as_finite("contraction", contraction, (), stack=True) * self.scale
        square = self.braid_length**2 - (self.reference_length - x) ** 2
        if np.any(square < 0):
            raise InvalidInput(f"expected a muscle no longer than its thread of {self.braid_length:g} m")
        return np.sqrt(square) / (self.turns * pi)
